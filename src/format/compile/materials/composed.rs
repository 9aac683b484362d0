//! Materials made of materials: masks, mixtures and reliefs.

use super::Materials;
use crate::format::plugins::Category;
use crate::format::{Props, SceneError};
use crate::material::{Map, Material, Relief};
use crate::texture::Texture;

/// Materials that transmit light: both sides are their own.
const TRANSMITTING: &[&str] = &[
    "dielectric",
    "roughdielectric",
    "thindielectric",
    "principledthin",
    "mask",
    "null",
    "twosided",
];

/// Refuses what "twosided" cannot give two sides, however deep it stands.
pub fn check_one_sided(side: &Props) -> Result<(), SceneError> {
    if TRANSMITTING.contains(&side.plugin()) {
        let what = format!("\"{}\" already has two sides", side.plugin());
        return Err(side
            .error(what)
            .with_help("use it without \"twosided\" around it"));
    }
    side.children(Category::Bsdf)
        .iter()
        .try_for_each(check_one_sided)
}

impl<'a> Materials<'a> {
    pub(super) fn composed(&mut self, p: &Props<'a>) -> Result<Material, SceneError> {
        let parts = p.children(Category::Bsdf);
        let mut part = |i: usize| match parts.get(i) {
            Some(part) => self.material(part),
            None => Err(p.error("a material is missing inside")),
        };
        match p.plugin() {
            "blendbsdf" => {
                let parts = Box::new([part(0)?, part(1)?]);
                let weight = self.scalar(p, "weight")?;
                Ok(Material::Blend { weight, parts })
            }
            "mask" => {
                let inside = Box::new(part(0)?);
                let opacity = self.scalar(p, "opacity")?;
                Ok(Material::Mask { opacity, inside })
            }
            _ => {
                let inside = part(0)?;
                if inside.has_relief() {
                    let error = p.error("a bump or normal map within another is not supported");
                    return Err(error.with_help("combine the two maps into one image"));
                }
                let relief = Relief {
                    map: self.map(p)?,
                    flip_invalid: p.bool("flip_invalid_normals")?,
                    shadowing: p.bool("use_shadowing_function")?,
                };
                Ok(Material::Relief {
                    relief: Box::new(relief),
                    inside: Box::new(inside),
                })
            }
        }
    }

    fn map(&mut self, p: &Props<'a>) -> Result<Map, SceneError> {
        if p.plugin() == "normalmap" {
            let value = p.rgb_or_texture("normalmap")?;
            return Ok(Map::Normal(self.resolve(value)?));
        }
        let scale = p.float("scale")? as f32;
        let Some(child) = p.child(Category::Texture) else {
            return Err(p.error("a bump map needs a texture inside"));
        };
        let heights = self.texture(child.object_id())?;
        match heights {
            Texture::Bitmap(_) | Texture::Constant(_) => Ok(Map::Bump { heights, scale }),
            _ => {
                let what = format!("the texture \"{}\" has no slopes", child.plugin());
                Err(child
                    .error(what)
                    .with_help("use a bitmap with bilinear interpolation"))
            }
        }
    }
}
