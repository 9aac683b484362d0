//! Scenes of a few surfaces, and the closed forms for them.

use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

use luxel::format::{self, Overrides};
use luxel::math::DVec3;
use luxel::radiosity::form_factors::{FormFactors, Matrix};
use luxel::radiosity::{FormFactorMethod, PatchMesh, Surfaces};
use luxel::scene::Scene;

/// A white parallelogram with one corner at `o`; its front is where `e1` × `e2` points to.
pub fn quad(o: DVec3, e1: DVec3, e2: DVec3) -> String {
    // The rectangle of the language reaches from -1 to 1.
    let (x, y) = (e1 * 0.5, e2 * 0.5);
    let (n, c) = (x.cross(y), o + x + y);
    let n = n * (x.length() / n.length());
    format!(
        r#"<shape type="rectangle"><transform name="to_world"><matrix value="{} {} {} {} {} {} {} {} {} {} {} {} 0 0 0 1"/></transform>
        <bsdf type="diffuse"/></shape>"#,
        x.x, y.x, n.x, c.x, x.y, y.y, n.y, c.y, x.z, y.z, n.z, c.z
    )
}

/// The inside of an axis-parallel box.
pub fn inside(low: DVec3, high: DVec3) -> String {
    let d = high - low;
    let (x, y, z) = (DVec3::X * d.x, DVec3::Y * d.y, DVec3::Z * d.z);
    [
        quad(low, x, y),
        quad(low, y, z),
        quad(low, z, x),
        quad(high, -y, -x),
        quad(high, -z, -y),
        quad(high, -x, -z),
    ]
    .concat()
}

/// The outside of a parallelepiped at `o`; the edges make a right-handed system.
pub fn block(o: DVec3, [x, y, z]: [DVec3; 3]) -> String {
    let far = o + x + y + z;
    [
        quad(o, y, x),
        quad(o, z, y),
        quad(o, x, z),
        quad(far, -x, -y),
        quad(far, -y, -z),
        quad(far, -z, -x),
    ]
    .concat()
}

/// A unit box with two turned blocks that hover in it: all that is inside is seen, and nothing else.
pub fn furnished() -> String {
    let turned = |degrees: f64, w: f64| {
        let (s, c) = degrees.to_radians().sin_cos();
        [
            DVec3::new(c * w, s * w, 0.0),
            DVec3::new(-s * w, c * w, 0.0),
        ]
    };
    let [a, b] = [turned(17.0, 0.3), turned(-16.0, 0.3)];
    [
        inside(DVec3::ZERO, DVec3::ONE),
        block(DVec3::new(0.2, 0.5, 0.1), [a[0], a[1], DVec3::Z * 0.6]),
        block(DVec3::new(0.52, 0.2, 0.1), [b[0], b[1], DVec3::Z * 0.3]),
    ]
    .concat()
}

pub struct Room {
    pub scene: Scene,
    pub mesh: PatchMesh,
}

/// Patches of at most `size`, curved shapes within `curve_error` of their radius.
pub fn room(content: &str, size: f64, curve_error: f64) -> Room {
    let xml = format!(
        r#"<scene version="3.0.0"><sensor type="perspective"/><emitter type="constant"/>{content}</scene>"#
    );
    let desc =
        format::load_str("test.xml", &xml, Path::new("."), &[]).unwrap_or_else(|e| panic!("{e}"));
    let job = format::compile(&desc, &Overrides::default())
        .unwrap_or_else(|e| panic!("{e}"))
        .job;
    let scene = job.scene;
    let surfaces = Arc::new(Surfaces::new(&scene, curve_error));
    let mesh = PatchMesh::uniform(&scene, surfaces, size);
    Room { scene, mesh }
}

impl Room {
    pub fn matrix(&self, method: FormFactorMethod, seed: u64) -> Matrix {
        FormFactors::new(&self.scene, &self.mesh, method, seed).matrix()
    }

    /// The form factor from all patches of the first shape to all others.
    pub fn first_to_others(&self, method: FormFactorMethod, seed: u64) -> f64 {
        let factors = FormFactors::new(&self.scene, &self.mesh, method, seed);
        let facets = self.mesh.surfaces.facets();
        let mut row = vec![0.0; self.mesh.len()];
        let (mut sum, mut area) = (0.0, 0.0);
        for (i, patch) in self.mesh.patches.iter().enumerate() {
            if facets[patch.facet as usize].shape.0 == 0 {
                factors.row(i as u32, &mut row);
                sum += patch.area * row.iter().sum::<f64>();
                area += patch.area;
            }
        }
        sum / area
    }
}

/// Rectangles a by b, opposite each other at distance c (Howell C-11).
pub fn parallel(a: f64, b: f64, c: f64) -> f64 {
    let (x, y) = (a / c, b / c);
    let (x2, y2) = (1.0 + x * x, 1.0 + y * y);
    let log = 0.5 * (x2 * y2 / (x2 + y * y)).ln();
    let first = x * y2.sqrt() * (x / y2.sqrt()).atan();
    let second = y * x2.sqrt() * (y / x2.sqrt()).atan();
    2.0 / (PI * x * y) * (log + first + second - x * x.atan() - y * y.atan())
}

/// From a rectangle l by w to one l by h that stands on its edge of length l (Howell C-14).
pub fn perpendicular(l: f64, w: f64, h: f64) -> f64 {
    let (h, w) = (h / l, w / l);
    let (h2, w2) = (h * h, w * w);
    let s = h2 + w2;
    let log = ((1.0 + w2) * (1.0 + h2) / (1.0 + s)).ln()
        + w2 * (w2 * (1.0 + s) / ((1.0 + w2) * s)).ln()
        + h2 * (h2 * (1.0 + s) / ((1.0 + h2) * s)).ln();
    let turn = w * (1.0 / w).atan() + h * (1.0 / h).atan() - s.sqrt() * (1.0 / s.sqrt()).atan();
    (turn + 0.25 * log) / (PI * w)
}

/// From a disk of radius `r1` to one of `r2`, coaxial, at distance `h` (Howell C-41).
pub fn disks(r1: f64, r2: f64, h: f64) -> f64 {
    let (a, b) = (r1 / h, r2 / h);
    let x = 1.0 + (1.0 + b * b) / (a * a);
    0.5 * (x - (x * x - 4.0 * (b / a).powi(2)).sqrt())
}

/// From a sphere to a coaxial disk of radius `r` whose middle is at distance `h` from the sphere's (Howell C-124).
pub fn sphere_to_disk(r: f64, h: f64) -> f64 {
    0.5 * (1.0 - 1.0 / (1.0 + (r / h).powi(2)).sqrt())
}

/// From a sphere to a rectangle a by b, a corner of which is at distance `d` straight below the middle of the
/// sphere (Howell C-126): a share of the sphere of directions.
pub fn sphere_to_rectangle(a: f64, b: f64, d: f64) -> f64 {
    (a * b / (d * (d * d + a * a + b * b).sqrt())).atan() / (4.0 * PI)
}
