//! Materials and textures; an object that many shapes refer to is compiled once, an image read once.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use crate::bsdf::{Bsdf, Diffuse, Null, Shape, metals};
use crate::format::plugins::Category;
use crate::format::{ObjectId, Props, SceneDesc, SceneError};
use crate::material::{Material, Metal, Roughness};
use crate::math::Rgb;
use crate::scene::{MaterialId, Plan};
use crate::texture::{Picture, Texture};

use super::attributes::Attributes;
use super::suggest;

mod attribute;
mod composed;
mod dielectrics;
mod principled;
mod textures;

pub struct Materials<'a> {
    desc: &'a SceneDesc,
    materials: Vec<Material>,
    ids: HashMap<ObjectId, MaterialId>,
    /// The materials of shapes that name none: of those that reflect light, and of those that emit it.
    default: [Option<MaterialId>; 2],
    textures: HashMap<ObjectId, Texture>,
    pictures: HashMap<(PathBuf, bool), Arc<Picture>>,
    attributes: Attributes,
    /// The shape whose material or emitter is being compiled.
    shape: Option<ObjectId>,
    /// Whether what was compiled depends on that shape, so that no other may share it.
    per_shape: bool,
    /// What was mended, for the user to know.
    warnings: Vec<String>,
}

impl<'a> Materials<'a> {
    pub fn new(desc: &'a SceneDesc, attributes: Attributes) -> Materials<'a> {
        Materials {
            desc,
            materials: Vec::new(),
            ids: HashMap::new(),
            default: [None; 2],
            textures: HashMap::new(),
            pictures: HashMap::new(),
            attributes,
            shape: None,
            per_shape: false,
            warnings: Vec::new(),
        }
    }

    /// The materials by id; the plan says how many need a look-up.
    pub fn finish(self, plan: &mut Plan, warnings: &mut Vec<String>) -> Vec<Material> {
        warnings.extend(self.warnings);
        let varying = self
            .materials
            .iter()
            .filter(|m| !matches!(m, Material::Uniform(_) | Material::UniformBothSides(_)))
            .count();
        if varying == 0 {
            plan.add(
                "textures",
                "none: every material is a set of numbers",
                "no texture varies",
            );
        } else {
            let reason = format!(
                "{varying} of {} materials vary over their surface",
                self.materials.len()
            );
            plan.add(
                "textures",
                "looked up at every hit on these materials",
                reason,
            );
        }
        self.materials
    }

    /// Says whose material or emitter is compiled next.
    pub fn enter(&mut self, shape: Option<&Props>) {
        self.shape = shape.map(|s| s.object_id());
        self.per_shape = false;
    }

    pub fn of_shape(&mut self, shape: &Props<'a>) -> Result<MaterialId, SceneError> {
        let Some(props) = shape.child(Category::Bsdf) else {
            let emits = !shape.children(Category::Emitter).is_empty();
            let id = self.default[usize::from(emits)].get_or_insert_with(|| {
                let albedo = if emits { 0.0 } else { DEFAULT_REFLECTANCE };
                let diffuse = Bsdf::Diffuse(Diffuse::new(Rgb::splat(albedo)));
                self.materials.push(Material::Uniform(diffuse));
                MaterialId(self.materials.len() as u32 - 1)
            });
            return Ok(*id);
        };
        if let Some(id) = self.ids.get(&props.object_id()) {
            return Ok(*id);
        }
        self.enter(Some(shape));
        let material = self.material(&props)?.folded();
        self.materials.push(material);
        let id = MaterialId(self.materials.len() as u32 - 1);
        if !self.per_shape {
            self.ids.insert(props.object_id(), id);
        }
        Ok(id)
    }

    pub(super) fn material(&mut self, p: &Props<'a>) -> Result<Material, SceneError> {
        Ok(match p.plugin() {
            "twosided" => {
                let sides = p.children(Category::Bsdf);
                for side in &sides {
                    composed::check_one_sided(side)?;
                }
                let [Some(first), last] = [sides.first(), sides.last()] else {
                    return Err(p.error("\"twosided\" needs a material inside"));
                };
                let front = Box::new(self.one_sided(first)?);
                let back = match last {
                    Some(last) if sides.len() == 2 => Box::new(self.one_sided(last)?),
                    _ => front.clone(),
                };
                Material::TwoSided { front, back }
            }
            "mask" | "blendbsdf" | "bumpmap" | "normalmap" => self.composed(p)?,
            "conductor" => Material::Conductor(self.metal(p)?),
            "roughconductor" => Material::RoughConductor {
                roughness: self.roughness(p)?,
                metal: self.metal(p)?,
            },
            "dielectric" => Material::Dielectric(self.glass(p)?),
            "thindielectric" => Material::ThinDielectric(self.glass(p)?),
            "roughdielectric" => Material::RoughDielectric {
                roughness: self.roughness(p)?,
                glass: self.glass(p)?,
            },
            "plastic" => self.plastic(p)?,
            "roughplastic" => self.rough_plastic(p)?,
            "null" => Material::Uniform(Bsdf::Null(Null {
                transmittance: Rgb::WHITE,
            })),
            "principled" => self.principled(p)?,
            "principledthin" => self.principled_thin(p)?,
            _ => Material::Diffuse {
                reflectance: self.reflectance(p, "reflectance")?,
            },
        })
    }

    fn roughness(&mut self, p: &Props<'a>) -> Result<Roughness, SceneError> {
        let alpha = self.scalar(p, "alpha")?;
        let mut along = |name: &str, other: &str| -> Result<Texture, SceneError> {
            match (p.is_given(name), p.is_given(other)) {
                (false, false) => Ok(alpha.clone()),
                (true, true) => self.scalar(p, name),
                _ => {
                    let error = p.error("alpha_u and alpha_v come together");
                    Err(error.with_help("give both, or alpha alone"))
                }
            }
        };
        Ok(Roughness {
            shape: roughness_shape(p)?,
            alpha_u: along("alpha_u", "alpha_v")?,
            alpha_v: along("alpha_v", "alpha_u")?,
            anisotropic: p.is_given("alpha_u"),
            visible: p.bool("sample_visible")?,
        })
    }

    /// A material for one side of a surface: nothing goes through it.
    fn one_sided(&mut self, p: &Props<'a>) -> Result<Material, SceneError> {
        let material = self.material(p)?;
        match material.is_clear() {
            true => {
                let error = p.error_at(
                    "spec_trans",
                    "what light goes through already has two sides",
                );
                Err(error.with_help("leave out spec_trans, or \"twosided\" around the material"))
            }
            false => Ok(material),
        }
    }

    fn metal(&mut self, p: &Props<'a>) -> Result<Metal, SceneError> {
        let name = p.string("material")?;
        let known = metals::lookup(name).ok_or_else(|| {
            p.error_at("material", format!("no metal \"{name}\" is known"))
                .with_help(suggest(name, metals::names().collect::<Vec<_>>()))
        });
        let mut given = |name: &str, known: Rgb| -> Result<Texture, SceneError> {
            match p.opt_rgb_or_texture(name)? {
                Some(value) => self.resolve(value),
                None => Ok(Texture::Constant(known)),
            }
        };
        let (eta, k) = known?;
        Ok(Metal {
            eta: given("eta", eta)?,
            k: given("k", k)?,
            reflectance: self.reflectance(p, "specular_reflectance")?,
        })
    }
}

fn roughness_shape(p: &Props) -> Result<Shape, SceneError> {
    Ok(match p.choice("distribution")? {
        "ggx" => Shape::Ggx,
        _ => Shape::Beckmann,
    })
}

/// Reflectance of a shape without a material, as in Mitsuba, unless it emits light: then it is black.
const DEFAULT_REFLECTANCE: f32 = 0.5;
