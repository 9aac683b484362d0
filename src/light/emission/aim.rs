//! Emission aimed at what can throw a caustic (the projection maps of Jensen 2001, section 5.1, with spheres
//! instead of cells).
//!
//! A share of the emission goes to spheres, and the density of a direction is that of the mixture: nothing
//! is lost or counted twice, however the spheres lie. From a point, directions are uniform over the cone
//! that a sphere covers; from infinity ([`far`](super::far)), lines are uniform over its disk. A sphere that
//! covers too much to be worth it, or holds the start, stands for emission that is not aimed. Light of
//! beams, which has one direction at each place, is not aimed.

use crate::math::{DVec3, Frame, Vec2, Vec3, fp, warp};

/// Where light is aimed at: spheres around what can throw a caustic. Empty: nowhere in particular.
#[derive(Clone, Debug, Default)]
pub struct Aim {
    /// Share of the emission that is aimed, 0 to 1. With 1, light that meets none of the targets is never
    /// emitted (but by beams).
    pub share: f32,
    pub targets: Vec<Target>,
}

/// A sphere, in scene coordinates. Without a positive radius it is passed over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    pub center: Vec3,
    pub radius: f32,
}

/// Squared sine of the half-angle from which on a target is not aimed at: 60 degrees.
const WIDE: f64 = 0.75;

/// Squared sine of the smallest half-angle: f32 directions do not resolve smaller cones well.
const NARROW: f64 = (64.0 * f32::EPSILON as f64) * (64.0 * f32::EPSILON as f64);

/// Directions into which a start sends light.
#[derive(Clone, Copy, Debug)]
pub(in crate::light) struct Outlook {
    pub axis: Vec3,
    /// Largest angle to the axis, π for all directions.
    pub reach: f32,
    /// Whether light falls off as the cosine to the axis.
    pub by_cosine: bool,
}

impl Outlook {
    pub const ALL_AROUND: Outlook = Outlook {
        axis: Vec3::Z,
        reach: std::f32::consts::PI,
        by_cosine: false,
    };
}

/// A target as seen from a start.
struct View {
    /// `None` for a target that is not worth aiming at.
    cone: Option<Cone>,
    /// In proportion to which the target is chosen.
    weight: f64,
}

struct Cone {
    axis: DVec3,
    /// Of the cap of directions, `1 - cos` of the half-angle, whose squared sine is `sin2`.
    height: f64,
    sin2: f64,
}

impl Cone {
    fn solid_angle(&self) -> f64 {
        std::f64::consts::TAU * self.height
    }

    fn holds(&self, w: DVec3) -> bool {
        w.dot(self.axis) > 0.0 && w.cross(self.axis).length_squared() <= self.sin2
    }

    fn sample(&self, u: Vec2) -> Vec3 {
        let frame = Frame::from_normal(self.axis.as_vec3());
        let w = frame.to_world(warp::uniform_cone(u, self.height as f32));
        w.normalize()
    }
}

impl Target {
    pub(super) fn radius2(&self) -> f64 {
        let r = f64::from(self.radius);
        match r > 0.0 && r.is_finite() {
            true => r * r,
            false => 0.0,
        }
    }

    /// `None` where no light of the start can go.
    fn view(&self, from: Vec3, outlook: &Outlook) -> Option<View> {
        let r2 = self.radius2();
        if r2 == 0.0 {
            return None;
        }
        let d = self.center.as_dvec3() - from.as_dvec3();
        let d2 = d.length_squared();
        let sin2 = r2 / d2;
        if sin2.is_nan() || sin2 > WIDE {
            return Some(View {
                cone: None,
                weight: std::f64::consts::TAU,
            });
        }
        let sin2 = sin2.max(NARROW);
        let axis = d / d2.sqrt();
        let to_axis = outlook.axis.as_dvec3();
        let angle = axis.cross(to_axis).length().atan2(axis.dot(to_axis));
        // Between the axis and the nearest direction of the cone.
        let gap = (angle - sin2.sqrt().asin()).max(0.0);
        if gap >= f64::from(outlook.reach) && outlook.reach < std::f32::consts::PI {
            return None;
        }
        let cone = Cone {
            axis,
            height: sin2 / (1.0 + (1.0 - sin2).sqrt()),
            sin2,
        };
        let most = if outlook.by_cosine { gap.cos() } else { 1.0 };
        let weight = cone.solid_angle() * most.max(f64::from(fp::gamma(1)));
        Some(View {
            cone: Some(cone),
            weight,
        })
    }
}

/// What is aimed at.
enum Choice {
    /// Nothing in particular.
    Free,
    Target(usize, Cone),
}

impl Aim {
    /// The share within its range, 0 where there is no target.
    pub(super) fn share(&self) -> f64 {
        // In this form a NaN is no share.
        match self.share > 0.0 && !self.targets.is_empty() {
            true => f64::from(self.share.min(1.0)),
            false => 0.0,
        }
    }

    /// The target that `x` in [0,1) chooses in proportion to `weight`.
    pub(super) fn weighted(&self, x: f64, weight: impl Fn(&Target) -> f64) -> Option<usize> {
        let total: f64 = self.targets.iter().map(&weight).sum();
        let mut x = x * total;
        let mut last = None;
        for (i, target) in self.targets.iter().enumerate() {
            let w = weight(target);
            if w > 0.0 {
                last = Some(i);
                if x < w {
                    break;
                }
            }
            x -= w;
        }
        last
    }

    /// `None` where all emission is aimed and no target can be.
    fn choose(&self, from: Vec3, outlook: &Outlook, u: f32) -> Option<Choice> {
        let share = self.share();
        if f64::from(u) >= share {
            return Some(Choice::Free);
        }
        let weight = |t: &Target| t.view(from, outlook).map_or(0.0, |v| v.weight);
        match self.weighted(f64::from(u) / share, weight) {
            None if share < 1.0 => Some(Choice::Free),
            None => None,
            Some(i) => match self.targets[i].view(from, outlook)?.cone {
                None => Some(Choice::Free),
                Some(cone) => Some(Choice::Target(i, cone)),
            },
        }
    }

    /// A direction from `from` with its density per steradian. `u_aim` decides whether and where it is
    /// aimed; what is not aimed comes from `free`, whose density is `pdf`.
    pub(super) fn direct(
        &self,
        from: Vec3,
        outlook: &Outlook,
        u_aim: f32,
        u: Vec2,
        free: impl Fn(Vec2) -> Option<Vec3>,
        pdf: impl Fn(Vec3) -> f64,
    ) -> Option<(Vec3, f64)> {
        if self.share() == 0.0 {
            let w = free(u)?;
            return Some((w, pdf(w)));
        }
        let (w, chosen) = match self.choose(from, outlook, u_aim)? {
            Choice::Free => (free(u)?, None),
            Choice::Target(i, cone) => (cone.sample(u), Some(i)),
        };
        Some((w, self.mixed(from, outlook, w, pdf(w), chosen)))
    }

    /// Density per steradian of [`Aim::direct`], for one of `free` emission that is not aimed.
    pub(super) fn pdf(&self, from: Vec3, outlook: &Outlook, w: Vec3, free: f64) -> f64 {
        match self.share() == 0.0 {
            true => free,
            false => self.mixed(from, outlook, w, free, None),
        }
    }

    /// The direction lies in the cone of the target `chosen`, whatever rounding did to it.
    fn mixed(
        &self,
        from: Vec3,
        outlook: &Outlook,
        w: Vec3,
        free: f64,
        chosen: Option<usize>,
    ) -> f64 {
        let (mut total, mut aimed) = (0.0, 0.0);
        for (i, target) in self.targets.iter().enumerate() {
            let Some(view) = target.view(from, outlook) else {
                continue;
            };
            total += view.weight;
            aimed += match view.cone {
                None => view.weight * free,
                Some(cone) if chosen == Some(i) || cone.holds(w.as_dvec3()) => {
                    view.weight / cone.solid_angle()
                }
                Some(_) => 0.0,
            };
        }
        let share = self.share();
        match total > 0.0 {
            true => (1.0 - share) * free + share * aimed / total,
            false if share < 1.0 => free,
            false => 0.0,
        }
    }
}
