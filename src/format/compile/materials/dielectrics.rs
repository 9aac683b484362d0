//! Glass and plastic.

use super::{Materials, roughness_shape};
use crate::bsdf::{Base, Coat, Microfacet};
use crate::format::{Props, SceneError};
use crate::material::{Coated, Glass, Material};

impl<'a> Materials<'a> {
    pub(super) fn glass(&mut self, p: &Props<'a>) -> Result<Glass, SceneError> {
        Ok(Glass {
            eta: index_ratio(p)?,
            reflectance: self.reflectance(p, "specular_reflectance")?,
            transmittance: self.reflectance(p, "specular_transmittance")?,
        })
    }

    pub(super) fn plastic(&mut self, p: &Props<'a>) -> Result<Material, SceneError> {
        let (eta, nonlinear) = (index_ratio(p)?, p.bool("nonlinear")?);
        Ok(Material::Coated(Coated {
            eta,
            base: Base::smooth(eta, nonlinear),
            rough: None,
            diffuse: self.reflectance(p, "diffuse_reflectance")?,
            reflectance: self.reflectance(p, "specular_reflectance")?,
        }))
    }

    pub(super) fn rough_plastic(&mut self, p: &Props<'a>) -> Result<Material, SceneError> {
        let (eta, nonlinear) = (index_ratio(p)?, p.bool("nonlinear")?);
        let shape = roughness_shape(p)?;
        let alpha = p.float("alpha")? as f32;
        let facets = Microfacet {
            visible: p.bool("sample_visible")?,
            ..Microfacet::new(shape, alpha, alpha)
        };
        let coat = Coat::of(shape, alpha, eta);
        Ok(Material::Coated(Coated {
            eta,
            base: coat.base(eta, nonlinear),
            rough: Some((facets, coat)),
            diffuse: self.reflectance(p, "diffuse_reflectance")?,
            reflectance: self.reflectance(p, "specular_reflectance")?,
        }))
    }
}

/// Index of refraction inside over that outside, within 1e-6 to 1e6: beyond, a boundary is a mirror to the
/// last digit, and squares of the ratio would leave the range of f32.
fn index_ratio(p: &Props) -> Result<f32, SceneError> {
    let ratio = p.ior("int_ior")? / p.ior("ext_ior")?;
    Ok(ratio.clamp(1e-6, 1e6) as f32)
}
