//! One light of every kind, each with what its power is by hand.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::common::Rng;
use crate::shapes::{scale, turned};
use glam::Affine2;
use luxel::geom::{
    Cylinder, Disk, Geometry, GroupId, Hit, Mesh, Placement, Ray, ShapeId, Sphere, World,
};
use luxel::light::{
    Aim, Emission, EmissionNumbers, Emitter, EnvMap, Lights, Projector, ProjectorSpec, Spot,
    SpotSpec, Strategy, Target,
};
use luxel::math::{DVec3, Motion, Rgb, Transform, Vec2, Vec3};
use luxel::texture::{Bitmap, Interpolation, Picture, Texels, Texture, Wrap};

/// Lights and what they shine on.
pub struct Stage {
    pub name: &'static str,
    pub world: World,
    pub lights: Lights,
    /// In W, of the green channel; `None` where it has no simple form.
    pub power: Option<f64>,
}

impl Stage {
    pub fn new(name: &'static str, world: World, emitters: Vec<Emitter>) -> Stage {
        let lights = Lights::in_world(emitters, &world, Strategy::Auto);
        Stage {
            name,
            world,
            lights,
            power: None,
        }
    }

    pub fn of_power(self, power: f64) -> Stage {
        Stage {
            power: Some(power),
            ..self
        }
    }

    pub fn geoms(&self) -> &[Geometry] {
        self.world.geometries()
    }

    pub fn emit(&self, aim: &Aim, u: &EmissionNumbers) -> Option<Emission> {
        self.lights.sample_emission(self.geoms(), aim, u)
    }

    pub fn meet(&self, ray: &Ray) -> Option<Hit> {
        self.world.intersect(ray, false)
    }
}

pub fn numbers(rng: &mut Rng) -> EmissionNumbers {
    EmissionNumbers {
        pick: rng.f32(),
        aim: rng.f32(),
        place: rng.vec2(),
        direction: rng.vec2(),
        time: rng.f32(),
    }
}

pub fn area(shape: u32, radiance: f32) -> Emitter {
    Emitter::Area {
        shape: ShapeId(shape),
        radiance: Rgb::splat(radiance),
    }
}

pub fn bitmap(width: u32, height: u32, texel: impl Fn(u32) -> f32) -> Texture {
    Texture::Bitmap(Bitmap {
        texels: Arc::new(Picture {
            width,
            height,
            texels: Texels::Floats((0..width * height).map(|i| [texel(i); 3]).collect()),
        }),
        interpolation: Interpolation::Bilinear,
        wrap: Wrap::Repeat,
        to_uv: Affine2::IDENTITY,
    })
}

/// Dim, with a few bright texels.
pub fn spotted() -> Texture {
    bitmap(12, 10, |i| match i {
        61 | 62 => 20.0,
        i => 0.1 + (i * 7 % 13) as f32 / 13.0,
    })
}

/// Mean over the unit square by a fine grid.
pub fn mean_of(texture: &Texture) -> f64 {
    let n = 600;
    let at = |i: usize| {
        let uv = (Vec2::new((i % n) as f32, (i / n) as f32) + 0.5) / n as f32;
        let at = luxel::texture::At {
            uv,
            ..Default::default()
        };
        f64::from(texture.eval(&at).g)
    };
    (0..n * n).map(at).sum::<f64>() / (n * n) as f64
}

pub fn looking() -> Transform {
    Transform::look_at(DVec3::new(1.0, 2.0, 5.0), DVec3::ZERO, DVec3::Y).unwrap()
}

pub fn spot(to_world: Transform, cutoff: f32, beam: f32) -> Spot {
    let spec = SpotSpec {
        to_world,
        intensity: Rgb::splat(2.0),
        cutoff: cutoff.to_radians(),
        beam: beam.to_radians(),
        texture: None,
    };
    Spot::new(spec, DVec3::ZERO)
}

pub fn projector(to_world: Transform, irradiance: Texture) -> Projector {
    let tan = 20f64.to_radians().tan();
    let spec = ProjectorSpec {
        to_world,
        irradiance,
        scale: 2.0,
        half_extent: [tan, 0.5 * tan],
    };
    Projector::new(spec, DVec3::ZERO)
}

/// A mesh whose shading normals lean against its faces.
pub fn leaning(lean: f32) -> Geometry {
    let p = [
        [-1.0, -1.0, 0.0],
        [1.0, -0.6, 0.2],
        [0.3, 1.2, 0.0],
        [-0.9, 0.8, 0.7],
    ];
    let n = [
        [lean, 0.0, 1.0],
        [-0.3, lean, 1.0],
        [0.0, -lean, 1.0],
        [0.1, 0.0, 1.0],
    ];
    let vectors = |v: [[f32; 3]; 4]| v.map(Vec3::from_array).to_vec();
    let normals = vectors(n).into_iter().map(Vec3::normalize).collect();
    let indices = vec![[0, 1, 2], [0, 2, 3]];
    Geometry::Mesh(Mesh::new(vectors(p), normals, vec![], indices, false).unwrap())
}

/// A smooth sky with a small sun.
pub fn sky() -> EnvMap {
    let (w, h) = (16, 9);
    let pixel = |i: usize| match i {
        37 => Rgb::splat(300.0),
        i => Rgb::splat(0.2 + (i % 5) as f32 * 0.3),
    };
    let pixels = (0..w * h).map(pixel).collect();
    let turn = Transform::rotate(DVec3::new(0.6, 0.0, 0.8), 70.0).unwrap();
    EnvMap::new(pixels, w, h, &turn, 1.0).unwrap()
}

fn still(geometry: Geometry) -> World {
    World::new(vec![geometry])
}

/// The shape in a group that turns, moves and stretches over the shutter.
pub fn moving(geometry: Geometry) -> World {
    let place = |x: f64, angle: f64, size: [f64; 3]| {
        Transform::translate(DVec3::new(x, 0.2, 2.5))
            * Transform::rotate(DVec3::new(1.0, 0.3, 0.2), 120.0 + angle).unwrap()
            * scale(size[0], size[1], size[2])
    };
    let keys = [
        (0.0, place(-0.5, 0.0, [1.5, 0.6, 0.8])),
        (1.0, place(0.7, 60.0, [0.8, 1.2, 0.4])),
    ];
    let motion = Motion::new(&keys, [0.0, 1.0]).unwrap();
    let group = GroupId(0);
    World::with_places(
        vec![geometry],
        &[vec![ShapeId(0)]],
        vec![Placement { group, motion }],
    )
}

/// A floor and a ball, lit from afar.
pub fn room() -> World {
    let floor = Transform::translate(DVec3::new(0.5, 0.0, -0.5)) * scale(3.0, 2.0, 1.0);
    let ball = Transform::translate(DVec3::new(1.0, 0.5, 0.7)) * scale(0.4, 0.4, 0.4);
    World::new(vec![
        Geometry::Mesh(Mesh::rectangle(&floor, false)),
        Geometry::Sphere(Sphere::new(ball, false).unwrap()),
    ])
}

/// Area of the shadow of the box around a world across `d`.
pub fn section(world: &World, d: DVec3) -> f64 {
    let e = world.bounds().diagonal().as_dvec3();
    d.abs().dot(DVec3::new(e.y * e.z, e.z * e.x, e.x * e.y))
}

fn surfaces() -> Vec<(&'static str, Geometry)> {
    let t = turned();
    vec![
        ("sphere", Geometry::Sphere(Sphere::new(t, false).unwrap())),
        (
            "inward sphere",
            Geometry::Sphere(Sphere::new(t, true).unwrap()),
        ),
        ("disk", Geometry::Disk(Disk::new(t, true))),
        ("cylinder", Geometry::Cylinder(Cylinder::new(t, false))),
        ("rectangle", Geometry::Mesh(Mesh::rectangle(&t, true))),
        ("cube", Geometry::Mesh(Mesh::cube(&t, false))),
        ("leaning normals", leaning(0.4)),
        ("strongly leaning normals", leaning(2.0)),
    ]
}

/// One of each kind.
pub fn all() -> Vec<Stage> {
    let mut stages = Vec::new();
    for (name, g) in surfaces() {
        let power = PI * 3.0 * g.area();
        stages.push(Stage::new(name, still(g), vec![area(0, 3.0)]).of_power(power));
    }
    for (name, g) in surfaces() {
        stages.push(Stage::new(name, moving(g), vec![area(0, 3.0)]));
    }
    let textured = || Emitter::TexturedArea {
        shape: ShapeId(0),
        radiance: spotted(),
    };
    for (name, g) in surfaces() {
        if !matches!(g, Geometry::Mesh(_)) {
            stages.push(Stage::new(name, still(g.clone()), vec![textured()]));
            stages.push(Stage::new(name, moving(g), vec![textured()]));
        }
    }
    let screen = Geometry::Mesh(Mesh::rectangle(&turned(), false));
    let power = PI * screen.area() * mean_of(&spotted());
    stages.push(Stage::new("screen", still(screen.clone()), vec![textured()]).of_power(power));
    stages.push(Stage::new(
        "moving screen",
        moving(screen.clone()),
        vec![textured()],
    ));
    let beam = || Emitter::Beam {
        shape: ShapeId(0),
        exitance: spotted(),
    };
    let power = screen.area() * mean_of(&spotted());
    stages.push(Stage::new("beam", still(screen), vec![beam()]).of_power(power));
    stages.extend(points());
    stages.extend(far());
    stages
}

fn points() -> Vec<Stage> {
    let point = Emitter::Point {
        p: Vec3::new(0.3, 0.2, 2.0),
        intensity: Rgb::splat(2.0),
    };
    let cone = |c: f64, b: f64| {
        let (c, b) = (c.to_radians(), b.to_radians());
        2.0 * PI * 2.0 * (1.0 - (c.sin() - b.sin()) / (c - b))
    };
    let narrow = 2.0 * PI * 2.0 * (1.0 - 0.01f64.to_radians().cos());
    let stretched = looking() * scale(2.0, 3.0, 4.0);
    let tan = 20f64.to_radians().tan();
    let picture = 2.0 * PI * (4.0 * tan * 0.5 * tan) * mean_of(&spotted());
    vec![
        Stage::new("point", room(), vec![point]).of_power(4.0 * PI * 2.0),
        Stage::new(
            "spot",
            room(),
            vec![Emitter::Spot(spot(looking(), 20.0, 10.0))],
        )
        .of_power(cone(20.0, 10.0)),
        Stage::new(
            "wide spot",
            room(),
            vec![Emitter::Spot(spot(looking(), 170.0, 0.0))],
        )
        .of_power(cone(170.0, 0.0)),
        Stage::new(
            "needle",
            room(),
            vec![Emitter::Spot(spot(looking(), 0.01, 0.01))],
        )
        .of_power(narrow),
        Stage::new(
            "stretched spot",
            room(),
            vec![Emitter::Spot(spot(stretched, 20.0, 15.0))],
        ),
        Stage::new(
            "projector",
            room(),
            vec![Emitter::Projector(projector(looking(), spotted()))],
        )
        .of_power(picture),
        Stage::new(
            "stretched projector",
            room(),
            vec![Emitter::Projector(projector(stretched, spotted()))],
        ),
    ]
}

fn far() -> Vec<Stage> {
    let d = DVec3::new(0.3, 0.5, -0.8).normalize();
    let sun = || Emitter::Directional {
        d: d.as_vec3(),
        irradiance: Rgb::splat(2.0),
    };
    let constant = || Emitter::Constant {
        radiance: Rgb::splat(0.5),
    };
    // Cauchy: the mean shadow of a convex body is a quarter of its surface.
    let surface = [DVec3::X, DVec3::Y, DVec3::Z].map(|d| 2.0 * section(&room(), d));
    let shadow = surface.iter().sum::<f64>() / 4.0;
    let (sunlight, skylight) = (2.0 * section(&room(), d), 4.0 * PI * 0.5 * shadow);
    let lamp = Emitter::Point {
        p: Vec3::new(0.3, 0.2, 2.0),
        intensity: Rgb::splat(2.0),
    };
    vec![
        Stage::new("directional", room(), vec![sun()]).of_power(sunlight),
        Stage::new("constant", room(), vec![constant()]).of_power(skylight),
        Stage::new("image", room(), vec![Emitter::Image(sky())]),
        Stage::new(
            "all together",
            room(),
            vec![sun(), constant(), lamp, area(1, 4.0)],
        )
        .of_power(sunlight + skylight + 4.0 * PI * 2.0 + PI * 4.0 * room().geometries()[1].area()),
    ]
}

/// Some of these lie behind, some around, some before the lights.
pub fn aims() -> Vec<(&'static str, Aim)> {
    let target = |x: f32, y: f32, z: f32, radius: f32| Target {
        center: Vec3::new(x, y, z),
        radius,
    };
    let targets = vec![
        target(1.0, 0.5, 0.7, 0.4),
        target(1.2, 0.3, 0.9, 0.5),
        target(-2.0, 1.0, -0.5, 0.6),
        target(0.4, 0.0, 0.6, 0.02),
    ];
    let aim = |share: f32, targets: &[Target]| Aim {
        share,
        targets: targets.to_vec(),
    };
    vec![
        ("not aimed", Aim::default()),
        ("aimed", aim(0.6, &targets)),
        ("aimed at one", aim(0.3, &targets[..1])),
        ("all aimed", aim(1.0, &targets)),
    ]
}
