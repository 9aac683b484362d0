//! Photons: where their power goes, how dense they lie, and how far a map of them reaches.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/render.rs"]
mod render;

use luxel::format::Compiled;
use luxel::geom::Hit;
use luxel::light::Aim;
use luxel::math::{PI, Vec3};
use luxel::sampler::SamplerKind;
use luxel::transport::light_walk::{LightVertex, LightWalk};
use luxel::transport::mis::Techniques;
use luxel::transport::photons::{Kernel, KernelShape, PhotonMap, Shoot, Tally, footprint};
use luxel::transport::{Ledger, Setting};
use render::{camera, compile, scene};

const LIGHT: &str = r#"<emitter type="point"><point name="position" x="0.1" y="0.2" z="0.3"/>
    <rgb name="intensity" value="1, 2, 3"/></emitter>"#;

fn setting(compiled: &Compiled) -> Setting<'_> {
    let job = &compiled.job;
    Setting {
        scene: &job.scene,
        camera: &job.camera,
        film: &job.film,
        sampler: SamplerKind::Sobol,
        seed: 1,
        replicates: 1,
        planned: None,
    }
}

fn shoot<'a>(compiled: &'a Compiled, aim: &'a Aim, count: u64) -> Shoot<'a> {
    Shoot {
        setting: setting(compiled),
        walk: LightWalk {
            scene: &compiled.job.scene,
            aim,
            techniques: Techniques::default(),
            max_edges: 10_000,
            specular_only: false,
        },
        count,
        iteration: 0,
        time: 0.0,
    }
}

fn power(vertex: &LightVertex) -> Option<[f32; 3]> {
    Some([vertex.power.r, vertex.power.g, vertex.power.b])
}

fn close(a: [f64; 3], b: [f64; 3], relative: f64) -> bool {
    let near = |(a, b): (f64, f64)| (a - b).abs() <= relative * a.abs().max(b.abs());
    a.into_iter().zip(b).all(near)
}

fn sum(parts: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|c| parts.iter().map(|p| p[c]).sum())
}

/// Fails unless all power is accounted for.
fn check_books(tally: &Tally, what: &str) {
    let spent = sum(&[tally.absorbed, tally.escaped, tally.stopped]);
    assert!(close(spent, tally.emitted, 1e-9), "{what}: {tally:?}");
    // A point light of intensity I sends 4 pi I.
    let sent = [1.0, 2.0, 3.0].map(|i| 4.0 * std::f64::consts::PI * i);
    assert!(close(tally.emitted, sent, 1e-5), "{what}: {tally:?}");
}

fn boxed(material: &str, inside: &str) -> Compiled {
    let cube = format!(
        r#"<shape type="cube"><boolean name="flip_normals" value="true"/>{material}</shape>"#
    );
    compile(&scene(
        -1,
        &camera(8, 40.0),
        &format!("{cube}{inside}{LIGHT}"),
    ))
}

fn grey(reflectance: f64) -> String {
    format!(r#"<bsdf type="diffuse"><rgb name="reflectance" value="{reflectance}"/></bsdf>"#)
}

fn ball(x: f64, material: &str) -> String {
    format!(
        r#"<shape type="sphere"><point name="center" x="{x}" y="-0.4" z="0"/>
        <float name="radius" value="0.3"/>{material}</shape>"#
    )
}

const GLASS: &str = r#"<bsdf type="dielectric"/>"#;
const MIRROR: &str = r#"<bsdf type="conductor"/>"#;
const MASK: &str = r#"<bsdf type="mask"><float name="opacity" value="0.4"/>
    <bsdf type="twosided"><bsdf type="conductor"/></bsdf></bsdf>"#;

#[test]
fn a_closed_box_absorbs_all_and_stores_a_geometric_series() {
    let things = [
        String::new(),
        ball(-0.5, GLASS) + &ball(0.5, MIRROR),
        ball(0.5, MASK),
    ];
    for inside in things {
        let compiled = boxed(&grey(0.7), &inside);
        let aim = Aim::default();
        let (photons, tally) = shoot(&compiled, &aim, 200_000).trace(&mut Ledger::default(), power);
        check_books(&tally, &inside);
        assert_eq!(tally.escaped, [0.0; 3]);
        assert_eq!(tally.stopped, [0.0; 3]);
        assert_eq!(tally.stored, photons.len() as u64);
        // Light meets the walls 1 + 0.7 + 0.7^2 + ... times. The number of times has a standard deviation of
        // sqrt(0.7) / 0.3 = 2.8: of its mean over 200,000 walks 0.19 %; four of them.
        let stored: f64 = photons.iter().map(|(_, p)| f64::from(p[0])).sum();
        let times = stored / (200_000.0 * tally.emitted[0]);
        assert!((times * 0.3 - 1.0).abs() < 7.5e-3, "{inside}: {times}");
    }
}

#[test]
fn books_balance_in_open_scenes_and_where_walks_are_cut_short() {
    let floor = format!(
        r#"<shape type="rectangle"><transform name="to_world"><scale value="2"/><translate z="-1"/></transform>{}</shape>"#,
        grey(0.5)
    );
    let contents = [
        floor.clone() + &ball(-0.5, GLASS) + &ball(0.5, MASK),
        ball(-0.5, GLASS),
        ball(0.5, r#"<bsdf type="roughdielectric"/>"#) + &floor,
    ];
    let aim = Aim::default();
    for content in contents {
        let compiled = compile(&scene(-1, &camera(8, 40.0), &format!("{content}{LIGHT}")));
        for (max_edges, specular_only) in [(1000, false), (3, false), (1000, true), (0, false)] {
            let mut shoot = shoot(&compiled, &aim, 20_000);
            shoot.walk.max_edges = max_edges;
            shoot.walk.specular_only = specular_only;
            let (_, tally) = shoot.trace(&mut Ledger::default(), power);
            check_books(&tally, &format!("{content} {max_edges} {specular_only}"));
            let escapes = tally.escaped.iter().all(|v| *v > 0.0);
            assert_eq!(escapes, max_edges > 0, "{content} {max_edges}");
        }
    }
}

#[test]
fn glass_loses_nothing_and_stores_nothing() {
    let compiled = compile(&scene(-1, &camera(8, 40.0), &(ball(-0.5, GLASS) + LIGHT)));
    let aim = Aim::default();
    let (photons, tally) = shoot(&compiled, &aim, 20_000).trace(&mut Ledger::default(), power);
    assert!(photons.is_empty(), "glass receives no photons");
    assert!(close(tally.escaped, tally.emitted, 1e-5), "{tally:?}");
    check_books(&tally, "glass");
}

/// The mean irradiance from a point light on a disk below it, from its solid angle; at any scale of the scene.
#[test]
fn photons_lie_as_dense_as_light_falls() {
    for scale in [1e-6, 1.0, 1e6] {
        let xml = scene(
            -1,
            &camera(8, 40.0),
            &format!(
                r#"<shape type="rectangle"><transform name="to_world"><scale value="{}"/></transform></shape>
                <emitter type="point"><point name="position" x="0" y="0" z="{scale}"/></emitter>"#,
                10.0 * scale
            ),
        );
        let compiled = compile(&xml);
        let aim = Aim::default();
        let shoot = shoot(&compiled, &aim, 400_000);
        let store = |v: &LightVertex| Some((v.hit, v.power.r));
        let (photons, tally) = shoot.trace(&mut Ledger::default(), store);
        assert_eq!(tally.walks, 400_000);
        let below = |(_, (hit, _)): &&(Vec3, (Hit, f32))| hit.p.truncate().length() < 0.2 * scale;
        let eye = photons.iter().find(below).unwrap().1.0;
        for shape in [KernelShape::Uniform, KernelShape::Epanechnikov] {
            let kernel = Kernel::new(shape, 0.4 * scale);
            let center = Hit {
                p: Vec3::new(0.0, 0.0, eye.p.z),
                ..eye
            };
            let map = PhotonMap::new(photons.clone(), kernel.radius());
            let mut density = 0.0;
            map.around(center.p, |(hit, power), offset, d2| {
                if kernel.accepts(&center, hit.ng, offset) {
                    density += f64::from(power * kernel.eval(d2));
                }
            });
            // In W over units of area; the light's intensity is 1.
            let irradiance = density / 400_000.0 * f64::from(scale).powi(2);
            let expected = mean_irradiance(shape);
            // 14,000 photons of quasi-random walks: 0.8 % if they were independent, 1 % with unlike weights.
            assert!(
                (irradiance / expected - 1.0).abs() < 0.01,
                "{shape:?} {scale:e}: {irradiance} {expected}"
            );
        }
    }
}

/// cos / d^2 = (1 + r^2)^(-3/2) over the disk of radius 0.4 at distance 1, weighted by the kernel.
fn mean_irradiance(shape: KernelShape) -> f64 {
    let n = 100_000;
    let kernel = Kernel::new(shape, 0.4);
    let ring = |i| {
        let d2 = 0.16 * (f64::from(i) + 0.5) / f64::from(n);
        (1.0 + d2).powf(-1.5) * f64::from(kernel.eval(d2 as f32))
    };
    (0..n).map(ring).sum::<f64>() / f64::from(n) * (0.16 * std::f64::consts::PI)
}

#[test]
fn photons_do_not_depend_on_the_number_of_threads_but_on_seed_and_iteration() {
    let compiled = boxed(&grey(0.5), &ball(0.5, GLASS));
    let aim = Aim::default();
    let base = shoot(&compiled, &aim, 30_000);
    let trace = |shoot: &Shoot, threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let mut ledger = Ledger::default();
        let traced = pool.unwrap().install(|| shoot.trace(&mut ledger, power));
        (traced, ledger.rays)
    };
    let one = trace(&base, 1);
    assert!(one == trace(&base, 4));
    assert!(one.1.photon > 30_000);
    let later = Shoot {
        iteration: 1,
        ..base
    };
    assert!(one.0.0 != trace(&later, 2).0.0);
    let mut seeded = base;
    seeded.setting.seed = 2;
    assert!(one.0.0 != trace(&seeded, 2).0.0);
}

#[test]
fn few_photons_and_none_are_no_trouble() {
    let compiled = boxed(&grey(0.5), "");
    let aim = Aim::default();
    for count in [0, 1] {
        let (photons, tally) = shoot(&compiled, &aim, count).trace(&mut Ledger::default(), power);
        assert_eq!((tally.walks, tally.stored == 0), (count, count == 0));
        let map = PhotonMap::new(photons, 1e-7);
        map.within(Vec3::ZERO, |_, d2| assert!(d2.is_finite()));
    }
    for content in ["", LIGHT] {
        let compiled = compile(&scene(-1, &camera(8, 40.0), content));
        let (photons, tally) = shoot(&compiled, &aim, 100).trace(&mut Ledger::default(), power);
        assert!(photons.is_empty());
        assert_eq!(tally.escaped, tally.emitted);
    }
}

#[test]
fn a_map_that_does_not_fit_is_refused_in_words() {
    let compiled = boxed(&grey(0.5), "");
    let aim = Aim::default();
    let check = |count, limit| shoot(&compiled, &aim, count).check(limit, "photon_count", power);
    assert_eq!(check(1_000_000, 4 << 30), Ok(()));
    assert_eq!(check(0, 0), Ok(()));
    let error = check(1_000_000_000, 1 << 30).unwrap_err();
    let parts = [
        "photon_count 1000000000 makes about ",
        " GiB of memory, more than the 1.0 GiB allowed; ",
        " would fit",
    ];
    assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    assert!(check(u64::MAX, u64::MAX).is_err());
}

#[test]
fn footprint_is_the_size_of_a_pixel_on_what_receives() {
    for scale in [1e-6, 1.0, 1e6] {
        let wall = format!(
            r#"<shape type="rectangle"><transform name="to_world"><scale value="{s}"/></transform>{{}}</shape>"#,
            s = 10.0 * scale
        );
        let view = camera(64, 40.0).replace("0, 0, 4\"", &format!("0, 0, {}\"", 4.0 * scale));
        let view = view.replace(
            r#"<float name="fov""#,
            &format!(
                r#"<float name="near_clip" value="{}"/><float name="far_clip" value="{}"/><float name="fov""#,
                0.01 * scale,
                1000.0 * scale
            ),
        );
        let size = |content: &str| footprint(&setting(&compile(&scene(-1, &view, content))));
        let white = size(&wall.replace("{}", ""));
        let expected = 2.0 * 4.0 * (20.0 / 180.0 * PI).tan() / 64.0 * scale;
        // The middle of the picture; at its rim lines of sight meet the wall at cos >= 0.89.
        let ratio = white / expected;
        assert!(
            (0.94..1.001).contains(&ratio),
            "{scale:e}: {white} {expected}"
        );
        let mirror = size(&wall.replace("{}", MIRROR));
        assert!(mirror > 0.01 * scale && mirror < 0.2 * scale, "{mirror}");
    }
    let nothing = footprint(&setting(&compile(&scene(-1, &camera(8, 40.0), ""))));
    assert!(nothing > 0.0 && nothing.is_finite());
}
