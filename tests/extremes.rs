//! Numerical stability at the extremes: size, distance from the origin, brightness.

#[path = "common/render.rs"]
mod render;

use render::picture;

/// A ball and a cube under a lamp and a mirror wall; everything scaled by `scale` and then moved by
/// `offset` (scene sizes) along a crooked direction.
fn scaled(scale: f64, offset: f64, radiance: f64) -> String {
    let m = offset * scale;
    let place = format!(
        r#"<scale value="{scale:e}"/><translate x="{m:e}" y="{:e}" z="{:e}"/>"#,
        -0.7 * m,
        0.9 * m
    );
    format!(
        r#"<scene version="3.0.0">
        <integrator type="path"><integer name="max_depth" value="5"/></integrator>
        <sensor type="perspective"><float name="fov" value="40"/>
            <float name="near_clip" value="{:e}"/><float name="far_clip" value="{:e}"/>
            <transform name="to_world"><lookat origin="{:e}, {:e}, {:e}" target="{:e}, {:e}, {:e}" up="0, 1, 0"/></transform>
            <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/>
                <rfilter type="box"/></film></sensor>
        <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/><scale value="3"/>{place}</transform>
            <bsdf type="diffuse"/></shape>
        <shape type="sphere"><transform name="to_world"><scale value="0.6"/><translate x="-0.5" y="0.6"/>{place}</transform>
            <bsdf type="dielectric"/></shape>
        <shape type="cube"><transform name="to_world"><scale value="0.4"/><rotate y="1" angle="30"/>
            <translate x="0.7" y="0.4"/>{place}</transform>
            <bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.3, 0.2"/></bsdf></shape>
        <shape type="cylinder"><transform name="to_world"><scale x="0.2" y="0.2" z="0.8"/><rotate x="1" angle="-90"/>
            <translate x="0.2" z="-1"/>{place}</transform><bsdf type="roughconductor"/></shape>
        <shape type="rectangle"><transform name="to_world"><scale value="0.5"/><rotate x="1" angle="90"/>
            <translate y="2.5"/>{place}</transform>
            <emitter type="area"><rgb name="radiance" value="{radiance:e}"/></emitter></shape>
        </scene>"#,
        1e-2 * scale,
        1e4 * scale,
        m,
        scale - 0.7 * m,
        4.0 * scale + 0.9 * m,
        m,
        0.6 * scale - 0.7 * m,
        0.9 * m,
    )
}

/// Standard score of the difference of two noisy pictures' means; both rendered with the same numbers,
/// so nearly all of the noise cancels.
fn mean_ratio(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    a.iter().flatten().sum::<f64>() / b.iter().flatten().sum::<f64>()
}

#[test]
fn size_and_place_do_not_change_the_picture() {
    let reference = picture(&scaled(1.0, 0.0, 10.0), 64, 7);
    for scale in [1e-6, 1e-3, 1e3, 1e6] {
        let ratio = mean_ratio(&picture(&scaled(scale, 0.0, 10.0), 64, 7), &reference);
        // The same random numbers: only paths near an edge may differ.
        assert!((ratio - 1.0).abs() < 2e-3, "scale {scale:e}: ratio {ratio}");
    }
    for (scale, offset) in [(1.0, 1e3), (1.0, 1e6), (1e-6, 1e6), (1e6, -1e6)] {
        let ratio = mean_ratio(&picture(&scaled(scale, offset, 10.0), 64, 7), &reference);
        assert!(
            (ratio - 1.0).abs() < 2e-3,
            "scale {scale:e}, offset {offset:e}: ratio {ratio}"
        );
    }
}

#[test]
fn brightness_scales_exactly() {
    let reference = picture(&scaled(1.0, 0.0, 1.0), 16, 3);
    for exponent in [-40, 40] {
        let factor = 2f64.powi(exponent);
        let bright = picture(&scaled(1.0, 0.0, factor), 16, 3);
        // Powers of two leave every mantissa as it is.
        for (a, b) in bright.iter().flatten().zip(reference.iter().flatten()) {
            assert!(
                (a - b * factor).abs() <= 1e-6 * b * factor,
                "{a} {b} at 2^{exponent}"
            );
        }
    }
}

#[test]
fn degenerate_geometry_gives_finite_pictures() {
    // Needle and zero-area triangles, duplicate and coplanar faces, a light of hardly any size.
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1e-7 0\nv 0 0 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\nf 1 1 2\nf 1 2 3\n";
    let dir = std::env::temp_dir().join(format!("luxel-extremes-{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    std::fs::write(dir.join("needles.obj"), obj).unwrap();
    let content = format!(
        r#"<path value="{}"/>
        <shape type="obj"><string name="filename" value="needles.obj"/><bsdf type="twosided"><bsdf type="diffuse"/></bsdf></shape>
        <shape type="obj"><string name="filename" value="needles.obj"/><bsdf type="twosided"><bsdf type="diffuse"/></bsdf>
            <emitter type="area"/></shape>
        <shape type="rectangle"><bsdf type="twosided"><bsdf type="diffuse"/></bsdf></shape>
        <shape type="rectangle"><transform name="to_world"><scale value="1e-6"/><translate z="1"/></transform>
            <emitter type="area"><rgb name="radiance" value="1e12"/></emitter></shape>"#,
        dir.display()
    );
    let mean = picture(
        &render::scene(6, &render::camera(16, 40.0), &content),
        64,
        1,
    );
    assert!(mean.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
    std::fs::remove_dir_all(&dir).unwrap();
}

#[test]
fn long_paths_in_a_mirror_box_end_right() {
    // A closed ball of perfect mirrors seen from inside holds no light; one whose wall glows a little
    // adds the same at every bounce.
    let bounces = 10_000;
    let content = r#"<shape type="sphere"><float name="radius" value="5"/><boolean name="flip_normals" value="true"/>
        <bsdf type="conductor"><string name="material" value="none"/></bsdf>
        <emitter type="area"><rgb name="radiance" value="0.5"/></emitter></shape>"#;
    let xml = render::scene(bounces, &render::camera(2, 40.0), content).replace(
        "</integrator>",
        &format!(
            r#"<integer name="rr_depth" value="{}"/></integrator>"#,
            bounces + 1
        ),
    );
    let mean = render::mean_of(&picture(&xml, 1, 1));
    let expected = 0.5 * f64::from(bounces);
    assert!((mean / expected - 1.0).abs() < 1e-4, "{mean} {expected}");
}

#[test]
fn rays_leave_the_large_triangles_they_start_on() {
    use luxel::geom::{Accel, Endpoint, Geometry, Mesh, MeshRef, Ray, ShapeId};
    use luxel::math::{DVec3, Frame, Transform, Vec2, Vec3, warp};
    use luxel::sampler::{Sampler, SamplerKind};

    // A wall in a coordinate plane: there one coordinate of every corner is zero, and so is its rounding.
    for (scale, axis) in [
        (1.0, DVec3::Y),
        (559.2, DVec3::Y),
        (559.2, DVec3::X),
        (1e5, DVec3::new(0.3, 1.0, 0.2)),
    ] {
        let place =
            Transform::rotate(axis, 90.0).unwrap() * Transform::scale(DVec3::splat(scale)).unwrap();
        let geometry = Geometry::Mesh(Mesh::rectangle(&place, false));
        let Geometry::Mesh(mesh) = &geometry else {
            unreachable!()
        };
        let wall = MeshRef {
            shape: ShapeId(0),
            positions: mesh.positions(),
            indices: mesh.indices(),
        };
        let accel = Accel::build(&[wall], &[]);
        let normal = mesh.face_normal(0);
        let (mut met, mut blocked) = (0, 0);
        for i in 0..200_000 {
            let u = Sampler::new(SamplerKind::Independent, 1, 0, i, 1).get4(0);
            let v = Sampler::new(SamplerKind::Independent, 1, 0, i, 1).get4(1);
            let local = DVec3::new(
                f64::from(2.0 * u[0] - 1.0),
                f64::from(2.0 * u[1] - 1.0),
                0.0,
            );
            // Onto the wall along its normal: the hit that a walk would have there.
            let above = (place.point(local).as_vec3()) + normal * (0.3 * scale as f32);
            let ray = Ray::new(above, -normal);
            let Some(raw) = accel.intersect(&ray) else {
                continue;
            };
            let hit = geometry.hit(&ray, &raw, false);
            let wi =
                Frame::from_normal(normal).to_world(warp::cosine_hemisphere(Vec2::new(u[2], u[3])));
            met += usize::from(accel.intersect(&hit.spawn(wi)).is_some());
            let far = Endpoint {
                p: above + Vec3::splat(v[0] * scale as f32),
                p_err: Vec3::ZERO,
                ng: Vec3::ZERO,
            };
            blocked += usize::from(
                accel.occluded(&hit.spawn_to(&far))
                    && wi.dot(normal) > 0.0
                    && (far.p - hit.p).dot(normal) > 0.0,
            );
        }
        assert_eq!((met, blocked), (0, 0), "scale {scale}, axis {axis}");
    }
}
