//! What a small surface receives: by light that leaves the emitters and happens to arrive, and by connections
//! from there to the emitters.

use crate::common::{Rng, Running, chi2_p_value};
use crate::stages::{Stage, all, numbers};
use luxel::geom::Ray;
use luxel::light::{Aim, Target};
use luxel::math::{Frame, Vec2, Vec3};

/// A square that counts light from both sides.
struct Receiver {
    center: Vec3,
    frame: Frame,
    half: f32,
}

impl Receiver {
    fn new(center: [f32; 3], n: [f32; 3], half: f32) -> Receiver {
        Receiver {
            center: Vec3::from(center),
            frame: Frame::from_normal(Vec3::from(n).normalize()),
            half,
        }
    }

    /// Whether `ray` arrives, past what else is there.
    fn meets(&self, stage: &Stage, ray: &Ray) -> bool {
        let n = self.frame.n;
        let t = (self.center - ray.o).dot(n) / ray.d.dot(n);
        let l = self.frame.to_local(ray.at(t) - self.center).abs();
        let clear = || !stage.world.occluded(&Ray { t_max: t, ..*ray });
        t > 0.0 && l.x <= self.half && l.y <= self.half && clear()
    }

    fn at(&self, u: Vec2) -> Vec3 {
        let q = (2.0 * u - 1.0) * self.half;
        self.center + self.frame.s * q.x + self.frame.t * q.y
    }

    fn area(&self) -> f64 {
        4.0 * f64::from(self.half * self.half)
    }

    fn by_emission(&self, stage: &Stage, aim: &Aim) -> Running {
        let mut rng = Rng::new(31);
        until_known(|| {
            let e = stage.emit(aim, &numbers(&mut rng));
            let arrived = e.filter(|e| self.meets(stage, &e.ray));
            arrived.map_or(0.0, |e| f64::from(e.power.g))
        })
    }

    fn by_connection(&self, stage: &Stage) -> Running {
        let mut rng = Rng::new(32);
        until_known(|| {
            let p = self.at(rng.vec2());
            let mut from = crate::shapes::receiver(p, self.frame.n);
            from.time = rng.f32();
            let (pick, u) = (rng.f32(), rng.vec2());
            let s = stage.lights.sample(stage.geoms(), &from, pick, u);
            let seen = s.filter(|s| !stage.world.occluded(&s.shadow_ray(&from)));
            let lit = seen.map_or(0.0, |s| s.weight().g * s.wi.dot(self.frame.n).abs());
            f64::from(lit) * self.area()
        })
    }
}

/// Samples until the mean is known to 0.3 % or there are a few hundred thousand.
fn until_known(mut sample: impl FnMut() -> f64) -> Running {
    let mut sum = Running::default();
    for _ in 0..8 {
        (0..16_384).for_each(|_| sum.add(sample()));
        if sum.stderr() <= 3e-3 * sum.mean {
            break;
        }
    }
    sum
}

#[test]
fn emission_brings_what_connections_find() {
    let receivers = [
        Receiver::new([0.6, 0.3, 0.2], [0.3, 0.2, 0.9], 0.15),
        Receiver::new([-0.4, -0.6, -0.3], [-0.5, 0.7, 0.5], 0.15),
        Receiver::new([0.3, 0.5, 4.0], [0.4, 0.1, 0.9], 0.4),
    ];
    let (mut compared, mut chi2) = (0, 0.0);
    for stage in all() {
        // A needle's light is smaller than the square; connections do not find it.
        if stage.name == "needle" {
            continue;
        }
        for (i, receiver) in receivers.iter().enumerate() {
            let far = stage.lights.emitters().iter().any(|e| {
                use luxel::light::Emitter::{Constant, Directional, Image};
                matches!(e, Constant { .. } | Directional { .. } | Image(_))
            });
            // Light from infinity is sent through the scene only.
            if far && i == 2 {
                continue;
            }
            let aim = Aim {
                share: 0.9,
                targets: vec![Target {
                    center: receiver.center,
                    radius: receiver.half * 1.5,
                }],
            };
            let emitted = receiver.by_emission(&stage, &aim);
            let found = receiver.by_connection(&stage);
            let name = stage.name;
            if found.mean == 0.0 {
                assert_eq!(emitted.mean, 0.0, "{name}, receiver {i}");
                continue;
            }
            let error = emitted.stderr().hypot(found.stderr());
            let gap = (emitted.mean - found.mean).abs();
            assert!(
                gap < 4.5 * error + 1e-5 * found.mean,
                "{name}, receiver {i}: {} and {}, {:.2} sigma, {:.2} %",
                emitted.mean,
                found.mean,
                gap / error,
                100.0 * error / found.mean,
            );
            // Some are known to rounding, and some, of next to no light, hardly at all.
            if error > 1e-5 * found.mean && error < 0.05 * found.mean {
                chi2 += (gap / error).powi(2);
                compared += 1;
            }
        }
    }
    // Many small differences would be a large one here.
    let p = chi2_p_value(chi2, f64::from(compared));
    assert!(compared > 60 && p > 1e-3, "{chi2} of {compared}: {p}");
}
