//! Spheres around what can throw a caustic: where emission is aimed at.

use super::{Aim, Target};
use crate::geom::{Geometry, ShapeId, World};
use crate::math::{Aabb, DVec3, fp};

/// Most spheres of an aim: every density of an emission looks at all of them.
const MOST_TARGETS: usize = 8;

/// Groups of neighbours that are joined to begin with, so that joining the best pair stays cheap.
const MOST_GROUPS: usize = 48;

/// Share of the emission that is aimed at targets that cover next to nothing: half, so that the light that
/// is not aimed loses no more than a factor of two in samples.
const LARGEST_SHARE: f64 = 0.5;

/// Share of the scene's mean shadow that the targets' disks cover from which on aiming is not worth it.
const COVERED: f64 = 0.5;

/// A sphere in f64, while it grows.
#[derive(Clone, Copy, Debug)]
struct Ball {
    center: DVec3,
    radius: f64,
}

impl Aim {
    /// A handful of spheres around `shapes`, wherever they stand while the shutter is open, and a share that
    /// falls from a half to nothing as the spheres cover up to half of the scene. To aim more or less, change
    /// the share; without shapes there is nothing to aim at.
    pub fn around(world: &World, shapes: &[ShapeId]) -> Aim {
        let mut balls = Vec::new();
        for &shape in shapes {
            add_balls(world, shape, &mut balls);
        }
        let balls = join(group(balls));
        let area: f64 = balls.iter().map(|b| b.radius * b.radius).sum();
        let half = 0.5 * world.bounds().diagonal().as_dvec3().max(DVec3::ZERO);
        // A quarter of the surface (Cauchy).
        let shadow = 2.0 * (half.x * half.y + half.y * half.z + half.z * half.x);
        let covered = std::f64::consts::PI * area / shadow;
        let share = match covered > 0.0 && covered < COVERED {
            true => LARGEST_SHARE * (1.0 - covered / COVERED),
            // Also where either is no number.
            false => 0.0,
        };
        Aim {
            share: share as f32,
            targets: balls.iter().map(Ball::target).collect(),
        }
    }
}

/// Adds a sphere for each place where `shape` stands.
fn add_balls(world: &World, shape: ShapeId, balls: &mut Vec<Ball>) {
    let Some(g) = world.geometries().get(shape.0 as usize) else {
        return;
    };
    match world.placement_of(shape) {
        None => balls.extend(Ball::of(g)),
        Some(first) => {
            let places = world.places().iter().filter(|p| p.group == first.group);
            let bounds = g.bounds();
            balls.extend(places.filter_map(|p| match bounds.is_empty() {
                true => None,
                false => Ball::of_box(&p.motion.bounds(bounds, 0.0, 1.0)),
            }));
        }
    }
}

impl Ball {
    fn of(g: &Geometry) -> Option<Ball> {
        match g {
            Geometry::Sphere(s) => Some(Ball {
                center: s.center(),
                radius: s.radius(),
            }),
            Geometry::Mesh(m) => {
                let ball = Ball::of_box(&g.bounds())?;
                let reach = |p: DVec3| p.distance_squared(ball.center);
                let corners = m.indices().iter().flatten();
                let positions = corners.map(|&i| m.positions()[i as usize].as_dvec3());
                let radius2 = positions.map(reach).fold(0.0, f64::max);
                Some(Ball {
                    radius: radius2.sqrt(),
                    ..ball
                })
            }
            _ => Ball::of_box(&g.bounds()),
        }
    }

    fn of_box(bounds: &Aabb) -> Option<Ball> {
        let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        (!bounds.is_empty()).then(|| Ball {
            center: 0.5 * (min + max),
            radius: 0.5 * min.distance(max),
        })
    }

    /// The smallest sphere around both.
    fn with(&self, other: &Ball) -> Ball {
        let d = other.center - self.center;
        let distance = d.length();
        if distance + other.radius <= self.radius {
            return *self;
        }
        if distance + self.radius <= other.radius {
            return *other;
        }
        let radius = 0.5 * (distance + self.radius + other.radius);
        Ball {
            center: self.center + d * ((radius - self.radius) / distance),
            radius,
        }
    }

    /// How much more joining the two would cover than they do apart, in units of π.
    fn growth(&self, other: &Ball) -> f64 {
        let joined = self.with(other).radius;
        joined * joined - self.radius * self.radius - other.radius * other.radius
    }

    /// Rounded so that it still holds what it held.
    fn target(&self) -> Target {
        let reach = self.center.length() + self.radius;
        let radius = self.radius + reach * f64::from(fp::gamma(4));
        Target {
            center: self.center.as_vec3(),
            radius: radius as f32,
        }
    }
}

/// Halves the set at the middle of its longest side until there are few enough groups, and joins each group.
fn group(balls: Vec<Ball>) -> Vec<Ball> {
    let mut groups = vec![balls];
    while groups.len() < MOST_GROUPS {
        let largest = (0..groups.len()).max_by_key(|&i| groups[i].len());
        let Some(i) = largest.filter(|&i| groups[i].len() > 1) else {
            break;
        };
        let mut balls = groups.swap_remove(i);
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for b in &balls {
            (min, max) = (min.min(b.center), max.max(b.center));
        }
        let axis = (max - min).max_position();
        balls.sort_by(|a, b| a.center[axis].total_cmp(&b.center[axis]));
        let upper = balls.split_off(balls.len() / 2);
        groups.push(balls);
        groups.push(upper);
    }
    let joined = groups.iter().map(|balls| {
        let mut balls = balls.iter();
        let first = *balls.next()?;
        Some(balls.fold(first, |all, ball| all.with(ball)))
    });
    joined.flatten().collect()
}

/// Joins the pair that grows least until there are few enough, and as long as that covers less.
fn join(mut balls: Vec<Ball>) -> Vec<Ball> {
    loop {
        let mut best: Option<(f64, usize, usize)> = None;
        for i in 0..balls.len() {
            for j in i + 1..balls.len() {
                let growth = balls[i].growth(&balls[j]);
                if best.is_none_or(|(least, ..)| growth < least) {
                    best = Some((growth, i, j));
                }
            }
        }
        match best {
            Some((growth, i, j)) if growth <= 0.0 || balls.len() > MOST_TARGETS => {
                let other = balls.swap_remove(j);
                balls[i] = balls[i].with(&other);
            }
            _ => return balls,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{GroupId, Mesh, Placement, Sphere};
    use crate::math::{Motion, Transform};

    fn at(p: [f64; 3], size: f64) -> Transform {
        Transform::translate(DVec3::from(p)) * Transform::scale(DVec3::splat(size)).unwrap()
    }

    fn floor(size: f64) -> Geometry {
        Geometry::Mesh(Mesh::cube(&at([0.0; 3], size), false))
    }

    fn ball(p: [f64; 3], size: f64) -> Geometry {
        Geometry::Sphere(Sphere::new(at(p, size), false).unwrap())
    }

    #[test]
    fn one_ball_is_its_own_target() {
        let world = World::new(vec![floor(20.0), ball([1.0, 2.0, 3.0], 0.5)]);
        let aim = Aim::around(&world, &[ShapeId(1)]);
        assert_eq!(aim.targets.len(), 1);
        assert!((aim.targets[0].radius - 0.5).abs() < 1e-5);
        assert!(aim.share > 0.49 && aim.share < 0.5, "{}", aim.share);
    }

    #[test]
    fn what_is_everywhere_is_not_aimed_at() {
        let world = World::new(vec![floor(20.0), ball([1.0, 2.0, 3.0], 0.5)]);
        assert_eq!(Aim::around(&world, &[ShapeId(0)]).share, 0.0);
        assert!(Aim::around(&world, &[]).targets.is_empty());
        assert_eq!(Aim::around(&world, &[]).share, 0.0);
        assert!(Aim::around(&world, &[ShapeId(7)]).targets.is_empty());
        let empty = Aim::around(&World::new(vec![]), &[]);
        assert_eq!((empty.share, empty.targets.len()), (0.0, 0));
    }

    #[test]
    fn many_balls_are_few_targets_that_hold_them_all() {
        let spot = |i: usize| {
            let x = ((i * 7919) % 1000) as f64 / 50.0 - 10.0;
            let y = ((i * 104_729) % 1000) as f64 / 50.0 - 10.0;
            [x, y, (i % 3) as f64]
        };
        let mut shapes = vec![floor(40.0)];
        shapes.extend((0..500).map(|i| ball(spot(i), 0.05)));
        let world = World::new(shapes);
        let ids: Vec<ShapeId> = (1..=500).map(ShapeId).collect();
        let aim = Aim::around(&world, &ids);
        assert!((1..=MOST_TARGETS).contains(&aim.targets.len()));
        for i in 0..500 {
            let c = DVec3::from(spot(i));
            let holds = |t: &Target| {
                t.center.as_dvec3().distance(c) + 0.05 <= f64::from(t.radius) * (1.0 + 1e-6)
            };
            assert!(aim.targets.iter().any(holds), "ball {i}");
        }
    }

    #[test]
    fn two_far_apart_stay_two_and_what_moves_is_covered_on_its_way() {
        let motion = Motion::new(
            &[(0.0, at([0.0; 3], 1.0)), (1.0, at([3.0, 0.0, 0.0], 1.0))],
            [0.0, 1.0],
        )
        .unwrap();
        let (group, shapes) = (
            GroupId(0),
            vec![ball([0.0; 3], 0.5), ball([30.0, 9.0, 0.0], 0.5)],
        );
        let world = World::with_places(
            shapes,
            &[vec![ShapeId(0)]],
            vec![Placement { group, motion }],
        );
        let aim = Aim::around(&world, &[ShapeId(0), ShapeId(1)]);
        assert_eq!(aim.targets.len(), 2);
        let way = aim.targets.iter().find(|t| t.center.x < 10.0).unwrap();
        for x in [-0.49, 3.49] {
            assert!(
                way.center.as_dvec3().distance(DVec3::new(x, 0.0, 0.0)) < f64::from(way.radius)
            );
        }
    }
}
