//! The ends of what can be asked for: no sample that is no number, and the right mean where it is known.

use super::common::Running;
use super::{bidirectional, combined, fixed, path, picture, render};
use luxel::format::Compiled;
use luxel::transport::{IntegratorSpec, Method, PhotonSpec};

const SIDE: u32 = 12;
const DEPTH: u32 = 6;

const LAMP: &str = r#"<shape type="rectangle"><transform name="to_world"><scale value="1.2"/>
    <rotate x="1" angle="90"/><translate y="1.5"/>PLACE</transform>
    <emitter type="area"><rgb name="radiance" value="3"/></emitter></shape>"#;

fn ball(material: &str) -> String {
    format!(
        r#"<shape type="sphere"><transform name="to_world"><scale value="0.5"/>
            <translate x="-0.3" y="-0.3"/>PLACE</transform>{material}</shape>"#
    )
}

const GLASS: &str = r#"<bsdf type="dielectric"/>"#;

/// A floor and `content`, in which `PLACE` stands for the scaling of the whole.
fn scene(scale: f64, content: &str) -> Compiled {
    let place = format!(r#"<scale value="{scale:e}"/>"#);
    let floor = r#"<shape type="rectangle"><transform name="to_world"><scale value="2"/>
        <rotate x="1" angle="-90"/><translate y="-0.8"/>PLACE</transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.6"/></bsdf></shape>
        <shape type="rectangle"><transform name="to_world"><scale value="2"/><translate z="-1"/>PLACE</transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.6"/></bsdf></shape>"#;
    let content = format!("{floor}{content}").replace("PLACE", &place);
    let (far, up) = (4.0 * scale, 0.5 * scale);
    render::compile(&format!(
        r#"<scene version="3.0.0"><integrator type="path"/>
        <sensor type="perspective"><float name="fov" value="36"/>
            <float name="near_clip" value="{:e}"/><float name="far_clip" value="{:e}"/>
            <transform name="to_world">
                <lookat origin="0, {up:e}, {far:e}" target="0, 0, 0" up="0, 1, 0"/></transform>
            <film type="hdrfilm"><integer name="width" value="{SIDE}"/><integer name="height" value="{SIDE}"/>
                <rfilter type="box"/></film></sensor>
        {content}</scene>"#,
        1e-2 * scale,
        1e4 * scale,
    ))
}

/// All that shoot photons, and how they are called.
fn with(photons: PhotonSpec) -> Vec<(&'static str, IntegratorSpec)> {
    vec![
        ("vcm", bidirectional(Method::Vcm, DEPTH, photons.clone())),
        ("sppm", bidirectional(Method::Sppm, DEPTH, photons.clone())),
        ("combined", combined(DEPTH, photons)),
    ]
}

/// The others that walk from lights; light tracing is left out where glass is in view.
fn without(ptracer: bool) -> Vec<(&'static str, IntegratorSpec)> {
    let of = |method| bidirectional(method, DEPTH, PhotonSpec::default());
    let mut all = vec![("bdpt", of(Method::Bdpt))];
    if ptracer {
        all.push(("ptracer", of(Method::Ptracer)));
    }
    all
}

/// Mean of the picture over 12 runs.
fn mean(compiled: &mut Compiled, spec: &IntegratorSpec, spp: u64) -> Running {
    let mut runs = Running::default();
    for seed in 0..12 {
        runs.add(render::mean_of(&picture(compiled, spec, spp, seed)));
    }
    runs
}

/// Fails where the means differ by more than 5.5 standard errors (Student's t of 11 and more degrees of freedom
/// exceeds that once in 5000) and the share `bias`.
fn assert_same(a: &Running, b: &Running, bias: f64, what: &str) {
    let stderr = a.stderr().hypot(b.stderr());
    let ratio = a.mean / b.mean;
    let error = stderr / b.mean;
    println!("{what}: {ratio:.4} +- {error:.4}");
    assert!(error < 0.03, "{what}: too noisy, {error}");
    assert!(
        (ratio - 1.0).abs() < 5.5 * error + bias,
        "{what}: {ratio} +- {error}"
    );
}

/// With a disk next to nothing, merging counts for nothing: vcm is bdpt, and the others lose what it brought.
#[test]
fn disks_of_all_sizes() {
    let mut glass = scene(1.0, &format!("{LAMP}{}", ball(GLASS)));
    let reference = mean(&mut glass, &IntegratorSpec::Path(path(DEPTH)), 48);
    let size = 6.0;
    for (name, spec) in with(fixed(500, 1e-7 * size)) {
        let got = mean(&mut glass, &spec, 16);
        match name {
            "vcm" => assert_same(&got, &reference, 0.0, "vcm with the smallest disk"),
            _ => assert!(got.mean > 0.3 * reference.mean && got.mean < 1.1 * reference.mean),
        }
    }
    // As large as the scene: blurred all over, but of the right order.
    for (name, spec) in with(fixed(500, size)) {
        let ratio = mean(&mut glass, &spec, 4).mean / reference.mean;
        println!("{name} with the largest disk: {ratio}");
        assert!(ratio > 0.4 && ratio < 1.6, "{name}: {ratio}");
    }
}

#[test]
fn a_single_photon_and_none_that_hits() {
    let mut glass = scene(1.0, &format!("{LAMP}{}", ball(GLASS)));
    let reference = mean(&mut glass, &IntegratorSpec::Path(path(DEPTH)), 48);
    // What one photon per iteration brings is blurred within 0.3; on average it is all that there is.
    for (name, spec) in with(fixed(1, 0.3)) {
        let got = mean(&mut glass, &spec, 120);
        assert_same(&got, &reference, 0.1, &format!("{name} with one photon"));
    }
    // A lamp that shines away from all: no photon arrives.
    let away = LAMP
        .replace(r#"angle="90""#, r#"angle="-90""#)
        .replace(r#"y="1.5""#, r#"y="3""#);
    let mut dark = scene(1.0, &format!("{away}{}", ball(GLASS)));
    for (name, spec) in with(fixed(100, 0.1)).into_iter().chain(without(false)) {
        // The lamp's back is black; its front is out of sight, and nothing is there to throw its light back.
        let got = mean(&mut dark, &spec, 4);
        assert!(got.mean == 0.0, "{name}: {}", got.mean);
    }
}

/// A lamp of 1e-12 of area is a point but for what cannot be connected to.
#[test]
fn the_smallest_lamp() {
    let tiny = r#"<shape type="rectangle"><transform name="to_world"><scale value="5e-7"/>
        <rotate x="1" angle="90"/><translate y="1"/>PLACE</transform>
        <emitter type="area"><rgb name="radiance" value="5e12"/></emitter></shape>"#;
    let matt = ball(r#"<bsdf type="diffuse"/>"#);
    let mut compiled = scene(1.0, &format!("{tiny}{matt}"));
    let reference = mean(&mut compiled, &IntegratorSpec::Path(path(DEPTH)), 48);
    for (name, spec) in with(fixed(500, 0.03)).into_iter().chain(without(true)) {
        assert_same(
            &mean(&mut compiled, &spec, 12),
            &reference,
            0.01,
            &format!("{name}, tiny lamp"),
        );
    }
    // Its caustics, which path tracing does not find, are found alike.
    let mut compiled = scene(1.0, &format!("{tiny}{}", ball(GLASS)));
    let mut specs = with(fixed(2000, 0.02));
    let (_, first) = specs.remove(0);
    let reference = mean(&mut compiled, &first, 10);
    for (name, spec) in specs {
        let what = format!("{name}, caustics of a tiny lamp");
        assert_same(&mean(&mut compiled, &spec, 10), &reference, 0.02, &what);
    }
}

#[test]
fn scenes_of_all_sizes() {
    let content = format!("{LAMP}{}", ball(GLASS));
    let of = |scale: f64| {
        let mut compiled = scene(scale, &content);
        let specs = with(fixed(500, (0.05 * scale) as f32))
            .into_iter()
            .chain(without(true));
        specs
            .map(|(name, spec)| (name, render::mean_of(&picture(&mut compiled, &spec, 24, 1))))
            .collect::<Vec<_>>()
    };
    let reference = of(1.0);
    for scale in [1e-6, 1e6] {
        for ((name, a), (_, b)) in of(scale).iter().zip(&reference) {
            println!("{name}, scale {scale:e}: {}", a / b);
            // The same random numbers: only paths near an edge differ.
            assert!(
                (a / b - 1.0).abs() < 5e-3,
                "{name}, scale {scale:e}: {}",
                a / b
            );
        }
    }
}

#[test]
fn glass_that_hardly_bends_light() {
    let thin = r#"<bsdf type="dielectric"><float name="int_ior" value="1.0001"/>
        <float name="ext_ior" value="1"/></bsdf>"#;
    let mut empty = scene(1.0, LAMP);
    // Two more edges than through the ball.
    let reference = mean(&mut empty, &IntegratorSpec::Path(path(DEPTH)), 48);
    let mut glass = scene(1.0, &format!("{LAMP}{}", ball(thin)));
    let photons = fixed(1000, 0.03);
    for method in [Method::Bdpt, Method::Vcm, Method::Sppm] {
        let spec = bidirectional(method, DEPTH + 4, photons.clone());
        let what = format!("{method:?} through hardly any glass");
        assert_same(&mean(&mut glass, &spec, 12), &reference, 0.02, &what);
    }
    let spec = combined(DEPTH + 4, photons);
    assert_same(
        &mean(&mut glass, &spec, 12),
        &reference,
        0.02,
        "combined through hardly any glass",
    );
}

/// Ten thousand bounces between mirrors that lose nothing: wherever one looks, the lamp is seen at last.
#[test]
fn a_box_of_mirrors() {
    let xml = r#"<scene version="3.0.0"><integrator type="path"/>
        <sensor type="perspective"><float name="fov" value="60"/>
            <transform name="to_world"><lookat origin="0.3, 0.2, 0.9" target="0, 0.1, 0" up="0, 1, 0"/></transform>
            <film type="hdrfilm"><integer name="width" value="3"/><integer name="height" value="3"/>
                <rfilter type="box"/></film></sensor>
        <shape type="cube"><boolean name="flip_normals" value="true"/>
            <bsdf type="conductor"><string name="material" value="none"/></bsdf></shape>
        <shape type="sphere"><point name="center" x="-0.2" y="-0.1" z="-0.3"/><float name="radius" value="0.3"/>
            <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
            <emitter type="area"><rgb name="radiance" value="2"/></emitter></shape></scene>"#;
    let mut compiled = render::compile(xml);
    let depth = 10_000;
    let mut specs = vec![
        IntegratorSpec::Path(path(depth)),
        combined(depth, fixed(20, 0.1)),
    ];
    for method in [Method::Bdpt, Method::Ptracer, Method::Vcm, Method::Sppm] {
        specs.push(bidirectional(method, depth, fixed(20, 0.1)));
    }
    for mut spec in specs {
        // No roulette: every walk of the eye meets the lamp, and no other technique has a share in it.
        if let Some(rr_depth) = spec.rr_depth() {
            *rr_depth = 2 * depth;
        }
        let got = picture(&mut compiled, &spec, 8, 1);
        println!("{} between mirrors: {}", spec.name(), render::mean_of(&got));
        // Light tracing cannot connect mirrors to the camera: it shows the lamp alone.
        if spec.name() != "ptracer" {
            assert!(
                got.iter().all(|p| (p[0] / 2.0 - 1.0).abs() < 1e-4),
                "{got:?}"
            );
        }
    }
}

#[test]
fn without_mirrors_combined_is_path_bit_for_bit() {
    let mut compiled = scene(
        1.0,
        &format!("{LAMP}{}", ball(r#"<bsdf type="roughconductor"/>"#)),
    );
    let by_path = picture(&mut compiled, &IntegratorSpec::Path(path(DEPTH)), 8, 3);
    let got = picture(&mut compiled, &combined(DEPTH, fixed(100, 0.1)), 8, 3);
    assert!(got == by_path);
}
