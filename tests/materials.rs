//! Materials made of materials: masks and mixtures against closed forms, reliefs against measured figures.

mod common;
#[path = "common/render.rs"]
mod render;

use std::sync::Arc;

use common::{Rng, Running, direction, seen_from};
use glam::Affine2;
use luxel::bsdf::{Bsdf, Diffuse, Microfacet, Mode, RoughConductor, Shape};
use luxel::bsdf::{Conductor, Density};
use luxel::material::{Map, Material, Relief, Shading};
use luxel::math::warp::uniform_sphere;
use luxel::math::{Rgb, Vec2, Vec3};
use luxel::texture::{Bitmap, Interpolation, Picture, Texels, Texture, Wrap};
use render::{assert_explained, camera, mean_and_error, picture, scene};

const PI: f64 = std::f64::consts::PI;

fn white() -> Material {
    Material::Uniform(Bsdf::Diffuse(Diffuse::new(Rgb::WHITE)))
}

fn normal_map(color: [f32; 3], shadowing: bool, inside: Material) -> Material {
    Material::Relief {
        relief: Box::new(Relief {
            map: Map::Normal(Texture::Constant(Rgb::from_array(color))),
            flip_invalid: true,
            shadowing,
        }),
        inside: Box::new(inside),
    }
}

fn shade(material: &Material, wo: Vec3) -> Shading {
    material.shade(&seen_from(wo, Vec2::ZERO), 0.5, || (Vec3::X, Vec3::Y))
}

/// f cos of a white diffuse surface, measured with Mitsuba 3.9.1.
#[test]
fn normal_maps_match_measured_values() {
    let (grazing, low) = (direction(85.0, 0.0), direction(75.0, 180.0));
    let table = [
        // colour, wo, wi, with the shadowing function, without
        (
            [0.5, 0.5, 1.0],
            direction(30.0, 0.0),
            grazing,
            0.02774,
            0.02774,
        ),
        (
            [0.7, 0.5, 0.85],
            direction(30.0, 0.0),
            grazing,
            0.10318,
            0.18141,
        ),
        (
            [0.5, 0.9, 0.8],
            direction(60.0, 200.0),
            low,
            0.03270,
            0.04943,
        ),
        // The next two look away from the viewer and are mirrored.
        (
            [0.7, 0.5, 0.85],
            direction(80.0, 180.0),
            direction(30.0, 0.0),
            0.15984,
            0.16038,
        ),
        (
            [0.95, 0.5, 0.6],
            direction(60.0, 200.0),
            low,
            0.13077,
            0.31801,
        ),
        // Light from behind the bent surface.
        ([0.7, 0.5, 0.85], direction(60.0, 200.0), low, 0.0, 0.0),
    ];
    for (color, wo, wi, with, without) in table {
        for (shadowing, expected) in [(true, with), (false, without)] {
            let shading = shade(&normal_map(color, shadowing, white()), wo);
            let found = shading.eval_pdf(wi, Mode::Radiance).0.r;
            assert!(
                (found - expected).abs() < 1e-5,
                "{color:?} {shadowing}: {found} {expected}"
            );
        }
    }
}

/// f cos of a white diffuse surface over four heights, measured with Mitsuba 3.9.1.
#[test]
fn bump_maps_match_measured_values() {
    let heights = |scale: f32| {
        let texels = [0.0, 1.0, 0.5, 0.25].map(|v| [v; 3]).to_vec();
        let map = Map::Bump {
            heights: Texture::Bitmap(Bitmap {
                texels: Arc::new(Picture {
                    width: 2,
                    height: 2,
                    texels: Texels::Floats(texels),
                }),
                interpolation: Interpolation::Bilinear,
                wrap: Wrap::Clamp,
                to_uv: Affine2::IDENTITY,
            }),
            scale,
        };
        Material::Relief {
            relief: Box::new(Relief {
                map,
                flip_invalid: true,
                shadowing: true,
            }),
            inside: Box::new(white()),
        }
    };
    let directions = [
        (direction(30.0, 0.0), direction(40.0, 90.0)),
        (direction(60.0, 200.0), direction(75.0, 180.0)),
        (direction(10.0, 0.0), direction(80.0, 180.0)),
        (direction(70.0, 0.0), direction(60.0, 20.0)),
    ];
    let table = [
        (0.1, [0.4, 0.45], [0.240131, 0.096263, 0.069393, 0.145505]),
        (0.1, [0.6, 0.7], [0.253739, 0.082193, 0.055067, 0.163626]),
        (1.0, [0.4, 0.45], [0.187538, 0.183366, 0.149098, 0.258250]),
        (1.0, [0.6, 0.7], [0.307915, 0.067049, 0.040926, 0.180384]),
    ];
    for (scale, uv, expected) in table {
        let material = heights(scale);
        for ((wo, wi), expected) in directions.into_iter().zip(expected) {
            let tangents = || (Vec3::new(2.0, 0.5, 0.0), Vec3::new(0.0, 1.5, 0.0));
            let shading = material.shade(&seen_from(wo, Vec2::from_array(uv)), 0.5, tangents);
            let found = shading.eval_pdf(wi, Mode::Radiance).0.r;
            assert!(
                (found - expected).abs() < 5e-6,
                "{scale} {uv:?}: {found} {expected}"
            );
        }
    }
}

#[test]
fn the_slope_of_a_picture_is_its_derivative() {
    let mut rng = Rng::new(3);
    let texels = (0..35).map(|_| [rng.f32(); 3]).collect();
    let bitmap = Texture::Bitmap(Bitmap {
        texels: Arc::new(Picture {
            width: 7,
            height: 5,
            texels: Texels::Floats(texels),
        }),
        interpolation: Interpolation::Bilinear,
        wrap: Wrap::Repeat,
        to_uv: Affine2::from_scale_angle_translation(Vec2::new(2.0, 0.7), 0.4, Vec2::splat(0.1)),
    });
    let value = |uv: Vec2| {
        let at = luxel::texture::At {
            uv,
            ..Default::default()
        };
        bitmap.eval_scalar(&at)
    };
    let (mut worst, h) = (Vec::new(), 1e-3);
    for _ in 0..500 {
        let uv = rng.vec2();
        let slope = |d: Vec2| (value(uv + d) - value(uv - d)) / (2.0 * h);
        let expected = Vec2::new(slope(Vec2::X * h), slope(Vec2::Y * h));
        worst.push((bitmap.gradient(uv) - expected).length());
    }
    worst.sort_by(f32::total_cmp);
    // Differences that span two texels, about one in fifty, are not derivatives.
    assert!(worst[450] < 2e-3, "{}", worst[450]);
}

/// Whatever the relief, samples have the density that is said, and weights are the value over it: also
/// where the bent frame, the surface and the viewer disagree. Shares and first moments of the samples are
/// compared with integrals over all directions.
#[test]
fn bent_materials_sample_what_they_say() {
    let rough = || {
        Material::Uniform(Bsdf::RoughConductor(RoughConductor {
            facets: Microfacet::new(Shape::Ggx, 0.3, 0.5),
            metal: Conductor::new(Rgb::splat(0.2), Rgb::splat(3.0)),
        }))
    };
    let both = |m: Material| Material::TwoSided {
        front: Box::new(m.clone()),
        back: Box::new(m),
    };
    let colors = [[0.7, 0.5, 0.85], [0.95, 0.4, 0.6], [0.2, 0.9, 0.52]];
    let views = [(20.0, 40.0), (80.0, 190.0), (120.0, 10.0)].map(|(t, p)| direction(t, p));
    let mut seed = 0;
    for (color, wo) in colors.into_iter().flat_map(|c| views.map(|v| (c, v))) {
        for material in [
            normal_map(color, true, both(rough())),
            both(normal_map(color, true, rough())),
        ] {
            let shading = shade(&material, wo);
            seed += 1;
            let mut rng = Rng::new(seed);
            // Pairs of sampled and integrated numbers: the share, and the weight with its moments.
            let mut differences = [Running::default(); 5];
            for _ in 0..100_000 {
                let sample = shading.sample(rng.f32(), rng.vec2(), Mode::Radiance);
                let sampled = sample.map_or([0.0; 5], |s| {
                    let (f, pdf) = shading.eval_pdf(s.wi, Mode::Radiance);
                    let Density::PerSr(density) = s.density else {
                        panic!("a delta")
                    };
                    // Directions that graze a plane lose digits on the way to the world and back.
                    if s.wi.z.abs().min(shading.normal().dot(s.wi).abs()) > 1e-3 {
                        assert!((density / pdf - 1.0).abs() < 2e-3, "{density} {pdf}");
                        assert!((s.weight.r * pdf / f.r - 1.0).abs() < 2e-3);
                    }
                    let w = s.weight.r;
                    [1.0, w, w * s.wi.x, w * s.wi.y, w * s.wi.z]
                });
                let wi = uniform_sphere(rng.vec2());
                let (f, pdf) = shading.eval_pdf(wi, Mode::Radiance);
                let f = f.r;
                let integrated =
                    [pdf, f, f * wi.x, f * wi.y, f * wi.z].map(|v| v * 4.0 * PI as f32);
                for (d, (a, b)) in differences
                    .iter_mut()
                    .zip(sampled.into_iter().zip(integrated))
                {
                    d.add(f64::from(a - b));
                }
            }
            for (i, d) in differences.iter().enumerate() {
                // 90 comparisons: 4.5 standard errors fail by chance once in 1600 runs of another seed.
                assert!(
                    d.mean.abs() <= 4.5 * d.stderr(),
                    "{color:?} {wo} {i}: {d:?}"
                );
            }
        }
    }
}

#[test]
fn wild_reliefs_give_numbers() {
    let mut rng = Rng::new(5);
    let special = [0.0, -0.0, 0.5, 1.0, 1e-30, 1e30, -1e30];
    for _ in 0..20_000 {
        let mut pick = |list: &[f64]| list[(rng.f32() * list.len() as f32) as usize];
        let color = [(); 3].map(|()| pick(&special) as f32);
        let theta = pick(&[0.0, 30.0, 89.99999, 90.0, 90.00001, 150.0, 180.0]);
        let wo = direction(theta, pick(&[0.0, 45.0, 180.0]));
        let wi = direction(pick(&[0.0, 30.0, 89.99999, 90.0, 150.0]), 33.0);
        let shading = shade(&normal_map(color, true, white()), wo);
        let (f, pdf) = shading.eval_pdf(wi, Mode::Radiance);
        assert!(f.is_finite() && pdf.is_finite(), "{color:?} {wo} {wi}");
        if let Some(s) = shading.sample(0.5, Vec2::new(0.3, 0.6), Mode::Radiance) {
            assert!(s.wi.is_finite() && s.weight.is_finite());
        }
    }
}

/// A floor of albedo 0.6 under a point light at a height of 2, with `sheets` of `bsdf` between them.
fn under_sheets(bsdf: &str, sheets: u32, max_depth: i32) -> String {
    let sheet = |i: u32| {
        format!(
            r#"<shape type="rectangle">
                <transform name="to_world"><scale value="9"/><translate z="{}"/></transform>{bsdf}
            </shape>"#,
            0.5 + 0.1 * f64::from(i)
        )
    };
    // The camera looks at the floor from the side, below the sheets.
    format!(
        r#"<scene version="3.0.0">
            <integrator type="path"><integer name="max_depth" value="{max_depth}"/></integrator>
            <sensor type="perspective">
                <float name="fov" value="0.02"/>
                <transform name="to_world"><lookat origin="0, 3, 0.3" target="0, 0, 0" up="0, 0, 1"/></transform>
                <film type="hdrfilm">
                    <integer name="width" value="4"/><integer name="height" value="4"/><rfilter type="box"/>
                </film>
            </sensor>
            <shape type="rectangle">
                <transform name="to_world"><scale value="50"/></transform>
                <bsdf type="diffuse"><rgb name="reflectance" value="0.6"/></bsdf>
            </shape>
            <emitter type="point"><point name="position" value="0, 0, 2"/><rgb name="intensity" value="10"/></emitter>
            {}</scene>"#,
        (0..sheets).map(sheet).collect::<String>()
    )
}

/// Light behind masks arrives in proportion to what they leave open, and each mask counts as an edge of
/// the path.
#[test]
fn masks_let_light_pass_and_count_as_edges() {
    let mask = r#"<bsdf type="mask"><float name="opacity" value="0.3"/>
        <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf></bsdf>"#;
    let open = 0.6 / PI * 10.0 / 4.0;
    for (sheets, max_depth, share) in [
        (0, 2, 1.0),
        (1, 2, 0.0),
        (1, 3, 0.7),
        (2, 3, 0.0),
        (2, 4, 0.49),
    ] {
        let mean = picture(&under_sheets(mask, sheets, max_depth), 16, 1)[0][0];
        let expected = share * open;
        // Without chance: the camera sees the floor, and the mean share of the masks is taken.
        assert!(
            (mean - expected).abs() <= 1e-4 * open,
            "{sheets} {max_depth}: {mean} {expected}"
        );
    }
    let closed =
        r#"<bsdf type="mask"><float name="opacity" value="1"/><bsdf type="diffuse"/></bsdf>"#;
    assert_eq!(picture(&under_sheets(closed, 1, 9), 1, 1)[0][0], 0.0);
    let nothing =
        r#"<bsdf type="mask"><float name="opacity" value="0"/><bsdf type="diffuse"/></bsdf>"#;
    let mean = picture(&under_sheets(nothing, 3, 9), 1, 1)[0][0];
    assert!((mean - open).abs() < 1e-4 * open);
}

/// In a white furnace a white surface is as bright as the sky however much of it is cut away.
#[test]
fn masks_and_mixtures_conserve_energy() {
    for bsdf in [
        r#"<bsdf type="mask"><float name="opacity" value="0.4"/><bsdf type="twosided"><bsdf type="diffuse">
            <rgb name="reflectance" value="1"/></bsdf></bsdf></bsdf>"#,
        r#"<bsdf type="blendbsdf"><float name="weight" value="0.3"/>
            <bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="1"/></bsdf></bsdf>
            <bsdf type="mask"><float name="opacity" value="0.2"/><bsdf type="dielectric"/></bsdf>
        </bsdf>"#,
    ] {
        let xml = scene(
            -1,
            &camera(6, 30.0),
            &format!(
                r#"<emitter type="constant"><rgb name="radiance" value="1"/></emitter>
                <shape type="sphere">{bsdf}</shape>"#
            ),
        );
        assert_explained(mean_and_error(&xml, 256, 7), 1.0, bsdf);
    }
}

/// The weight is the share of the second material.
#[test]
fn mixtures_follow_their_weight() {
    let xml = scene(
        2,
        &camera(6, 10.0),
        r#"<emitter type="constant"><rgb name="radiance" value="1"/></emitter>
        <shape type="rectangle"><transform name="to_world"><scale value="9"/></transform>
            <bsdf type="blendbsdf"><float name="weight" value="0.3"/>
                <bsdf type="diffuse"><rgb name="reflectance" value="0.8"/></bsdf>
                <bsdf type="diffuse"><rgb name="reflectance" value="0.2"/></bsdf>
            </bsdf>
        </shape>"#,
    );
    assert_explained(mean_and_error(&xml, 256, 3), 0.7 * 0.8 + 0.3 * 0.2, "blend");
}

/// Hidden emitters stay hidden behind masks and panes, which the camera looks straight through.
#[test]
fn hidden_emitters_are_hidden_behind_what_is_not_there() {
    for bsdf in [
        r#"<bsdf type="mask"><float name="opacity" value="0.5"/><bsdf type="diffuse">
            <rgb name="reflectance" value="0"/></bsdf></bsdf>"#,
        r#"<bsdf type="thindielectric"><float name="int_ior" value="1"/><float name="ext_ior" value="1"/></bsdf>"#,
        r#"<bsdf type="null"/>"#,
    ] {
        let xml = format!(
            r#"<scene version="3.0.0">
                <integrator type="path"><boolean name="hide_emitters" value="true"/></integrator>{}
                <emitter type="constant"><rgb name="radiance" value="1"/></emitter>
                <shape type="sphere">{bsdf}</shape>
                <shape type="rectangle"><transform name="to_world"><translate z="-2"/></transform>
                    <emitter type="area"/></shape>
            </scene>"#,
            camera(6, 10.0)
        );
        assert!(picture(&xml, 16, 1).iter().all(|p| p[0] == 0.0), "{bsdf}");
    }
}
