//! Arbitrary output variables: what the camera sees first, without light.

use crate::geom::Ray;
use crate::math::DVec3;
use crate::scene::Scene;
use crate::transport::Li;

/// A quantity of the first surface seen. Where nothing is seen it is zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Aov {
    /// Reflectance of the surface, as a colour.
    Albedo,
    /// Shading normal, world space.
    ShadingNormal,
    /// Geometric normal, world space.
    GeometricNormal,
    /// World-space position.
    Position,
    /// Distance from the ray's origin on the near plane.
    Depth,
    Uv,
    /// Number of the shape, counted from 1.
    ShapeIndex,
    /// Number of the triangle within its mesh.
    PrimIndex,
    /// Share of samples that see a surface or an environment that shines.
    Alpha,
    /// Square of the sample's radiance: with the mean, the variance of a single sample.
    SecondMoment,
}

impl Aov {
    /// Channel names behind the layer's name.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Aov::Albedo | Aov::SecondMoment => &["R", "G", "B"],
            Aov::ShadingNormal | Aov::GeometricNormal | Aov::Position => &["X", "Y", "Z"],
            Aov::Uv => &["U", "V"],
            Aov::Alpha => &["A"],
            Aov::Depth | Aov::ShapeIndex | Aov::PrimIndex => &["Y"],
        }
    }
}

/// Appends the channels of `aovs`, in order, for the surface that `ray` meets; `li` is the sample that the
/// ray belongs to, `u` in [0,1) decides what a mixed material is.
pub fn evaluate(scene: &Scene, ray: &Ray, li: &Li, u: f32, aovs: &[Aov], out: &mut Vec<f32>) {
    let without_surface = |a: &Aov| matches!(a, Aov::SecondMoment | Aov::Alpha);
    let needs_surface = !aovs.iter().all(without_surface);
    let hit = if needs_surface {
        scene.intersect(ray)
    } else {
        None
    };
    for aov in aovs {
        let start = out.len();
        match (aov, &hit) {
            (Aov::SecondMoment, _) => out.extend(li.radiance.map(|v| v * v).to_array()),
            (Aov::Alpha, _) => out.push(f32::from(li.seen)),
            (_, None) => out.resize(start + aov.channels().len(), 0.0),
            (Aov::Albedo, Some(h)) => out.extend(scene.shade(h, u).albedo().to_array()),
            (Aov::ShadingNormal, Some(h)) => out.extend(h.frame.n.to_array()),
            (Aov::GeometricNormal, Some(h)) => out.extend(h.ng.to_array()),
            (Aov::Position, Some(h)) => {
                let world: DVec3 = h.p.as_dvec3() + scene.center();
                out.extend(world.as_vec3().to_array());
            }
            (Aov::Depth, Some(h)) => out.push(h.p.distance(ray.o)),
            (Aov::Uv, Some(h)) => out.extend(h.uv.to_array()),
            (Aov::ShapeIndex, Some(h)) => out.push((h.shape.0 + 1) as f32),
            (Aov::PrimIndex, Some(h)) => out.push(h.prim as f32),
        }
    }
}
