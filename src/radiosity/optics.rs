//! What radiosity needs to know of a surface: diffuse reflectance and exitance.

use super::Rgb64;
use super::piece::Outline;
use crate::bsdf::Bsdf;
use crate::geom::Hit;
use crate::math::{DVec2, Rgb};
use crate::scene::Scene;
use std::f64::consts::PI;

/// Means over a piece of surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Optics {
    /// Diffuse reflectance, in [0,1].
    pub albedo: Rgb64,
    /// Share of light from the normal's direction that is scattered in other ways: by mirrors, gloss, glass.
    pub other: Rgb64,
    /// Share of light that goes straight on, as if there were nothing: by masks.
    pub through: Rgb64,
    /// Of it, what surfaces scatter that light does not pass through.
    pub gloss: Rgb64,
    /// Exitance of the emitter that the surface is, in W/m².
    pub emission: Rgb64,
}

/// Optics at one place; `u` in [0,1) decides where a material is mixed.
pub fn at(scene: &Scene, hit: &Hit, u: f32) -> Optics {
    let shading = scene.shade(hit, u);
    let seen = shading.normal().dot(hit.wo) > 0.0;
    let albedo = match seen {
        true => shading.bsdf.diffuse_albedo(),
        false => Rgb::BLACK,
    };
    let through = match shading.bsdf {
        Bsdf::Null(null) => null.transmittance,
        _ => Rgb::BLACK,
    };
    let other = rgb64(shading.albedo() - albedo - through).max(Rgb64::ZERO);
    Optics {
        albedo: rgb64(albedo).clamp(Rgb64::ZERO, Rgb64::ONE),
        other,
        through: rgb64(through).clamp(Rgb64::ZERO, Rgb64::ONE),
        gloss: match seen && shading.bsdf.is_opaque() {
            true => other,
            false => Rgb64::ZERO,
        },
        emission: rgb64(scene.le(hit)) * PI,
    }
}

/// The mean over `points` points in the piece's outline, which `look` turns into hits. The points are spread well
/// but not in rows, which patterns of textures could fall in step with (the sequence R of Roberts 2018, "The
/// Unreasonable Effectiveness of Quasirandom Sequences"). With `gloss_as_diffuse`, what is reflected in other ways
/// counts as reflected diffusely.
pub fn mean(
    scene: &Scene,
    look: impl Fn(DVec2) -> Hit,
    outline: Outline,
    points: u32,
    gloss_as_diffuse: bool,
) -> Optics {
    let mut sum = Optics::default();
    let n = points.max(1);
    for i in 0..n {
        let at = |step: f64| (0.5 + f64::from(i) * step).fract();
        let u = DVec2::new(at(0.754_877_666_246_693), at(0.569_840_290_998_053));
        let hit = look(outline.sample(u));
        // Well spread also over the choices of mixed materials (the golden ratio).
        let one = self::at(scene, &hit, at(0.618_033_988_749_895) as f32);
        sum.albedo += one.albedo;
        sum.other += one.other;
        sum.through += one.through;
        sum.gloss += one.gloss;
        sum.emission += one.emission;
    }
    let share = 1.0 / f64::from(n);
    let turned = match gloss_as_diffuse {
        true => sum.gloss,
        false => Rgb64::ZERO,
    };
    Optics {
        albedo: ((sum.albedo + turned) * share).min(Rgb64::ONE),
        other: (sum.other - turned) * share,
        through: sum.through * share,
        gloss: (sum.gloss - turned) * share,
        emission: sum.emission * share,
    }
}

/// In f64.
pub fn rgb64(c: Rgb) -> Rgb64 {
    Rgb64::new(f64::from(c.r), f64::from(c.g), f64::from(c.b))
}
