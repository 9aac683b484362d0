//! The walk from the eye, joined at each of its vertices with light.

use super::join::EyeVertex;
use super::{Engine, Photons};
use crate::bsdf::{Bsdf, Density, Mode};
use crate::geom::{Hit, Ray};
use crate::math::{Rgb, Vec3};
use crate::sampler::Sampler;
use crate::transport::light_walk::LightVertex;
use crate::transport::mis::{self, Leg, State, Techniques};
use crate::transport::path::{SPREAD_VERTICES, first_seen, survival};
use crate::transport::{Ledger, Li, Technique, VertexNumbers};

/// One walk from the eye.
pub struct EyeWalk<'a> {
    pub engine: &'a Engine<'a>,
    pub techniques: Techniques,
    pub photons: Option<&'a Photons>,
    /// Vertices of light that the eye's are connected to.
    pub light: &'a [LightVertex],
}

/// The last vertex that scattered the eye's walk.
struct Last {
    hit: Hit,
    density: Density,
    leg: Leg,
}

impl EyeWalk<'_> {
    /// What the camera sees without any scattering: emitters.
    pub fn look(&self, ray: Ray, ledger: &mut Ledger) -> Li {
        let scene = self.engine.setting.scene;
        let hide = self.engine.spec.hide_emitters;
        let met = first_seen(scene, ray, hide, &mut ledger.rays);
        let le = match &met {
            _ if hide || self.engine.max_depth == 0 => Rgb::BLACK,
            Some(hit) => scene.le(hit),
            None => scene.le_escaped(ray.d),
        };
        ledger.record(Technique::Emission, le);
        Li {
            radiance: le,
            seen: met.is_some() || !le.is_black(),
        }
    }

    /// One sample of the radiance along `ray`.
    pub fn walk(&self, mut ray: Ray, sampler: &Sampler, ledger: &mut Ledger) -> Li {
        let Engine { setting, spec, .. } = self.engine;
        let scene = setting.scene;
        let max_depth = self.engine.max_depth;
        let (mut lo, mut throughput) = (Rgb::BLACK, Rgb::WHITE);
        let (mut seen, mut straight) = (false, true);
        let mut eta2 = 1.0;
        let mut later = false;
        let mut last: Option<Last> = None;
        for depth in 0..max_depth {
            let met = match straight {
                true => first_seen(scene, ray, spec.hide_emitters, &mut ledger.rays),
                false => scene.intersect(&ray),
            };
            if !(straight && spec.hide_emitters) {
                let le = self.emission(&ray, met.as_ref(), last.as_ref());
                seen |= straight && !le.is_black();
                let le = throughput * le;
                ledger.record(Technique::Emission, le);
                lo += le;
            }
            let Some(hit) = met else {
                break;
            };
            if depth + 1 >= max_depth {
                break;
            }
            let roulette = depth + 1 >= spec.rr_depth;
            let sampler = match depth < SPREAD_VERTICES {
                true => *sampler,
                false => sampler.independent(),
            };
            let mut numbers = VertexNumbers::new(&sampler, depth);
            let u_material = numbers.material(scene);
            let shading = scene.shade(&hit, u_material);
            if let Bsdf::Null(passed) = shading.bsdf {
                throughput *= passed.transmittance;
                ray = hit.spawn(ray.d);
                ledger.rays.indirect += 1;
                continue;
            }
            let pane = matches!(shading.bsdf, Bsdf::ThinDielectric(_));
            if !pane {
                straight = false;
                seen = true;
            }
            let u = numbers.draw(true);
            let vertex = EyeVertex {
                hit,
                shading,
                u_material,
                state: self.arrive(&ray, &hit, last.as_ref()),
                edges: depth + 1,
                later,
            };
            if !shading.bsdf.is_delta() {
                let lit = self.join(&vertex, throughput, &u, ledger);
                lo += throughput * lit;
            }
            let Some(sample) = shading.sample(u.lobe, u.direction, Mode::Radiance) else {
                break;
            };
            if pane && sample.wi.dot(hit.ng) * hit.wo.dot(hit.ng) > 0.0 {
                straight = false;
                seen = true;
            }
            throughput *= sample.weight;
            eta2 *= sample.eta * sample.eta;
            if roulette {
                let survival = survival(throughput, eta2, depth);
                if u.roulette >= survival {
                    break;
                }
                throughput *= 1.0 / survival;
            }
            if throughput.is_black() {
                break;
            }
            let leg = vertex.state.leave(
                sample.density,
                || vertex.pdf_back(scene, sample.wi),
                f64::from(hit.ng.dot(sample.wi).abs()),
                self.techniques.connection,
                self.techniques.merging(later),
            );
            later |= sample.density != Density::Delta;
            ray = hit.spawn(sample.wi);
            ledger.rays.indirect += 1;
            last = Some(Last {
                hit,
                density: sample.density,
                leg,
            });
        }
        Li { radiance: lo, seen }
    }

    /// What multiple importance sampling knows on arriving at `hit`.
    fn arrive(&self, ray: &Ray, hit: &Hit, last: Option<&Last>) -> State {
        let cos = f64::from(hit.ng.dot(hit.wo).abs());
        match last {
            Some(last) => {
                let dist2 = f64::from((hit.p - last.hit.p).length_squared());
                last.leg.arrive(dist2, cos)
            }
            None if self.techniques.splats > 0.0 => {
                let camera = self.engine.setting.camera;
                let importance = camera.importance(hit.p, ray.d, ray.time);
                State {
                    pdf: f64::from(importance) * cos,
                    cut: mis::power(self.techniques.splats),
                    // Connecting to the emitter does better.
                    cut_straight: 0.0,
                    ..State::default()
                }
            }
            // No other technique cuts the path at the camera.
            None => State {
                pdf: 1.0,
                ..State::default()
            },
        }
    }

    /// Weighted radiance emitted towards the walk by what `ray` met.
    fn emission(&self, ray: &Ray, met: Option<&Hit>, last: Option<&Last>) -> Rgb {
        let scene = self.engine.setting.scene;
        let le = match met {
            Some(hit) => scene.le(hit),
            None => scene.le_escaped(ray.d),
        };
        let Some(last) = last.filter(|_| !le.is_black()) else {
            return le;
        };
        let aim = &self.engine.aim;
        let connected = match last.density {
            Density::Delta => 0.0,
            Density::PerSr(pdf) => {
                let light = match met {
                    Some(hit) => scene.pdf_light(&last.hit, hit),
                    None => scene.pdf_light_escaped(&last.hit, ray.d),
                };
                mis::power(f64::from(light) / f64::from(pdf))
            }
        };
        let emitted = match met {
            Some(hit) => scene.pdf_emission(aim, hit),
            None => scene.pdf_emission_escaped(aim, &last.hit, ray.d),
        };
        let walked = emitted.map_or(0.0, |pdf| last.leg.emitted(&pdf));
        le * (1.0 / (1.0 + connected + walked)) as f32
    }
}

/// Unit vector and squared length of `d`; `None` where that is no direction.
pub fn direction(d: Vec3) -> Option<(Vec3, f64)> {
    let d = d.as_dvec3();
    let wi = d.try_normalize()?.as_vec3();
    Some((wi, d.length_squared()))
}
