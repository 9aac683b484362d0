//! Light from infinity, as it enters the scene: through the box around it.

use super::super::{Emitter, Lights};
use super::{Aim, Densities, Emission, EmissionNumbers, Source};
use crate::geom::{Hit, Ray};
use crate::math::{Aabb, DVec3, Vec2, Vec3, fp, warp};

/// The box that all light from infinity is sent through.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::light) struct Cover {
    center: DVec3,
    half: DVec3,
    /// Of a sphere around it, and all roundings of points on its way there.
    radius: f64,
}

impl Cover {
    pub fn new(bounds: &Aabb) -> Cover {
        if bounds.is_empty() {
            return Cover::default();
        }
        let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        let (center, half) = (0.5 * (min + max), 0.5 * (max - min));
        let radius = half.length();
        Cover {
            center,
            half,
            radius: radius + (radius + center.length()) * f64::from(fp::gamma(16)),
        }
    }

    /// Area of each pair of sides.
    fn sides(&self) -> DVec3 {
        let h = self.half;
        4.0 * DVec3::new(h.y * h.z, h.z * h.x, h.x * h.y)
    }

    /// Area of the shadow across the unit vector `d`.
    pub fn section(&self, d: DVec3) -> f64 {
        d.abs().dot(self.sides())
    }

    /// Its mean over all directions, a quarter of the surface (Cauchy).
    pub fn mean_section(&self) -> f64 {
        0.5 * self.sides().element_sum()
    }

    /// A point on the sides that light along `d` enters by, uniform across `d`.
    fn entry(&self, d: DVec3, u: Vec2) -> DVec3 {
        let shares = d.abs() * self.sides();
        let mut x = f64::from(u.x) * shares.element_sum();
        let mut axis = shares.max_position();
        for i in 0..3 {
            if x < shares[i] {
                axis = i;
                break;
            }
            x -= shares[i];
        }
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut p = self.center;
        p[axis] -= self.half[axis].copysign(d[axis]);
        p[j] += self.half[j] * (2.0 * (x / shares[axis]).clamp(0.0, 1.0) - 1.0);
        p[k] += self.half[k] * (2.0 * f64::from(u.y) - 1.0);
        p
    }

    /// Whether the line through `p` along `d` meets the box, to rounding.
    fn crosses(&self, p: DVec3, d: DVec3) -> bool {
        let half = self.half + (self.radius - self.half.length());
        let o = p - self.center;
        let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
        for i in 0..3 {
            if d[i] == 0.0 {
                if o[i].abs() > half[i] {
                    return false;
                }
            } else {
                let reach = half[i].copysign(d[i]);
                near = near.max((-reach - o[i]) / d[i]);
                far = far.min((reach - o[i]) / d[i]);
            }
        }
        near <= far
    }

    /// Where the line through `p` along `d` has not come to the sphere around the box yet.
    fn before(&self, p: DVec3, d: DVec3) -> Vec3 {
        (p - d * ((p - self.center).dot(d) + self.radius)).as_vec3()
    }
}

impl Aim {
    /// Density per area across the unit vector `d` of light from infinity on the line through `p`, which is
    /// aimed at the target `chosen` if that is given.
    fn across(&self, cover: &Cover, d: DVec3, p: DVec3, chosen: Option<usize>) -> f64 {
        let base = 1.0 / cover.section(d);
        let Some(shadow) = self.shadow(cover.section(d)) else {
            return base;
        };
        let inside = |(i, t): (usize, &super::Target)| {
            let v = t.center.as_dvec3() - p;
            chosen == Some(i) || (v - d * v.dot(d)).length_squared() <= t.radius2()
        };
        let inside = self.targets.iter().enumerate().filter(|t| inside(*t));
        let share = self.share();
        (1.0 - share) * base + share * inside.count() as f64 / shadow
    }

    /// Area of the disks of all targets; `None` where light from infinity, which enters through `section`, is
    /// not aimed at them.
    fn shadow(&self, section: f64) -> Option<f64> {
        let shadow = std::f64::consts::PI * self.targets.iter().map(|t| t.radius2()).sum::<f64>();
        (self.share() > 0.0 && shadow > 0.0 && shadow < section).then_some(shadow)
    }

    /// A point that light along `d` passes through, and the target it was aimed at. `None` where that is not
    /// in the scene.
    fn passing(
        &self,
        cover: &Cover,
        d: DVec3,
        u: &EmissionNumbers,
    ) -> Option<(DVec3, Option<usize>)> {
        let share = self.share();
        let aimed = self.shadow(cover.section(d)).is_some() && f64::from(u.aim) < share;
        if !aimed {
            return (cover.section(d) > 0.0).then(|| (cover.entry(d, u.direction), None));
        }
        let weight = |t: &super::Target| t.radius2();
        let index = self.weighted(f64::from(u.aim) / share, weight)?;
        let target = &self.targets[index];
        let disk = warp::concentric_disk(u.direction).as_dvec2() * f64::from(target.radius);
        let (s, t) = d.any_orthonormal_pair();
        let p = target.center.as_dvec3() + s * disk.x + t * disk.y;
        cover.crosses(p, d).then_some((p, Some(index)))
    }
}

impl Lights {
    /// Light of the emitter at infinity of this index, chosen with probability `prob`.
    pub(super) fn sample_far_emission(
        &self,
        index: usize,
        prob: f64,
        aim: &Aim,
        u: &EmissionNumbers,
    ) -> Option<Emission> {
        let emitter = *self.far.emitters.get(index)?;
        let (wi, le, start, can_be_met) = match &self.emitters[emitter as usize] {
            Emitter::Directional { d, irradiance } => (-*d, *irradiance, prob, false),
            Emitter::Constant { .. } => {
                let wi = warp::uniform_sphere(u.place);
                (wi, self.le_escaped(wi), self.pdf_sky(wi), true)
            }
            Emitter::Image(map) => {
                let (wi, ..) = map.sample(u.place)?;
                (wi, self.le_escaped(wi), self.pdf_sky(wi), true)
            }
            _ => return None,
        };
        let cover = &self.sources.cover;
        let d = -wi.as_dvec3();
        let (p, chosen) = aim.passing(cover, d, u)?;
        let ray = Ray {
            time: u.time,
            ..Ray::new(cover.before(p, d), -wi)
        };
        Densities {
            start,
            onward: aim.across(cover, d, p, chosen),
            cos: 1.0,
            diverges: false,
            can_be_met,
        }
        .emission(ray, le, Source::Far { emitter, wi })
    }

    /// Density per steradian with which light is emitted from the direction `wi` at infinity, by any of the
    /// environments.
    fn pdf_sky(&self, wi: Vec3) -> f64 {
        let far = self.far.emitters.iter().enumerate();
        far.map(|(k, &i)| match &self.emitters[i as usize] {
            Emitter::Image(map) => f64::from(map.pdf(wi)) * self.sources.prob_of_far(k),
            Emitter::Constant { .. } => {
                f64::from(warp::uniform_cone_pdf(2.0)) * self.sources.prob_of_far(k)
            }
            _ => 0.0,
        })
        .sum()
    }

    /// Densities of light from the direction `wi` at infinity that arrives at `at`.
    pub(super) fn pdf_sky_emission(&self, aim: &Aim, at: &Hit, wi: Vec3) -> Densities {
        self.pdf_entering(aim, at, wi, self.pdf_sky(wi), true)
    }

    /// The same for directional light of the emitter of this number.
    pub(super) fn pdf_parallel_emission(
        &self,
        aim: &Aim,
        at: &Hit,
        wi: Vec3,
        emitter: u32,
    ) -> Option<Densities> {
        let index = self.far.emitters.iter().position(|&e| e == emitter)?;
        Some(self.pdf_entering(aim, at, wi, self.sources.prob_of_far(index), false))
    }

    /// Densities of light from the direction `wi` with this density or probability of its start.
    fn pdf_entering(
        &self,
        aim: &Aim,
        at: &Hit,
        wi: Vec3,
        start: f64,
        can_be_met: bool,
    ) -> Densities {
        let (p, d) = (at.p.as_dvec3(), -wi.as_dvec3());
        Densities {
            start,
            onward: aim.across(&self.sources.cover, d, p, None),
            cos: 1.0,
            diverges: false,
            can_be_met,
        }
    }
}
