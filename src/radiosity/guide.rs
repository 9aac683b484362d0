//! Where diffuse light comes from: a distribution over the patches that light each patch.
//!
//! The links of a patch and of its ancestors partition all senders of its light: with probability proportional to
//! the irradiance that it brings, a link is chosen; below its sender a patch, by its power; on that a point, uniform
//! over its area. What emitters send is left out, since they are sampled by themselves, so nothing is aimed at their
//! surfaces.
//!
//! Links err: one that a few rays found blocked is not there, though some points of its ends see each other, and what
//! comes that way is then very noisy. So patches that lie together share one distribution, the mean of theirs, and a
//! part of it is the mean over a wider neighbourhood, a part of that over a wider one still ([`REGIONS`]). As ranges
//! of patches such a mean is one short table, in which sampling and density are one search each.
//!
//! The technique is "a point of patch q, seen from p": a direction counts only if what a ray meets first lies on the
//! very patch that was aimed at. A direction that meets q then has one density, whoever found it. Patches are flat,
//! while what they stand for may be curved: a direction that meets the surface of q, but passes beside its flat
//! piece, is never aimed at, and has density 0.

mod spread;

use super::{Outline, Patch, Piece, Rgb64, Solution};
use crate::geom::Hit;
use crate::math::{DVec2, DVec3, Vec3};
use crate::scene::Scene;
use rayon::prelude::*;
use spread::{Prefix, Senders, Step, positive};
use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;

/// The distributions, made of a hierarchical solution.
#[derive(Debug)]
pub struct Guide {
    solution: Arc<Solution>,
    /// By patch: which of `tables` its light is found by; [`NONE`] if no link brings any.
    table_of: Vec<u32>,
    /// Where each table begins in `firsts` and `before`, and the end of the last.
    tables: Vec<u32>,
    /// First patch of each step, the last of a table being the end of the one before.
    firsts: Vec<u32>,
    /// Probability of the steps before in the table.
    before: Vec<f64>,
    /// Probability per power, in 1/W.
    density: Vec<f64>,
    /// Power in W, as luminance and without emitters, of the patches.
    power: Prefix,
    /// By patch.
    glow: Vec<Glow>,
}

/// What a patch sends without what it emits.
#[derive(Clone, Copy, Debug)]
struct Glow {
    /// What it is aimed at for, in W/m² as luminance; 0 on emitters.
    exitance: f64,
    /// In W/(m² sr), as luminance.
    radiance: f32,
    /// Whether what it stands for is curved.
    curved: bool,
}

/// A patch that light comes to.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    table: u32,
}

/// A point that was aimed at.
#[derive(Clone, Copy, Debug)]
pub struct Aim {
    /// What a ray has to meet first for the sample to count.
    pub patch: u32,
    /// Unit direction.
    pub wi: Vec3,
}

const NONE: u32 = u32::MAX;

/// Share of the area of all surfaces that has one distribution at most, then that takes part in what is mixed into it,
/// and into that.
const REGIONS: [f64; 3] = [1.0 / 2048.0, 1.0 / 256.0, 1.0 / 32.0];
/// Share of what is mixed in.
const WIDER: f64 = 0.15;
/// Neighbouring steps of a table are joined if they are less probable than this together.
const STEP: f64 = 1.0 / 512.0;

impl Guide {
    /// What the links of `solution` know of the light in `scene`; `None` if it has no links.
    pub fn new(scene: &Scene, solution: Arc<Solution>) -> Option<Guide> {
        let hierarchy = solution.hierarchy.as_ref()?;
        let patches = &solution.mesh.patches;
        let facets = solution.mesh.surfaces.facets();
        let glow = |(patch, &b): (&Patch, &Rgb64)| {
            let facet = &facets[patch.facet as usize];
            let reflected = luminance(b - patch.emission);
            Glow {
                exitance: match scene.is_emitter(facet.shape) {
                    true => 0.0,
                    false => positive(reflected),
                },
                radiance: (reflected / PI) as f32,
                curved: facet.is_curved(),
            }
        };
        let glow: Vec<Glow> = patches.iter().zip(&solution.radiosity).map(glow).collect();
        let sent = |(glow, patch): (&Glow, &Patch)| positive(glow.exitance * patch.area);
        let power = Prefix::new(glow.iter().zip(patches).map(sent));
        let area = Prefix::new(patches.iter().map(|patch| patch.area));
        let senders = Senders::new(hierarchy, &area, &power);
        let regions = mixed(&senders, &area, &power);
        let mut guide = Guide {
            table_of: vec![NONE; patches.len()],
            tables: vec![0],
            firsts: Vec::new(),
            before: Vec::new(),
            density: Vec::new(),
            power,
            glow,
            solution,
        };
        for (range, steps) in regions {
            if !steps.is_empty() {
                let table = guide.tables.len() as u32 - 1;
                guide.table_of[range.start as usize..range.end as usize].fill(table);
                guide.push(&steps);
            }
        }
        Some(guide)
    }

    /// Another table. Gaps between steps become steps of density 0.
    fn push(&mut self, steps: &[Step]) {
        let (mut end, mut sum) = (0, 0.0);
        let mut add = |first: u32, before: f64, density: f64| {
            self.firsts.push(first);
            self.before.push(before);
            self.density.push(density);
        };
        for step in steps {
            if step.first > end {
                add(end, sum, 0.0);
            }
            add(step.first, sum, step.density);
            sum += step.density * self.power.over(step.first, step.end);
            end = step.end;
        }
        add(end, sum, 0.0);
        let begin = self.tables[self.tables.len() - 1] as usize;
        for i in begin..self.before.len() {
            self.before[i] /= sum;
            self.density[i] /= sum;
        }
        self.tables.push(self.firsts.len() as u32);
    }

    /// A patch, if links bring light to it or to patches around it.
    #[inline]
    pub fn receiver(&self, patch: u32) -> Option<Receiver> {
        let table = *self.table_of.get(patch as usize)?;
        (table != NONE).then_some(Receiver { table })
    }

    /// The patch at `hit` on the side of `hit.wo`.
    #[inline]
    pub fn patch(&self, hit: &Hit) -> Option<u32> {
        Some(self.solution.mesh.locate(hit)?.patch)
    }

    /// Irradiance of a patch in W/m², as luminance.
    #[inline]
    pub fn irradiance(&self, patch: u32) -> f32 {
        luminance(self.solution.irradiance[patch as usize]) as f32
    }

    /// Radiance in W/(m² sr), as luminance, of a patch without what it emits.
    #[inline]
    pub fn radiance(&self, patch: u32) -> f32 {
        self.glow[patch as usize].radiance
    }

    /// Probability with which `patch` is aimed at for `receiver`.
    pub fn probability(&self, receiver: Receiver, patch: u32) -> f64 {
        self.per_power(receiver, patch) * self.power.over(patch, patch + 1)
    }

    /// A direction from `p` towards a point that sends light to `receiver`; `choice` in [0,1) chooses the patch, `u`
    /// in [0,1)² the point. `None` where the patch that was chosen turns its back.
    #[inline]
    pub fn sample(&self, receiver: Receiver, p: Vec3, choice: f64, u: DVec2) -> Option<Aim> {
        let patch = self.choose(receiver, choice)?;
        let piece = &self.solution.mesh.patches[patch as usize].piece;
        let d = piece.sample(u) - p.as_dvec3();
        (d.dot(piece.cross()) < 0.0).then(|| Aim {
            patch,
            wi: d.normalize_or_zero().as_vec3(),
        })
    }

    /// Density per steradian with which [`Guide::sample`] aims from `p` along `wi` at the patch at `met`.
    #[inline]
    pub fn pdf(&self, receiver: Receiver, p: Vec3, wi: Vec3, met: &Hit, patch: u32) -> f32 {
        let glow = self.glow[patch as usize];
        let pdf_a = match glow.exitance > 0.0 {
            true => glow.exitance * self.per_power(receiver, patch),
            false => 0.0,
        };
        if pdf_a == 0.0 {
            return 0.0;
        }
        let area_per_sr = match glow.curved {
            true => {
                let flat = Flat::new(&self.solution.mesh.patches[patch as usize].piece);
                flat.area_per_sr(p.as_dvec3(), wi.as_dvec3())
            }
            // What was met lies on the patch.
            false => {
                let d = met.p.as_dvec3() - p.as_dvec3();
                d.length_squared() / f64::from(met.ng.dot(wi).abs())
            }
        };
        bounded(pdf_a * area_per_sr)
    }

    /// The steps of the table of `receiver`.
    #[inline]
    fn table(&self, receiver: Receiver) -> std::ops::Range<usize> {
        let table = receiver.table as usize;
        self.tables[table] as usize..self.tables[table + 1] as usize
    }

    /// Probability per power of `patch`, in 1/W.
    #[inline]
    fn per_power(&self, receiver: Receiver, patch: u32) -> f64 {
        let table = self.table(receiver);
        let behind = self.firsts[table.clone()].partition_point(|first| *first <= patch);
        match behind {
            0 => 0.0,
            behind => self.density[table.start + behind - 1],
        }
    }

    /// The patch that `choice` in [0,1) falls on.
    #[inline]
    fn choose(&self, receiver: Receiver, choice: f64) -> Option<u32> {
        let table = self.table(receiver);
        let before = &self.before[table.clone()];
        let behind = before.partition_point(|sum| *sum <= choice);
        // The last entry is the end of the table.
        let step = table.start + behind.min(before.len() - 1).checked_sub(1)?;
        let (first, end) = (self.firsts[step], self.firsts[step + 1]);
        let power = (choice - self.before[step]) / self.density[step];
        Some(self.power.find(first, end, power))
    }
}

/// The distributions of all regions.
fn mixed(senders: &Senders, area: &Prefix, power: &Prefix) -> Vec<(Range<u32>, Vec<Step>)> {
    let mut wider: Vec<(Range<u32>, Vec<Step>)> = Vec::new();
    let all = area.whole();
    for most in REGIONS.into_iter().rev() {
        let ranges = senders.regions(area, most * all);
        let own = ranges.into_par_iter().map(|range| {
            let own = spread::joined(&senders.of(&range), power, STEP);
            // The last region that begins no later.
            let behind = wider.partition_point(|(wide, _)| wide.start <= range.start);
            let steps = match behind.checked_sub(1).map(|i| &wider[i].1) {
                None => own,
                Some(around) => {
                    let both = [(&own[..], 1.0 - WIDER), (&around[..], WIDER)];
                    spread::joined(&spread::sum(both.into_iter()), power, STEP)
                }
            };
            (range, steps)
        });
        wider = own.collect();
    }
    wider
}

/// The flat piece of a patch, made ready to be met.
#[derive(Clone, Copy, Debug)]
struct Flat {
    o: DVec3,
    /// Unit normal.
    n: DVec3,
    /// What `p - o` is multiplied with for the coordinates of `p` in the piece.
    s: DVec3,
    t: DVec3,
    outline: Outline,
}

impl Flat {
    fn new(piece: &Piece) -> Flat {
        let n = piece.normal();
        // |e1 x e2|, as e1 x e2 is along n.
        let whole = piece.cross().dot(n);
        Flat {
            o: piece.o,
            n,
            s: piece.e2.cross(n) / whole,
            t: n.cross(piece.e1) / whole,
            outline: piece.outline,
        }
    }

    /// Area of the piece per steradian at `p` in the unit direction `wi`: squared distance over cosine. 0 where the
    /// line along `wi` does not pass through the piece from its front.
    #[inline]
    fn area_per_sr(&self, p: DVec3, wi: DVec3) -> f64 {
        let cos = -wi.dot(self.n);
        let height = (p - self.o).dot(self.n);
        let faces = cos > 0.0 && height > 0.0;
        if !faces {
            return 0.0;
        }
        let distance = height / cos;
        let d = p + wi * distance - self.o;
        match self
            .outline
            .contains(DVec2::new(d.dot(self.s), d.dot(self.t)))
        {
            true => distance * distance / cos,
            false => 0.0,
        }
    }
}

/// In the range of f32, and 0 for what is not a number.
fn bounded(pdf: f64) -> f32 {
    match pdf > 0.0 {
        true => pdf.min(f64::from(f32::MAX)) as f32,
        false => 0.0,
    }
}

fn luminance(c: Rgb64) -> f64 {
    c.dot(Rgb64::new(0.212_671, 0.715_160, 0.072_169))
}
