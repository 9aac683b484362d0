//! Small scenes that have one thing each that integrators may see differently. All are 24 x 24 pixels.

/// A picture of a scene, and what is asked of it.
#[derive(Clone)]
pub struct Scene {
    pub name: &'static str,
    pub xml: String,
    pub max_depth: u32,
    /// Whether nothing in view has a delta lobe: light tracing finds all that is there to be seen.
    pub ptracer: bool,
    /// That photons are gathered from.
    pub radius: f32,
}

/// A sensor at (0, 0.5, 4) that looks at the origin.
fn sensor(kind: &str, settings: &str, filter: &str, to_world: &str) -> String {
    format!(
        r#"<sensor type="{kind}">{settings}
            <float name="shutter_open" value="0"/><float name="shutter_close" value="1"/>
            <transform name="to_world">{to_world}
                <lookat origin="0, 0.5, 4" target="0, -0.1, 0" up="0, 1, 0"/></transform>
            <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="24"/>
                <rfilter type="{filter}"/></film>
        </sensor>"#
    )
}

fn pinhole() -> String {
    sensor(
        "perspective",
        r#"<float name="fov" value="36"/>"#,
        "box",
        "",
    )
}

fn diffuse(r: f64, g: f64, b: f64) -> String {
    format!(r#"<bsdf type="diffuse"><rgb name="reflectance" value="{r}, {g}, {b}"/></bsdf>"#)
}

fn both_sides(bsdf: &str) -> String {
    format!(r#"<bsdf type="twosided">{bsdf}</bsdf>"#)
}

fn rectangle(transform: &str, content: &str) -> String {
    format!(
        r#"<shape type="rectangle"><transform name="to_world">{transform}</transform>{content}</shape>"#
    )
}

fn ball([x, y, z]: [f64; 3], radius: f64, content: &str) -> String {
    format!(
        r#"<shape type="sphere"><point name="center" x="{x}" y="{y}" z="{z}"/>
            <float name="radius" value="{radius}"/>{content}</shape>"#
    )
}

/// At y = -0.8.
fn floor(bsdf: &str) -> String {
    rectangle(
        r#"<scale value="2.5"/><rotate x="1" angle="-90"/><translate y="-0.8"/>"#,
        bsdf,
    )
}

fn area(radiance: &str) -> String {
    format!(r#"<emitter type="area">{radiance}</emitter>"#)
}

fn lamp(size: f64, radiance: f64) -> String {
    let to_world =
        format!(r#"<scale value="{size}"/><rotate x="1" angle="90"/><translate y="1.5"/>"#);
    let radiance = format!(
        r#"<rgb name="radiance" value="{radiance}, {}, {}"/>"#,
        0.8 * radiance,
        0.6 * radiance
    );
    rectangle(&to_world, &area(&radiance))
}

fn sky(radiance: f64) -> String {
    format!(
        r#"<emitter type="constant"><rgb name="radiance" value="{radiance}, {radiance}, {}"/></emitter>"#,
        1.2 * radiance
    )
}

fn scene(sensor: &str, content: &[String]) -> String {
    format!(
        r#"<scene version="3.0.0"><integrator type="path"/>{sensor}{}</scene>"#,
        content.concat()
    )
}

/// With a wall behind and to the right, so that light meets several surfaces.
fn corner(sensor: &str, content: &[String]) -> String {
    let walls = [
        floor(&diffuse(0.6, 0.55, 0.5)),
        rectangle(
            r#"<scale value="2.5"/><translate z="-1.2"/>"#,
            &both_sides(&diffuse(0.3, 0.4, 0.6)),
        ),
    ];
    scene(sensor, &[walls.concat(), content.concat()])
}

/// A ball of few triangles with the normals of a ball, as a file: an octahedron cut in four.
fn coarse_ball() -> String {
    let mut faces = Vec::new();
    for signs in 0..8 {
        let sign = |k: u32| if signs >> k & 1 == 0 { 1.0 } else { -1.0 };
        let [x, y, z] = [
            [sign(0), 0.0, 0.0],
            [0.0, sign(1), 0.0],
            [0.0, 0.0, sign(2)],
        ];
        let middle = |a: [f64; 3], b: [f64; 3]| {
            [0, 1, 2].map(|k| (a[k] + b[k]) * std::f64::consts::FRAC_1_SQRT_2)
        };
        let [xy, yz, zx] = [middle(x, y), middle(y, z), middle(z, x)];
        let outwards = sign(0) * sign(1) * sign(2) > 0.0;
        for [a, b, c] in [[x, xy, zx], [xy, y, yz], [zx, yz, z], [xy, yz, zx]] {
            faces.push(if outwards { [a, b, c] } else { [a, c, b] });
        }
    }
    let mut obj = String::new();
    for corner in faces.iter().flatten() {
        let [x, y, z] = *corner;
        obj += &format!("v {x} {y} {z}\nvn {x} {y} {z}\n");
    }
    for i in 0..faces.len() {
        let [a, b, c] = [3 * i + 1, 3 * i + 2, 3 * i + 3];
        obj += &format!("f {a}//{a} {b}//{b} {c}//{c}\n");
    }
    let file = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("coarse-ball.obj");
    std::fs::write(&file, obj).expect("the target folder can be written to");
    file.display().to_string()
}

fn mesh(file: &str, transform: &str, content: &str) -> String {
    format!(
        r#"<shape type="obj"><string name="filename" value="{file}"/>
            <transform name="to_world">{transform}</transform>{content}</shape>"#
    )
}

fn bump(scale: f64, bsdf: &str) -> String {
    format!(
        r#"<bsdf type="bumpmap"><float name="scale" value="{scale}"/>
            <texture type="bitmap"><string name="filename" value="scenes/textures/waves.png"/>
                <boolean name="raw" value="true"/></texture>{bsdf}</bsdf>"#
    )
}

const GLASS: &str = r#"<bsdf type="dielectric"/>"#;
const MIRROR: &str = r#"<bsdf type="conductor"><string name="material" value="none"/></bsdf>"#;

fn things() -> Vec<String> {
    vec![
        ball([-0.5, -0.4, 0.0], 0.4, &diffuse(0.7, 0.3, 0.2)),
        ball([0.5, -0.5, 0.4], 0.3, &diffuse(0.2, 0.5, 0.3)),
    ]
}

pub fn indoors() -> Vec<Scene> {
    let wall = |transform: &str, bsdf: String| {
        let transform = format!(r#"<translate z="-1"/>{transform}"#);
        rectangle(&transform, &bsdf)
    };
    let white = || diffuse(0.7, 0.7, 0.7);
    let room = [
        wall("", white()),
        wall(r#"<rotate x="1" angle="-90"/>"#, white()),
        wall(r#"<rotate x="1" angle="90"/>"#, white()),
        wall(r#"<rotate y="1" angle="90"/>"#, diffuse(0.6, 0.1, 0.1)),
        wall(r#"<rotate y="1" angle="-90"/>"#, diffuse(0.1, 0.5, 0.1)),
        rectangle(
            r#"<scale value="0.5"/><rotate x="1" angle="90"/><translate y="0.9"/>"#,
            &area(r#"<rgb name="radiance" value="8, 6, 4"/>"#),
        ),
    ];
    let tiles = r#"<texture type="bitmap" name="radiance">
        <string name="filename" value="scenes/textures/tiles.png"/></texture>"#;
    let screen = rectangle(
        r#"<scale value="0.8"/><rotate y="1" angle="65"/><translate x="-1.3" y="0.1"/>"#,
        &area(tiles),
    );
    vec![
        Scene {
            name: "diffuse box",
            xml: scene(&pinhole(), &room),
            max_depth: 6,
            ptracer: true,
            radius: 0.015,
        },
        Scene {
            name: "glass and mirror balls",
            xml: corner(
                &pinhole(),
                &[
                    ball([-0.5, -0.4, 0.0], 0.4, GLASS),
                    ball([0.5, -0.5, 0.4], 0.3, MIRROR),
                    lamp(1.2, 3.0),
                ],
            ),
            max_depth: 8,
            ptracer: false,
            radius: 0.03,
        },
        Scene {
            name: "textured lamp",
            xml: corner(&pinhole(), &[things().concat(), screen]),
            max_depth: 5,
            ptracer: true,
            radius: 0.03,
        },
    ]
}

pub fn lights() -> Vec<Scene> {
    let lamps = r#"
        <emitter type="point"><point name="position" x="0.9" y="0.9" z="0.9"/>
            <rgb name="intensity" value="1.5, 1, 0.5"/></emitter>
        <emitter type="spot"><rgb name="intensity" value="4, 5, 6"/>
            <float name="cutoff_angle" value="25"/>
            <transform name="to_world">
                <lookat origin="-1, 1.2, 1" target="-0.4, -0.6, 0" up="0, 1, 0"/></transform></emitter>
        <emitter type="directional"><rgb name="irradiance" value="0.5, 0.4, 0.6"/>
            <vector name="direction" x="-0.3" y="-1" z="-0.5"/></emitter>"#;
    let image = r#"<emitter type="envmap">
        <string name="filename" value="scenes/textures/sky.exr"/></emitter>"#;
    vec![
        Scene {
            name: "lights of one point or direction",
            xml: corner(&pinhole(), &[things().concat(), lamps.to_string()]),
            max_depth: 5,
            ptracer: true,
            radius: 0.03,
        },
        Scene {
            name: "image of the sky",
            xml: scene(
                &pinhole(),
                &[
                    floor(&diffuse(0.6, 0.55, 0.5)),
                    things().concat(),
                    image.to_string(),
                ],
            ),
            max_depth: 5,
            ptracer: true,
            radius: 0.02,
        },
        Scene {
            name: "even sky and a lamp",
            xml: scene(
                &pinhole(),
                &[
                    floor(&diffuse(0.6, 0.55, 0.5)),
                    things().concat(),
                    lamp(0.3, 5.0),
                    sky(0.5),
                ],
            ),
            max_depth: 5,
            ptracer: true,
            radius: 0.02,
        },
    ]
}

pub fn surfaces() -> Vec<Scene> {
    let rough = r#"<bsdf type="roughconductor"><string name="material" value="Cu"/>
        <float name="alpha" value="0.3"/></bsdf>"#;
    let satin = r#"<bsdf type="roughconductor"><string name="material" value="Cu"/>
        <float name="alpha" value="0.5"/></bsdf>"#;
    let frosted = r#"<bsdf type="roughdielectric"><float name="alpha" value="0.4"/></bsdf>"#;
    let paint = r#"<bsdf type="roughplastic"><float name="alpha" value="0.2"/>
        <rgb name="diffuse_reflectance" value="0.3, 0.5, 0.2"/></bsdf>"#;
    let coated = r#"<bsdf type="plastic">
        <rgb name="diffuse_reflectance" value="0.6, 0.3, 0.2"/></bsdf>"#;
    let mixed = format!(
        r#"<bsdf type="blendbsdf"><float name="weight" value="0.4"/>{MIRROR}{}</bsdf>"#,
        diffuse(0.3, 0.5, 0.2)
    );
    let mask = |inner: &str| {
        format!(r#"<bsdf type="mask"><float name="opacity" value="0.4"/>{inner}</bsdf>"#)
    };
    let file = coarse_ball();
    let screen = |bsdf: &str| {
        rectangle(
            r#"<scale value="0.6"/><rotate y="1" angle="30"/><translate x="0.3" y="0.1" z="1"/>"#,
            bsdf,
        )
    };
    vec![
        Scene {
            name: "rough surfaces",
            xml: corner(
                &pinhole(),
                &[
                    ball([-0.5, -0.4, 0.0], 0.4, rough),
                    ball([0.5, -0.45, 0.4], 0.35, frosted),
                    ball([0.2, 0.3, -0.6], 0.35, paint),
                    lamp(0.8, 4.0),
                ],
            ),
            max_depth: 6,
            ptracer: true,
            radius: 0.025,
        },
        Scene {
            name: "surfaces with lobes of both kinds",
            xml: corner(
                &pinhole(),
                &[
                    ball([-0.5, -0.4, 0.0], 0.4, coated),
                    ball([0.5, -0.5, 0.4], 0.3, &mixed),
                    lamp(1.2, 3.0),
                ],
            ),
            max_depth: 5,
            ptracer: false,
            radius: 0.03,
        },
        Scene {
            name: "bent normals",
            xml: scene(
                &pinhole(),
                &[
                    floor(&bump(0.15, &diffuse(0.6, 0.55, 0.5))),
                    mesh(
                        &file,
                        r#"<scale value="0.5"/><translate x="-0.5" y="-0.4"/>"#,
                        &diffuse(0.7, 0.3, 0.2),
                    ),
                    mesh(
                        &file,
                        r#"<scale value="0.4"/><translate x="0.5" y="-0.4" z="0.3"/>"#,
                        satin,
                    ),
                    lamp(1.2, 3.0),
                ],
            ),
            max_depth: 5,
            ptracer: true,
            radius: 0.025,
        },
        Scene {
            name: "masks and panes",
            xml: corner(
                &pinhole(),
                &[
                    things().concat(),
                    screen(&mask(&both_sides(&diffuse(0.5, 0.5, 0.2)))),
                    ball([-0.5, -0.4, 0.0], 0.6, r#"<bsdf type="null"/>"#),
                    lamp(0.6, 5.0),
                ],
            ),
            max_depth: 7,
            ptracer: true,
            radius: 0.02,
        },
    ]
}

pub fn cameras() -> Vec<Scene> {
    let content = || [things().concat(), lamp(0.6, 5.0)];
    let lens = sensor(
        "thinlens",
        r#"<float name="fov" value="36"/><float name="aperture_radius" value="0.2"/>
            <float name="focus_distance" value="3.5"/>"#,
        "gaussian",
        "",
    );
    let parallel = sensor("orthographic", "", "tent", r#"<scale x="1.2" y="1.2"/>"#);
    let moving = |radius: f64, [x, y]: [f64; 2], bsdf: &str| {
        format!(
            r#"<shape type="sphere"><float name="radius" value="{radius}"/>
                <animation name="to_world">
                    <transform time="0"><translate x="{x}" y="{y}"/></transform>
                    <transform time="1"><translate x="{}" y="{}" z="0.4"/></transform>
                </animation>{bsdf}</shape>"#,
            x + 0.6,
            y + 0.3
        )
    };
    let ball_of = |bsdf: &str| [moving(0.4, [-0.7, -0.4], bsdf), lamp(1.2, 3.0)];
    vec![
        Scene {
            name: "thin lens",
            xml: corner(&lens, &content()),
            max_depth: 5,
            ptracer: true,
            radius: 0.02,
        },
        Scene {
            name: "orthographic",
            xml: corner(&parallel, &content()),
            max_depth: 5,
            ptracer: true,
            radius: 0.02,
        },
        Scene {
            name: "moving ball",
            xml: corner(&pinhole(), &ball_of(&diffuse(0.7, 0.3, 0.2))),
            max_depth: 5,
            ptracer: true,
            radius: 0.03,
        },
        Scene {
            name: "moving glass ball and a lens",
            xml: corner(&lens, &ball_of(GLASS)),
            max_depth: 7,
            ptracer: false,
            radius: 0.02,
        },
    ]
}
