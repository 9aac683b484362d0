//! Burley's principled materials.

use super::Materials;
use crate::format::{Props, SceneError};
use crate::material::{BaseTextures, Material, PrincipledTextures, ThinTextures};

/// What a `specular` of 0 stands for: without any step of the index there is no interface to refract at.
const SPECULAR_MIN: f64 = 1e-3;

impl<'a> Materials<'a> {
    pub(super) fn principled(&mut self, p: &Props<'a>) -> Result<Material, SceneError> {
        // Burley 2012, section 5.5: specular 0..1 spans a normal reflectance of 0..0.08.
        let eta = match p.opt_float("eta")? {
            Some(eta) => eta,
            None => {
                let specular = match p.float("specular")? {
                    0.0 => SPECULAR_MIN,
                    specular => specular,
                };
                2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0
            }
        };
        Ok(Material::Principled(Box::new(PrincipledTextures {
            base: self.principled_base(p)?,
            eta: eta as f32,
            metallic: self.scalar(p, "metallic")?,
            clearcoat: self.scalar(p, "clearcoat")?,
            clearcoat_gloss: self.scalar(p, "clearcoat_gloss")?,
            rates: rates(
                p,
                [
                    "main_specular_sampling_rate",
                    "clearcoat_sampling_rate",
                    "diffuse_reflectance_sampling_rate",
                ],
            )?,
        })))
    }

    pub(super) fn principled_thin(&mut self, p: &Props<'a>) -> Result<Material, SceneError> {
        Ok(Material::PrincipledThin(Box::new(ThinTextures {
            base: self.principled_base(p)?,
            eta: self.scalar(p, "eta")?,
            diff_trans: self.scalar(p, "diff_trans")?,
            rates: rates(
                p,
                [
                    "specular_reflectance_sampling_rate",
                    "specular_transmittance_sampling_rate",
                    "diffuse_reflectance_sampling_rate",
                    "diffuse_transmittance_sampling_rate",
                ],
            )?,
        })))
    }

    fn principled_base(&mut self, p: &Props<'a>) -> Result<BaseTextures, SceneError> {
        Ok(BaseTextures {
            color: self.reflectance(p, "base_color")?,
            roughness: self.scalar(p, "roughness")?,
            anisotropic: self.scalar(p, "anisotropic")?,
            spec_trans: self.scalar(p, "spec_trans")?,
            spec_tint: self.scalar(p, "spec_tint")?,
            sheen: self.scalar(p, "sheen")?,
            sheen_tint: self.scalar(p, "sheen_tint")?,
            flatness: self.scalar(p, "flatness")?,
        })
    }
}

fn rates<const N: usize>(p: &Props, names: [&str; N]) -> Result<[f32; N], SceneError> {
    let mut rates = [1.0; N];
    for (rate, name) in rates.iter_mut().zip(names) {
        *rate = p.float(name)? as f32;
    }
    Ok(rates)
}
