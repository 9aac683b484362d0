//! Where the energy of a solution went, and what radiosity leaves out of a scene.

use super::surfaces::Surfaces;
use super::{PatchMesh, Report, Rgb64, mesh};
use crate::scene::Scene;
use rayon::prelude::*;
use std::cmp::Ordering;

/// What the balance is made of.
pub(super) struct Balance<'a> {
    pub mesh: &'a PatchMesh,
    /// W/m² per patch: from lights that are no patches, and in all.
    pub external: &'a [Rgb64],
    pub irradiance: &'a [Rgb64],
    /// W.
    pub escaped: Rgb64,
}

/// Light made of nothing that is worth a sentence, as a share of what is emitted.
const MADE: f64 = 0.1;

/// Shares of light below this are not worth a sentence.
const NEGLIGIBLE: f64 = 1e-3;

/// A report with energies, the share of other scattering and the warnings that these give.
pub(super) fn of(scene: &Scene, balance: &Balance) -> Report {
    let patches = &balance.mesh.patches;
    let mut report = Report {
        escaped: balance.escaped,
        ..Report::default()
    };
    for ((patch, &external), &irradiance) in
        patches.iter().zip(balance.external).zip(balance.irradiance)
    {
        report.emitted += patch.emission * patch.area;
        report.external += external * patch.area;
        report.absorbed += (Rgb64::ONE - patch.albedo) * irradiance * patch.area;
    }
    let lost = NotAbsorbed::of(scene, balance);
    report.other = lost.other_share();
    report.absorbed -= lost.through;
    // Patches have not got it after all.
    report.escaped += lost.through;
    report.warnings = warnings(&balance.mesh.surfaces, &report);
    report
}

/// Light that arrives at patches, and what becomes of it but to be absorbed or reflected diffusely.
#[derive(Clone, Copy, Default)]
struct NotAbsorbed {
    /// W, summed over the channels.
    arriving: f64,
    /// The same, of what is scattered, but not diffusely.
    other: f64,
    /// W that go through masks.
    through: Rgb64,
}

impl NotAbsorbed {
    fn of(scene: &Scene, balance: &Balance) -> NotAbsorbed {
        let mesh = balance.mesh;
        let one = |(patch, &irradiance): (&super::Patch, &Rgb64)| {
            let optics = mesh::of_piece(scene, &mesh.surfaces, patch.facet, &patch.piece);
            let arriving = irradiance * patch.area;
            NotAbsorbed {
                arriving: arriving.element_sum(),
                other: (optics.other * arriving).element_sum(),
                through: optics.through * arriving,
            }
        };
        let patches = mesh.patches.par_iter().zip(balance.irradiance);
        let parts: Vec<NotAbsorbed> = patches.map(one).collect();
        let mut sum = NotAbsorbed::default();
        for part in parts {
            sum.arriving += part.arriving;
            sum.other += part.other;
            sum.through += part.through;
        }
        sum
    }

    /// Share of the arriving light.
    fn other_share(&self) -> f64 {
        match self.arriving > 0.0 {
            true => self.other / self.arriving,
            false => 0.0,
        }
    }
}

/// What the user should know of the scene.
fn warnings(surfaces: &Surfaces, report: &Report) -> Vec<String> {
    let mut warnings = Vec::new();
    let left_out = &surfaces.left_out;
    let percent = |share: f64| 100.0 * share;
    if report.other > NEGLIGIBLE {
        warnings.push(format!(
            "{:.1} % of the light that arrives at patches is scattered by mirrors, gloss or glass: radiosity \
             leaves it out",
            percent(report.other)
        ));
    }
    if left_out.share() > NEGLIGIBLE {
        warnings.push(format!(
            "{:.1} % of the area of all surfaces neither reflects diffusely nor shines: it only blocks light",
            percent(left_out.share())
        ));
    }
    if left_out.moving > 0 {
        warnings.push(format!(
            "{} in motion or changing form: no patches are made of them, they block light where they are when the \
             shutter opens, and reflect none",
            shapes(left_out.moving)
        ));
    }
    if left_out.formless > 0 {
        warnings.push(format!(
            "{} given by grids of distances: no patches are made of them, they block light and reflect none",
            shapes(left_out.formless)
        ));
    }
    let (external, emitted) = (report.external.element_sum(), report.emitted.element_sum());
    let arriving = report.absorbed.element_sum();
    if external + emitted == 0.0 {
        warnings.push("no light arrives at any patch".to_string());
    } else if arriving < NEGLIGIBLE * (external + emitted) && left_out.share() > 0.0 {
        warnings.push(
            "hardly any light arrives at patches: glass and mirrors, which radiosity leaves out, may shut it in (a path \
             tracer finds it, with indirect=gather too)"
                .to_string(),
        );
    }
    warnings
}

/// What the user should know of a solution by links: that it is not done, or has more light than there can be. `asked`
/// is the residual that was asked for.
pub(super) fn doubts(report: &Report, asked: f64) -> Vec<String> {
    let mut doubts = Vec::new();
    if !report.converged && report.residual.partial_cmp(&asked) != Some(Ordering::Less) {
        doubts.push(format!(
            "the solver stopped after {} steps with a residual of {:.2e}, which is more than was asked for",
            report.steps, report.residual
        ));
    }
    let given = (report.emitted + report.external).element_sum();
    let absorbed = report.absorbed.element_sum();
    // What is scattered in other ways counts as absorbed wherever it arrives; and what still grows says nothing.
    if report.converged && report.other <= NEGLIGIBLE && absorbed > given * (1.0 + MADE) {
        doubts.push(format!(
            "patches absorb {:.3} times the light that there is: surfaces that coincide get it twice (leave one of them \
             out), or lights are much smaller than patches (use a smaller min_size or patch_size)",
            absorbed / given
        ));
    }
    doubts
}

fn shapes(count: u32) -> String {
    match count {
        1 => "1 shape".to_string(),
        n => format!("{n} shapes"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What of the light of 1 W that is absorbed is worth a sentence.
    #[test]
    fn says_what_cannot_be() {
        let report = |converged, absorbed: f64, other| Report {
            converged,
            emitted: Rgb64::ONE,
            absorbed: Rgb64::splat(absorbed),
            other,
            ..Report::default()
        };
        assert!(doubts(&report(true, 1.05, 0.0), 0.0).is_empty());
        assert!(doubts(&report(true, 1.5, 0.4), 0.0).is_empty());
        let made = doubts(&report(true, 1.5, 0.0), 0.0);
        assert!(matches!(&made[..], [one] if one.contains("1.500 times")));
        let stopped = doubts(&report(false, 1.5, 0.0), 0.0);
        assert!(matches!(&stopped[..], [one] if one.contains("stopped after 0 steps")));
    }
}
