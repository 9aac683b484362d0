//! Bump and normal maps: a material whose shading normal follows a texture.
//!
//! The map bends the frame in which the material below is evaluated. What such a frame cannot represent is
//! settled here: a normal that looks away from the viewer is replaced by its mirror image, light that
//! would cross the surface below is left out (see `Shading`), and where the bent surface would shadow
//! itself it gets darker smoothly instead of ending in a line (Conty Estevez, Lecocq & Stein 2019, "A
//! microfacet-based shadowing function to solve the bump terminator problem", Ray Tracing Gems, ch. 12).

use crate::math::{Frame, Rgb, Vec3};
use crate::texture::{At, Texture};

/// A relief over a surface.
#[derive(Clone, Debug)]
pub struct Relief {
    pub map: Map,
    /// Mirror normals that look away from the viewer, which would be black.
    pub flip_invalid: bool,
    /// Darken light that arrives from below the smooth horizon of the relief.
    pub shadowing: bool,
}

/// Where the normal comes from.
#[derive(Clone, Debug)]
pub enum Map {
    /// Heights over the surface in scene units: `scale` times the luminance of the texture.
    Bump { heights: Texture, scale: f32 },
    /// Colour c stands for the normal 2 c - 1 in the frame of the surface.
    Normal(Texture),
}

impl Map {
    /// Whether the map leaves every normal as it is.
    pub fn is_flat(&self) -> bool {
        match self {
            Map::Bump { heights, scale } => *scale == 0.0 || heights.as_constant().is_some(),
            Map::Normal(texture) => texture.as_constant() == Some(Rgb::new(0.5, 0.5, 1.0)),
        }
    }
}

/// A bent frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bent {
    pub frame: Frame,
    /// Of the shadowing function, 0 for none.
    pub alpha2: f32,
}

/// The surface that is bent, in its own frame: tangents dp/du and dp/dv, and the geometric normal.
pub(super) struct Smooth {
    pub dp_du: Vec3,
    pub dp_dv: Vec3,
    pub ng: Vec3,
}

impl Relief {
    /// Bends `frame`; `wo` is the direction of the viewer in it, and `smooth` the surface seen from the
    /// front.
    pub(super) fn bend(&self, frame: &Frame, wo: Vec3, smooth: &Smooth, at: &At) -> Bent {
        let mut n = self.normal(smooth, at);
        if self.flip_invalid && n.dot(wo) * wo.z <= 0.0 {
            n = Vec3::new(-n.x, -n.y, n.z);
        }
        // Tangents stay as near to those of the surface as the new normal allows.
        let local = Frame::from_tangent(n, Vec3::X);
        let world = |v: Vec3| frame.to_world(v).normalize();
        Bent {
            frame: Frame {
                s: world(local.s),
                t: world(local.t),
                n: world(local.n),
            },
            alpha2: if self.shadowing { alpha2(n.z) } else { 0.0 },
        }
    }

    /// The bent normal in the frame of the surface.
    fn normal(&self, smooth: &Smooth, at: &At) -> Vec3 {
        match &self.map {
            Map::Normal(texture) => {
                let c = texture.eval(at).map(|v| 2.0 * v - 1.0);
                Vec3::from_array(c.to_array()).normalize_or(Vec3::Z)
            }
            // The surface p + n h has the tangents dp/du + n dh/du and dp/dv + n dh/dv, where the change
            // of n is left out (Blinn 1978, "Simulation of wrinkled surfaces").
            Map::Bump { heights, scale } => {
                let slope = heights.gradient(at.uv) * *scale;
                let du = smooth.dp_du.truncate().extend(slope.x);
                let dv = smooth.dp_dv.truncate().extend(slope.y);
                let n = du.cross(dv).normalize_or(Vec3::Z);
                if n.dot(smooth.ng) < 0.0 { -n } else { n }
            }
        }
    }
}

/// Squared roughness of the shadowing function for a normal whose cosine with the smooth one is `cos`
/// (equation 12.5).
fn alpha2(cos: f32) -> f32 {
    let cos2 = (cos * cos).min(1.0);
    (0.125 * (1.0 - cos2) / cos2.max(f32::MIN_POSITIVE)).min(1.0)
}

/// Smith's shadowing of GGX for light at cosine `cos` with the smooth normal: 2 / (1 + sqrt(1 + alpha2
/// tan²)), 1 for `alpha2` 0. `cos` not 0.
pub(super) fn shadowing(alpha2: f32, cos: f32) -> f32 {
    let c = cos.abs().min(1.0);
    2.0 * c / (c + (c * c + alpha2 * (1.0 - c * c)).sqrt())
}
