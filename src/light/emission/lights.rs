//! The choice of what emits, and the densities of emission that was found by other means.

use super::sources::What as Chosen;
use super::{Aim, Densities, Emission, EmissionNumbers, EmissionPdf, Source, aim::Outlook};
use crate::geom::{Geometry, Hit, Ray};
use crate::light::local::{self, Part};
use crate::light::moving::Moved;
use crate::light::{Emitter, EmitterSample, Lights, What, textured};
use crate::math::{Frame, Vec2, Vec3, warp};

impl Lights {
    /// Light that leaves one of the emitters, chosen in proportion to power. `None` when these numbers lead
    /// to no light.
    pub fn sample_emission(
        &self,
        geoms: &[Geometry],
        aim: &Aim,
        u: &EmissionNumbers,
    ) -> Option<Emission> {
        let (chosen, prob) = self.sources.pick(u.pick)?;
        let index = match chosen {
            Chosen::Far(index) => return self.sample_far_emission(index, prob, aim, u),
            Chosen::Item(index) => index,
        };
        let item = self.items.get(index)?;
        match &item.what {
            What::Point => self.sample_point_emission(item.emitter, index as u32, prob, aim, u),
            What::Beam { part, table } => {
                self.sample_beam_emission(geoms, (part, *table), index as u32, prob, u)
            }
            what => self.sample_surface_emission(geoms, (what, item.emitter), prob, aim, u),
        }
    }

    /// As [`Lights::sample`], with the densities of the light that would have come from there by emission (that
    /// of its direction is 0 where all light is aimed elsewhere), and the probability of the choice of the
    /// light.
    pub fn sample_both_ways(
        &self,
        geoms: &[Geometry],
        aim: &Aim,
        from: &Hit,
        u_pick: f32,
        u: Vec2,
    ) -> Option<(EmitterSample, EmissionPdf, f32)> {
        let (index, prob) = match self.far.pick(u_pick) {
            (Some(index), share, _) => {
                let emitter = *self.far.emitters.get(index)?;
                let sample = self.sample_far(emitter, u, share)?;
                let pdf = match self.emitters[emitter as usize] {
                    Emitter::Directional { .. } => {
                        self.pdf_parallel_emission(aim, from, sample.wi, emitter)?
                    }
                    _ => self.pdf_sky_emission(aim, from, sample.wi),
                };
                return Some((sample, pdf.stated(), share));
            }
            (None, share, rest) => {
                let (index, prob) = self.choice.pick(from, rest)?;
                (index, prob * share)
            }
        };
        let sample = self.sample_item(geoms, from, index, prob, u)?;
        let pdf = self.pdf_of_connection(geoms, aim, from, index, &sample)?;
        Some((sample, pdf.stated(), prob))
    }

    /// Densities of the emission from the end of a connection to item `index`.
    fn pdf_of_connection(
        &self,
        geoms: &[Geometry],
        aim: &Aim,
        from: &Hit,
        index: usize,
        sample: &EmitterSample,
    ) -> Option<Densities> {
        let item = self.items.get(index)?;
        match &item.what {
            What::Point => self.point_pdf(item.emitter, index, aim, -sample.wi),
            What::Beam { part, .. } => {
                let met = self.end_of(geoms, part, from, sample)?;
                self.beam_pdf(geoms, index, &met)
            }
            What::Part { part, .. } | What::Textured { part, .. } => {
                let met = self.end_of(geoms, part, from, sample)?;
                self.surface_pdf(geoms, index, aim, &met)
            }
        }
    }

    /// The point of a part that a connection leads to, as a ray along it would meet it.
    fn end_of(
        &self,
        geoms: &[Geometry],
        part: &Part,
        from: &Hit,
        sample: &EmitterSample,
    ) -> Option<Hit> {
        let shape = part.shape();
        let g = geoms.get(shape.0 as usize)?;
        let end = sample.end?;
        let moved = self.motion(shape).map(|m| Moved::new(m, from.time));
        let p = moved.as_ref().map_or(end.p, |m| m.into(end.p));
        let at = textured::at_point(part, g, p);
        let ns = match g {
            Geometry::Mesh(m) => {
                let ng = m.face_normal(at.prim);
                let ns = m.shading_normal(at.prim, at.bary, ng);
                match &moved {
                    _ if ns == ng => end.ng,
                    Some(moved) => moved.normal_out(ns),
                    None => ns,
                }
            }
            _ => end.ng,
        };
        Some(Hit {
            p: end.p,
            p_err: end.p_err,
            ng: end.ng,
            frame: Frame::from_normal(ns),
            uv: at.uv,
            wo: -sample.wi,
            time: from.time,
            shape,
            prim: at.prim,
            bary: at.bary,
            place: self.sources.place(shape),
        })
    }

    /// Densities with which [`Lights::sample_emission`] lets light start at `met` along `met.wo`. `None`
    /// where a ray that comes along sees nothing shine.
    pub fn pdf_emission(&self, geoms: &[Geometry], aim: &Aim, met: &Hit) -> Option<EmissionPdf> {
        let index = self.item_at(met)?;
        self.surface_pdf(geoms, index, aim, met)?.rounded()
    }

    /// The same for light from infinity that arrives at `at` from the direction `wi`.
    pub fn pdf_emission_escaped(&self, aim: &Aim, at: &Hit, wi: Vec3) -> Option<EmissionPdf> {
        self.pdf_sky_emission(aim, at, wi).rounded()
    }

    /// Density with which [`Lights::sample`] connects `from` to `source`, in the measure of
    /// [`EmissionPdf::start`].
    pub fn pdf_connection(&self, geoms: &[Geometry], from: &Hit, source: &Source) -> f32 {
        match source {
            Source::Surface(hit) => {
                let d = (hit.p - from.p).as_dvec3();
                let dist2 = d.length_squared();
                let cos = d.dot(hit.ng.as_dvec3()).abs() / dist2.sqrt();
                let pdf = f64::from(self.pdf(geoms, from, hit));
                local::bounded(pdf * cos / dist2)
            }
            Source::Item(index) => self.choice.prob(from, *index as usize) * self.far.near_share(),
            Source::Far { emitter, wi } => match self.emitters.get(*emitter as usize) {
                Some(Emitter::Directional { .. }) => {
                    let index = self.far.emitters.iter().position(|e| e == emitter);
                    index.map_or(0.0, |index| self.far.share(index))
                }
                _ => self.pdf_escaped(from, *wi),
            },
        }
    }

    /// Light of an emitter that stands at a point.
    fn sample_point_emission(
        &self,
        emitter: u32,
        item: u32,
        prob: f64,
        aim: &Aim,
        u: &EmissionNumbers,
    ) -> Option<Emission> {
        let light = self.emitters.get(emitter as usize)?;
        let p = light.standpoint()?;
        let (w, onward) = aim.direct(
            p,
            &light.outlook(),
            u.aim,
            u.direction,
            |u| light.sample_direction(u),
            |w| light.pdf_direction(w),
        )?;
        let ray = Ray {
            time: u.time,
            ..Ray::new(p, w)
        };
        point_densities(prob, onward).emission(ray, light.intensity(w), Source::Item(item))
    }

    /// Densities of the light that a point sends along the unit vector `w`.
    fn point_pdf(&self, emitter: u32, index: usize, aim: &Aim, w: Vec3) -> Option<Densities> {
        let light = self.emitters.get(emitter as usize)?;
        let p = light.standpoint()?;
        let onward = aim.pdf(p, &light.outlook(), w, light.pdf_direction(w));
        Some(point_densities(self.sources.prob_of_item(index), onward))
    }
}

fn point_densities(prob: f64, onward: f64) -> Densities {
    Densities {
        start: prob,
        onward,
        cos: 1.0,
        diverges: true,
        can_be_met: false,
    }
}

/// What stands at a point.
impl Emitter {
    fn outlook(&self) -> Outlook {
        match self {
            Emitter::Spot(spot) => spot.outlook(),
            Emitter::Projector(projector) => projector.outlook(),
            _ => Outlook::ALL_AROUND,
        }
    }

    /// A direction that the light of a point takes, with density [`Emitter::pdf_direction`].
    fn sample_direction(&self, u: Vec2) -> Option<Vec3> {
        match self {
            Emitter::Point { .. } => Some(warp::uniform_sphere(u).normalize()),
            Emitter::Spot(spot) => spot.sample_direction(u),
            Emitter::Projector(projector) => projector.sample_direction(u),
            _ => None,
        }
    }

    /// Per steradian.
    fn pdf_direction(&self, w: Vec3) -> f64 {
        match self {
            Emitter::Point { .. } => 0.25 * std::f64::consts::FRAC_1_PI,
            Emitter::Spot(spot) => spot.pdf_direction(w),
            Emitter::Projector(projector) => projector.pdf_direction(w),
            _ => 0.0,
        }
    }
}
