//! Light that leaves surfaces.
//!
//! A surface shines to the side of its shading normal, and what a receiver gets of it goes by the cosine at
//! its geometric normal: so says direct lighting, and so does emission. Its directions therefore have the
//! density |cos| / π of the geometric normal, each turned to the side that shines; the power is then the
//! same in all of them.

use super::{Aim, Densities, Emission, EmissionNumbers, Source};
use crate::geom::{Geometry, Hit, Ray};
use crate::light::local::Part;
use crate::light::moving::Moved;
use crate::light::{Lights, What, place_of, textured};
use crate::math::warp::{self, Tabulated2};
use crate::math::{Frame, PI, Vec2, Vec3, fp};
use crate::texture::At;

use super::aim::Outlook;

/// A point of a surface, chosen to emit.
struct Start {
    hit: Hit,
    /// Density per unit of area in the world, for the item.
    density: f64,
    at: At,
}

impl Lights {
    /// Light of the surface of an item, chosen with probability `prob`.
    pub(super) fn sample_surface_emission(
        &self,
        geoms: &[Geometry],
        (what, emitter): (&What, u32),
        prob: f64,
        aim: &Aim,
        u: &EmissionNumbers,
    ) -> Option<Emission> {
        let (part, table) = match *what {
            What::Part { part, .. } => (part, None),
            What::Textured { part, table } => (part, self.table(table)),
            What::Beam { .. } | What::Point => return None,
        };
        let mut start = self.start(geoms, &part, table, u)?;
        let hit = &mut start.hit;
        let (w, onward) = aim.direct(
            hit.p,
            &outlook(hit),
            u.aim,
            u.direction,
            |u| Some(unaimed(hit, u)),
            |w| unaimed_pdf(hit, w),
        )?;
        hit.wo = w;
        if w.dot(hit.frame.n) <= 0.0 {
            return None;
        }
        let le = match *what {
            What::Part { radiance, .. } => radiance,
            _ => self.textured(emitter, &start.at),
        };
        surface_densities(prob * start.density, onward, &start.hit).emission(
            leaving(&start.hit),
            le,
            Source::Surface(start.hit),
        )
    }

    /// Light of the beams of an item.
    pub(super) fn sample_beam_emission(
        &self,
        geoms: &[Geometry],
        (part, table): (&Part, Option<u32>),
        item: u32,
        prob: f64,
        u: &EmissionNumbers,
    ) -> Option<Emission> {
        let mut start = self.start(geoms, part, self.table(table), u)?;
        let hit = &mut start.hit;
        hit.wo = hit.ng * hit.ng.dot(hit.frame.n).signum();
        let emitter = self.items.get(item as usize)?.emitter;
        let exitance = self.textured(emitter, &start.at);
        beam_densities(prob, start.density).emission(
            leaving(&start.hit),
            exitance,
            Source::Item(item),
        )
    }

    fn start(
        &self,
        geoms: &[Geometry],
        part: &Part,
        table: Option<&Tabulated2>,
        u: &EmissionNumbers,
    ) -> Option<Start> {
        let shape = part.shape();
        let g = geoms.get(shape.0 as usize)?;
        let (place, density) = match table {
            Some(table) => table.sample(u.place),
            None => (u.place, 1.0),
        };
        let (s, at) = textured::place(part, g, place);
        let mut density = f64::from(density) / part.area(g);
        let (mut p, mut p_err, mut ng, mut ns) = (s.p, s.p_err, s.ng, s.ns);
        if let Some(motion) = self.motion(shape) {
            let moved = Moved::new(motion, u.time);
            density /= moved.area_scale(ng);
            (p, p_err) = moved.point_out(p, p_err);
            (ng, ns) = (moved.normal_out(ng), moved.normal_out(ns));
        }
        let hit = Hit {
            p,
            p_err,
            ng,
            frame: Frame::from_normal(ns),
            uv: at.uv,
            wo: ns,
            time: u.time,
            shape,
            prim: match g.is_mesh() {
                true => at.prim,
                false => 0,
            },
            bary: at.bary,
            place: self.sources.place(shape),
        };
        Some(Start { hit, density, at })
    }

    /// Densities of the light that leaves `met`, a point of the surface of item `index`, along `met.wo`.
    pub(super) fn surface_pdf(
        &self,
        geoms: &[Geometry],
        index: usize,
        aim: &Aim,
        met: &Hit,
    ) -> Option<Densities> {
        let what = &self.items.get(index)?.what;
        let density = match what {
            What::Part { .. } | What::Textured { .. } => self.area_density(geoms, what, met)?,
            What::Beam { .. } | What::Point => return None,
        };
        let start = self.sources.prob_of_item(index) * density;
        let onward = aim.pdf(met.p, &outlook(met), met.wo, unaimed_pdf(met, met.wo));
        Some(surface_densities(start, onward, met))
    }

    /// Densities of the beam that leaves `met`, a point of the surface of item `index`.
    pub(super) fn beam_pdf(
        &self,
        geoms: &[Geometry],
        index: usize,
        met: &Hit,
    ) -> Option<Densities> {
        let what = &self.items.get(index)?.what;
        let across = self.area_density(geoms, what, met)?;
        Some(beam_densities(self.sources.prob_of_item(index), across))
    }

    /// Density per unit of area in the world with which light of an item starts at `met`.
    fn area_density(&self, geoms: &[Geometry], what: &What, met: &Hit) -> Option<f64> {
        let (part, table) = match *what {
            What::Part { part, .. } => (part, None),
            What::Textured { part, table } | What::Beam { part, table } => {
                (part, self.table(table))
            }
            What::Point => return None,
        };
        let g = geoms.get(part.shape().0 as usize)?;
        let (p, scale) = match self.moved(what, met) {
            Some(moved) => (
                Moved::into(&moved, met.p),
                moved.area_scale(moved.normal_into(met.ng)),
            ),
            None => (met.p, 1.0),
        };
        let density = match table {
            Some(table) => f64::from(textured::table_density(&part, g, table, p, &place_of(met))),
            None => 1.0,
        };
        Some(density / (part.area(g) * scale))
    }
}

fn surface_densities(start: f64, onward: f64, hit: &Hit) -> Densities {
    Densities {
        start,
        onward,
        cos: f64::from(hit.ng.dot(hit.wo).abs()),
        diverges: true,
        can_be_met: true,
    }
}

/// Beams of curved surfaces spread; both ways to find them agree to leave that out of the density.
fn beam_densities(prob: f64, across: f64) -> Densities {
    Densities {
        start: prob,
        onward: across,
        cos: 1.0,
        diverges: false,
        can_be_met: false,
    }
}

fn outlook(hit: &Hit) -> Outlook {
    Outlook {
        axis: hit.frame.n,
        reach: 0.5 * PI,
        by_cosine: true,
    }
}

/// A direction into which the surface shines.
fn unaimed(hit: &Hit, u: Vec2) -> Vec3 {
    let ns = hit.frame.n;
    let side = hit.ng * hit.ng.dot(ns).signum();
    let w = Frame::from_normal(side).to_world(warp::cosine_hemisphere(u));
    match w.dot(ns) < 0.0 {
        true => -w,
        false => w,
    }
}

fn unaimed_pdf(hit: &Hit, w: Vec3) -> f64 {
    match w.dot(hit.frame.n) > 0.0 {
        true => f64::from(hit.ng.dot(w).abs()) * std::f64::consts::FRAC_1_PI,
        false => 0.0,
    }
}

/// The ray along `hit.wo`.
fn leaving(hit: &Hit) -> Ray {
    Ray {
        time: hit.time,
        ..Ray::new(fp::offset_origin(hit.p, hit.p_err, hit.ng, hit.wo), hit.wo)
    }
}
