//! Affine maps that change over the shutter: keyframes, and how one becomes the next.
//!
//! Between two keys the map is taken apart by polar decomposition into translation, rotation and stretch
//! (Shoemake & Duff 1992, "Matrix animation and polar decomposition"). The translation and the stretch
//! move linearly, the rotation at constant speed the shorter way round. A mirror is part of the stretch,
//! which is then negative definite; as it never turns from one into the other, no interpolated map is
//! singular. Before the first and after the last key nothing moves.

use glam::{DAffine3, DMat3, DQuat};

use super::{Aabb, DVec3, Transform};

/// An affine map as a function of time, where 0 is the opening and 1 the closing of the shutter.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion(Kind);

#[derive(Clone, Debug, PartialEq)]
enum Kind {
    Still(Transform),
    Moving(Box<Moving>),
}

#[derive(Clone, Debug, PartialEq)]
struct Moving {
    /// The map is `left * segment * right`.
    left: Transform,
    right: Transform,
    /// Both of them are the identity.
    bare: bool,
    /// By time, each beginning where the one before ends.
    segments: Vec<Segment>,
}

/// The way from one key to the next.
#[derive(Clone, Debug, PartialEq)]
struct Segment {
    /// Times of the two keys, over the shutter.
    from: f64,
    to: f64,
    translation: [DVec3; 2],
    linear: Linear,
}

#[derive(Clone, Debug, PartialEq)]
enum Linear {
    /// Both keys differ in their translation only.
    Constant { matrix: DMat3, inverse: DMat3 },
    Turning {
        /// At the first key.
        rotation: DMat3,
        /// Of the rotation from the first key to the second, in the space before `rotation`.
        axis: DVec3,
        /// 0 to pi.
        angle: f64,
        stretch: [DMat3; 2],
    },
}

/// Largest rotation within a piece of a path whose bounds are found from its ends and its sagitta.
const PIECE: f64 = std::f64::consts::PI / 24.0;

/// Share of the sum of all that was added up that rounding in f64 may have moved a point.
const ROUNDING: f64 = 1e-13;

impl Motion {
    pub fn still(transform: Transform) -> Motion {
        Motion(Kind::Still(transform))
    }

    /// Keyframes at increasing scene times, seen through the shutter that is open over
    /// `[open, close]` of the same time. What does not change during that time folds to a still map, and
    /// keys that are not needed are dropped.
    ///
    /// `None` without keys, with times that are not finite and increasing, with a shutter that closes
    /// before it opens, or when one key is mirrored and another is not: a map between them is singular.
    pub fn new(keys: &[(f64, Transform)], shutter: [f64; 2]) -> Option<Motion> {
        let [open, close] = shutter;
        let valid = keys.iter().all(|k| k.0.is_finite())
            && keys.windows(2).all(|w| w[0].0 < w[1].0)
            && open.is_finite()
            && close.is_finite()
            && open <= close;
        let first = keys.first().filter(|_| valid)?;
        let mirrored = first.1.swaps_handedness();
        if keys.iter().any(|k| k.1.swaps_handedness() != mirrored) {
            return None;
        }
        // The keys that matter: from the last one at or before the opening to the first one at or after
        // the closing.
        let start = keys.iter().rposition(|k| k.0 <= open).unwrap_or(0);
        let end = keys.iter().position(|k| k.0 >= close);
        let used = &keys[start..=end.unwrap_or(keys.len() - 1).max(start)];
        if used.iter().all(|k| k.1 == used[0].1) {
            return Some(Motion::still(used[0].1));
        }
        let duration = close - open;
        let segments = used
            .windows(2)
            .map(|w| match duration > 0.0 {
                true => Segment::new(w, |t| (t - open) / duration),
                // Time 0 is the opening whatever the unit.
                false => Segment::new(w, |t| t - open),
            })
            .collect::<Option<Vec<_>>>()?;
        let moving = Motion(Kind::Moving(Box::new(Moving {
            left: Transform::IDENTITY,
            right: Transform::IDENTITY,
            bare: true,
            segments,
        })));
        Some(match duration > 0.0 {
            true => moving,
            false => Motion::still(match used.iter().find(|k| k.0 == open) {
                Some(key) => key.1,
                None => moving.at(0.0),
            }),
        })
    }

    /// The map, when it is the same at all times.
    pub fn as_still(&self) -> Option<&Transform> {
        match &self.0 {
            Kind::Still(transform) => Some(transform),
            Kind::Moving(_) => None,
        }
    }

    /// Whether all directions stay as they are over time: nothing turns and nothing is stretched.
    pub fn only_translates(&self) -> bool {
        match &self.0 {
            Kind::Still(_) => true,
            Kind::Moving(m) => {
                let constant = |s: &Segment| matches!(s.linear, Linear::Constant { .. });
                m.segments.iter().all(constant)
            }
        }
    }

    /// The map at a time in [0,1].
    #[inline]
    pub fn at(&self, time: f32) -> Transform {
        match &self.0 {
            Kind::Still(transform) => *transform,
            Kind::Moving(m) => m.at(f64::from(time)),
        }
    }

    /// `transform * self`: `transform` acts on what this map gives.
    pub fn prepend(&self, transform: &Transform) -> Motion {
        self.between(transform, &Transform::IDENTITY)
    }

    /// `self * transform`: this map acts on what `transform` gives.
    pub fn append(&self, transform: &Transform) -> Motion {
        self.between(&Transform::IDENTITY, transform)
    }

    fn between(&self, left: &Transform, right: &Transform) -> Motion {
        let around = |t: &Transform| *left * *t * *right;
        Motion(match &self.0 {
            Kind::Still(t) => Kind::Still(around(t)),
            Kind::Moving(m) => Kind::Moving(Box::new(match m.pushed_by(&around) {
                Some(segments) => Moving {
                    segments,
                    ..(**m).clone()
                },
                None => Moving {
                    left: *left * m.left,
                    right: m.right * *right,
                    bare: false,
                    segments: m.segments.clone(),
                },
            })),
        })
    }

    /// A box that holds the image of `local` at every time in `[t0, t1]`, a part of [0,1]. What
    /// turning adds to it is bounded by pieces of 7.5 degrees, to a few per mille of the path.
    pub fn bounds(&self, local: Aabb, t0: f32, t1: f32) -> Aabb {
        if local.is_empty() {
            return Aabb::EMPTY;
        }
        // The image of a box is the hull of the images of its corners.
        let (lo, hi) = (local.min.as_dvec3(), local.max.as_dvec3());
        let corners: [DVec3; 8] = std::array::from_fn(|i| {
            let pick = |bit: usize, lo, hi| if i >> bit & 1 == 0 { lo } else { hi };
            DVec3::new(
                pick(0, lo.x, hi.x),
                pick(1, lo.y, hi.y),
                pick(2, lo.z, hi.z),
            )
        });
        let mut bounds = Bounds::default();
        match &self.0 {
            Kind::Still(t) => bounds.add(t, DVec3::ZERO, &corners),
            Kind::Moving(m) => m.bounds(&corners, f64::from(t0), f64::from(t1), &mut bounds),
        }
        bounds.outward()
    }
}

impl Moving {
    /// The segment in which `time` lies, the first or last one when it lies in none.
    #[inline]
    fn segment(&self, time: f64) -> &Segment {
        let i = self.segments.partition_point(|s| s.to < time);
        &self.segments[i.min(self.segments.len() - 1)]
    }

    #[inline]
    fn at(&self, time: f64) -> Transform {
        let segment = self.segment(time);
        let inner = segment.at(segment.share(time));
        match self.bare {
            true => inner,
            false => self.left * inner * self.right,
        }
    }

    /// The same motion between other maps, when it is a translation and can take them into its keys.
    fn pushed_by(&self, around: &impl Fn(&Transform) -> Transform) -> Option<Vec<Segment>> {
        let constant = |s: &Segment| matches!(s.linear, Linear::Constant { .. });
        if !(self.bare && self.segments.iter().all(constant)) {
            return None;
        }
        let pushed = |s: &Segment| {
            let [a, b] = [0.0, 1.0].map(|share| around(&s.at(share)));
            Segment {
                translation: [a, b].map(|t| t.matrix().translation),
                linear: Linear::Constant {
                    matrix: a.matrix().matrix3,
                    inverse: a.inverse().matrix().matrix3,
                },
                ..*s
            }
        };
        Some(self.segments.iter().map(pushed).collect())
    }

    fn bounds(&self, corners: &[DVec3; 8], t0: f64, t1: f64, bounds: &mut Bounds) {
        for t in [t0, t1] {
            bounds.add(&self.at(t), DVec3::ZERO, corners);
        }
        for segment in &self.segments {
            let (a, b) = (segment.from.max(t0), segment.to.min(t1));
            if a > b {
                continue;
            }
            let (a, b) = (segment.share(a), segment.share(b));
            let pieces = segment.pieces(a, b);
            let sagitta = segment.sagitta(&self.right, corners, (b - a) / pieces as f64);
            let reach = row_lengths(&self.left.matrix().matrix3);
            let sagitta = reach * sagitta;
            // What may cancel in the composed map.
            for p in segment.translation {
                bounds.size = bounds.size.max(reach * p.length());
            }
            for i in 0..=pieces {
                let share = a + (b - a) * (i as f64 / pieces as f64);
                let map = self.left * segment.at(share) * self.right;
                bounds.add(&map, sagitta, corners);
            }
        }
    }
}

/// Length of the rows: how far a unit vector may be taken along each axis.
fn row_lengths(m: &DMat3) -> DVec3 {
    DVec3::new(m.row(0).length(), m.row(1).length(), m.row(2).length())
}

impl Segment {
    /// Between two keys whose times become those of the shutter by `time`. `None` when a key is so
    /// close to singular that its stretch cannot be undone.
    fn new(keys: &[(f64, Transform)], time: impl Fn(f64) -> f64) -> Option<Segment> {
        let [a, b] = [keys[0].1, keys[1].1];
        let [m0, m1] = [a, b].map(|t| t.matrix().matrix3);
        let linear = if m0 == m1 {
            Linear::Constant {
                matrix: m0,
                inverse: a.inverse().matrix().matrix3,
            }
        } else {
            let ([q0, q1], [s0, s1]) = {
                let ((q0, s0), (q1, s1)) = (polar(m0)?, polar(m1)?);
                ([q0, q1], [s0, s1])
            };
            let (axis, angle) = axis_angle(q0.transpose() * q1);
            Linear::Turning {
                rotation: q0,
                axis,
                angle,
                stretch: [s0, s1],
            }
        };
        Some(Segment {
            from: time(keys[0].0),
            to: time(keys[1].0),
            translation: [a, b].map(|t| t.matrix().translation),
            linear,
        })
    }

    /// How much of the way is done at a time, 0 to 1.
    #[inline]
    fn share(&self, time: f64) -> f64 {
        ((time - self.from) / (self.to - self.from)).clamp(0.0, 1.0)
    }

    #[inline]
    fn at(&self, share: f64) -> Transform {
        let translation = self.translation[0].lerp(self.translation[1], share);
        let (matrix, inverse) = match &self.linear {
            Linear::Constant { matrix, inverse } => (*matrix, *inverse),
            Linear::Turning {
                rotation,
                axis,
                angle,
                stretch: [s0, s1],
            } => {
                let rotation = *rotation * DMat3::from_axis_angle(*axis, angle * share);
                let stretch = *s0 * (1.0 - share) + *s1 * share;
                (rotation * stretch, stretch.inverse() * rotation.transpose())
            }
        };
        Transform::with_inverse(
            DAffine3::from_mat3_translation(matrix, translation),
            DAffine3::from_mat3_translation(inverse, inverse * -translation),
        )
    }

    /// Number of pieces that the part `[a, b]` of the way is bounded in.
    fn pieces(&self, a: f64, b: f64) -> usize {
        match self.linear {
            Linear::Constant { .. } => 1,
            // At most pi / PIECE.
            Linear::Turning { angle, .. } => ((b - a) * angle / PIECE).ceil().max(1.0) as usize,
        }
    }

    /// How far the path of a point strays from the straight line between two times that are a share
    /// `step` of the way apart, before `left`.
    ///
    /// A point `w(s) = S(s) x` is turned into `R(s) w(s)`; the path's second derivative is at most
    /// `angle^2 |w's part across the axis| + 2 angle |w'|`, as `w` is linear, and a path strays by at
    /// most an eighth of the step's square times that.
    fn sagitta(&self, right: &Transform, corners: &[DVec3; 8], step: f64) -> f64 {
        let Linear::Turning {
            axis,
            angle,
            stretch: [s0, s1],
            ..
        } = &self.linear
        else {
            return 0.0;
        };
        let curvature = |x: &DVec3| {
            let x = right.point(*x);
            let (w0, w1) = (*s0 * x, *s1 * x);
            let across = |w: DVec3| axis.cross(w).length();
            angle * angle * across(w0).max(across(w1)) + 2.0 * angle * (w1 - w0).length()
        };
        let largest = corners.iter().map(curvature).fold(0.0, f64::max);
        largest * step * step / 8.0
    }
}

/// `m = rotation * stretch`, the stretch symmetric and definite: negative where `m` is mirrored.
///
/// Newton's iteration towards the nearest orthogonal matrix, scaled so that a dozen steps suffice
/// (Higham 1986, "Computing the polar decomposition", section 3).
fn polar(m: DMat3) -> Option<(DMat3, DMat3)> {
    let frobenius = |m: &DMat3| {
        (m.x_axis.length_squared() + m.y_axis.length_squared() + m.z_axis.length_squared()).sqrt()
    };
    let mut q = m;
    for _ in 0..100 {
        let inverse = q.inverse().transpose();
        let gamma = (frobenius(&inverse) / frobenius(&q)).sqrt();
        let next = (q * gamma + inverse * (1.0 / gamma)) * 0.5;
        let change = frobenius(&(next - q));
        q = next;
        if change <= 1e-15 {
            break;
        }
    }
    if q.determinant() < 0.0 {
        q *= -1.0;
    }
    let s = q.transpose() * m;
    let s = (s + s.transpose()) * 0.5;
    (q.is_finite() && s.inverse().is_finite()).then_some((q, s))
}

/// Axis and angle, 0 to pi, of a rotation; any axis for none.
fn axis_angle(rotation: DMat3) -> (DVec3, f64) {
    let q = DQuat::from_mat3(&rotation).normalize();
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    let v = sign * DVec3::new(q.x, q.y, q.z);
    match v.try_normalize() {
        Some(axis) => (axis, 2.0 * v.length().atan2(q.w.abs())),
        None => (DVec3::Z, 0.0),
    }
}

/// A box in f64 that knows how large the numbers were that it is made of.
struct Bounds {
    min: DVec3,
    max: DVec3,
    size: DVec3,
}

impl Default for Bounds {
    fn default() -> Bounds {
        Bounds {
            min: DVec3::INFINITY,
            max: DVec3::NEG_INFINITY,
            size: DVec3::ZERO,
        }
    }
}

impl Bounds {
    /// Takes in the images of the corners and `margin` around each.
    fn add(&mut self, map: &Transform, margin: DVec3, corners: &[DVec3; 8]) {
        let m = map.matrix();
        let absolute = |v: DVec3| {
            let m = m.matrix3;
            m.x_axis.abs() * v.x.abs() + m.y_axis.abs() * v.y.abs() + m.z_axis.abs() * v.z.abs()
        };
        for x in corners {
            let p = map.point(*x);
            self.min = self.min.min(p - margin);
            self.max = self.max.max(p + margin);
            let size = absolute(*x) + m.translation.abs() + margin;
            self.size = self.size.max(size);
        }
    }

    /// The box in f32 that holds this one and its rounding.
    fn outward(self) -> Aabb {
        let slack = self.size * ROUNDING;
        let (lo, hi) = ((self.min - slack).as_vec3(), (self.max + slack).as_vec3());
        let each = |v: super::Vec3, f: fn(f32) -> f32| super::Vec3::from_array(v.to_array().map(f));
        Aabb {
            min: each(lo, f32::next_down),
            max: each(hi, f32::next_up),
        }
    }
}
