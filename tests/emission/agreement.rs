//! The same light, found from both ends: densities and powers.

use crate::common::{Rng, mean_and_error};
use crate::stages::{Stage, aims, all, numbers};
use luxel::bsdf::Density;
use luxel::geom::Hit;
use luxel::light::{Aim, Emission, EmissionPdf, Source};
use luxel::math::Vec2;

/// Relative difference.
fn gap(a: f32, b: f32) -> f32 {
    match a == b {
        true => 0.0,
        false => (a / b - 1.0).abs(),
    }
}

/// The largest relative difference of two statements.
fn apart(a: &EmissionPdf, b: &EmissionPdf) -> f32 {
    assert_eq!(
        (a.diverges, a.can_be_met),
        (b.diverges, b.can_be_met),
        "{a:?} {b:?}"
    );
    gap(a.start, b.start)
        .max(gap(a.onward, b.onward))
        .max(gap(a.cos, b.cos))
}

/// A receiver that the emission reaches, turned to it.
fn reached(e: &Emission) -> Hit {
    let mut from = crate::shapes::receiver(e.ray.at(1.7), -e.ray.d);
    from.time = e.ray.time;
    from
}

/// Counts agreements, of which some are lost where a density changes quickly or steps.
struct Tally {
    seen: u32,
    off: u32,
}

impl Tally {
    fn add(&mut self, apart: f32, within: f32) {
        self.seen += 1;
        self.off += u32::from(apart.is_nan() || apart > within);
    }

    fn check(&self, name: &str, least: u32) {
        let Tally { seen, off } = self;
        assert!(*seen >= least, "{name}: only {seen} emissions");
        assert!(off * 200 <= *seen, "{name}: {off} of {seen} disagree");
    }
}

fn each(mut check: impl FnMut(&str, &Stage, &Aim)) {
    for stage in all() {
        for (aimed, aim) in aims() {
            check(&format!("{}, {aimed}", stage.name), &stage, &aim);
        }
    }
}

#[test]
fn what_meets_the_start_knows_the_density_of_the_emission() {
    each(|name, stage, aim| {
        let mut rng = Rng::new(3);
        let mut tally = Tally { seen: 0, off: 0 };
        let mut emitted = 0;
        for _ in 0..2000 {
            let Some(e) = stage.emit(aim, &numbers(&mut rng)) else {
                continue;
            };
            emitted += 1;
            assert!(e.pdf.start > 0.0 && e.pdf.onward > 0.0, "{name}: {e:?}");
            assert!((e.ray.d.length() - 1.0).abs() < 1e-6, "{name}");
            let again = match &e.source {
                Source::Surface(hit) => {
                    assert_eq!(hit.wo, e.ray.d, "{name}");
                    assert!(!stage.lights.le(hit).is_black(), "{name}");
                    // Met by a ray from before the surface, and described like it was when chosen.
                    let d = 1e-2;
                    let back = luxel::geom::Ray {
                        time: e.ray.time,
                        ..luxel::geom::Ray::new(hit.p + hit.wo * d, -hit.wo)
                    };
                    let Some(met) = stage.meet(&back) else {
                        continue;
                    };
                    if met.p.distance(hit.p) > 1e-4 || met.ng.dot(met.wo).abs() < 0.05 {
                        continue;
                    }
                    assert_eq!((met.shape, met.place), (hit.shape, hit.place), "{name}");
                    assert!(met.frame.n.distance(hit.frame.n) < 1e-3, "{name}");
                    let exact = stage.lights.pdf_emission(stage.geoms(), aim, hit);
                    tally.add(apart(&exact.unwrap(), &e.pdf), 1e-4);
                    stage.lights.pdf_emission(stage.geoms(), aim, &met)
                }
                Source::Far { wi, .. } if e.pdf.can_be_met => {
                    assert_eq!(*wi, -e.ray.d);
                    stage.lights.pdf_emission_escaped(aim, &reached(&e), *wi)
                }
                _ => continue,
            };
            let again = again.unwrap_or_else(|| panic!("{name}: no density at {e:?}"));
            tally.add(apart(&again, &e.pdf), 2e-3);
        }
        if emitted > 100 {
            tally.check(name, 0);
        }
        assert!(emitted > 300 || aim.share > 0.0, "{name}: {emitted}");
    });
}

#[test]
fn connections_know_the_density_of_the_emission_from_their_end() {
    each(|name, stage, aim| {
        let mut rng = Rng::new(4);
        let (mut tally, mut back) = (Tally { seen: 0, off: 0 }, Tally { seen: 0, off: 0 });
        for _ in 0..1500 {
            // A receiver in the light.
            let Some(e) = stage.emit(aim, &numbers(&mut rng)) else {
                continue;
            };
            let from = reached(&e);
            let (pick, u) = (rng.f32(), rng.vec2());
            let geoms = stage.geoms();
            let alone = stage.lights.sample(geoms, &from, pick, u);
            let both = stage.lights.sample_both_ways(geoms, aim, &from, pick, u);
            assert_eq!(alone.is_some(), both.is_some(), "{name}");
            let (Some(alone), Some((sample, pdf, prob))) = (alone, both) else {
                continue;
            };
            assert!(prob > 0.0 && prob <= 1.0 && pdf.start > 0.0, "{name}");
            assert_eq!(
                (sample.wi, sample.density, sample.le),
                (alone.wi, alone.density, alone.le),
                "{name}"
            );
            if !pdf.can_be_met {
                continue;
            }
            let again = match sample.end {
                Some(end) => {
                    let ray = from.spawn(sample.wi);
                    let met = stage.meet(&ray).filter(|m| m.p.distance(end.p) < 1e-4);
                    let Some(met) = met.filter(|m| m.wo.dot(m.ng).abs() > 0.05) else {
                        continue;
                    };
                    // And the density of the connection in the measure of the start.
                    let source = Source::Surface(met);
                    let connection = stage.lights.pdf_connection(geoms, &from, &source);
                    let Density::PerSr(per_sr) = sample.density else {
                        panic!("{name}: a delta connection to a surface");
                    };
                    let dist2 = f64::from((met.p - from.p).length_squared());
                    let expected = f64::from(per_sr) * pdf.start_per_sr(dist2);
                    back.add(gap(connection, expected as f32), 2e-3);
                    stage.lights.pdf_emission(geoms, aim, &met)
                }
                None => {
                    let source = Source::Far {
                        emitter: sample.emitter.0,
                        wi: sample.wi,
                    };
                    let connection = stage.lights.pdf_connection(geoms, &from, &source);
                    let of_one = match sample.density {
                        Density::PerSr(pdf) => pdf,
                        Density::Delta => continue,
                    };
                    back.add(gap(connection, of_one), 1e-5);
                    stage.lights.pdf_emission_escaped(aim, &from, sample.wi)
                }
            };
            match again {
                Some(again) => tally.add(apart(&again, &pdf), 2e-3),
                None => assert_eq!(pdf.onward, 0.0, "{name}: no density of {sample:?}"),
            }
        }
        tally.check(name, 0);
        back.check(name, 0);
    });
}

/// Points and directional light: the probability of their choice, both ways.
#[test]
fn sources_without_extent_are_connected_to_by_their_choice() {
    for stage in all() {
        let mut rng = Rng::new(9);
        let mut checked = 0;
        for _ in 0..300 {
            let Some(e) = stage.emit(&Aim::default(), &numbers(&mut rng)) else {
                continue;
            };
            if e.pdf.can_be_met {
                continue;
            }
            let from = reached(&e);
            let prob = stage.lights.pdf_connection(stage.geoms(), &from, &e.source);
            // The irradiance that a connection finds, over its probability, times that probability: what the
            // emission gives by its power and density.
            let lit = match lit_by(&stage, &from, &e) {
                Some(lit) => lit,
                None => continue,
            };
            let dist2 = f64::from((from.p - e.ray.o).length_squared());
            let start = f64::from(e.pdf.start);
            let expected = f64::from(e.power.g) * start * e.pdf.arrival(dist2, 1.0);
            let ratio = f64::from(lit) * f64::from(prob) / expected;
            assert!((ratio - 1.0).abs() < 2e-3, "{}: {ratio}", stage.name);
            checked += 1;
        }
        let delta = stage.lights.emitters().iter().all(|e| !e.can_be_met());
        // The normals of a curved surface spread: there the densities are nominal.
        assert!(!delta || checked > 100, "{}: {checked}", stage.name);
    }
}

/// What a connection to the source of `e` brings; numbers are tried until one chooses it.
fn lit_by(stage: &Stage, from: &Hit, e: &Emission) -> Option<f32> {
    (0..64).find_map(|i| {
        let pick = (i as f32 + 0.5) / 64.0;
        let u = Vec2::splat(0.5);
        let s = stage.lights.sample(stage.geoms(), from, pick, u)?;
        let same = s.density == Density::Delta && s.wi.distance(-e.ray.d) < 1e-3;
        same.then_some(s.le.g)
    })
}

#[test]
fn mean_power_is_the_power() {
    for stage in all() {
        let Some(power) = stage.power else { continue };
        let name = stage.name;
        for (aimed, aim) in aims() {
            if aim.share == 1.0 {
                continue;
            }
            let n = match aim.share {
                0.0 => 100_000,
                _ => 100_000,
            };
            let mut rng = Rng::new(11);
            let (mean, error) = mean_and_error(n, || {
                let power = stage
                    .emit(&aim, &numbers(&mut rng))
                    .map_or(0.0, |e| e.power.g);
                assert!(power.is_finite());
                f64::from(power)
            });
            let off = (mean - power).abs();
            let narrow = 5.0 * error < [8e-3, 3e-2][usize::from(aim.share > 0.0)] * power;
            assert!(
                narrow && off < 1e-5 * power + 4.5 * error,
                "{name}, {aimed}: {mean} and not {power}, error {error}"
            );
        }
    }
}
