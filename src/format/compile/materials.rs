//! Materials and textures; an object that many shapes refer to is compiled once, an image read once.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use glam::Affine2;

use crate::bsdf::{Bsdf, Diffuse, Shape, metals};
use crate::format::plugins::Category;
use crate::format::{FloatOrTexture, ObjectId, Props, RgbOrTexture, SceneDesc, SceneError};
use crate::image_io::{self, Encoding, Pixels};
use crate::material::{Material, Metal, Roughness};
use crate::math::{DVec3, Rgb, Transform, Vec2};
use crate::scene::{MaterialId, Plan};
use crate::texture::{Bitmap, Checkerboard, Interpolation, Picture, Texels, Texture, Wrap};

use super::suggest;

pub struct Materials<'a> {
    desc: &'a SceneDesc,
    materials: Vec<Material>,
    ids: HashMap<ObjectId, MaterialId>,
    /// The materials of shapes that name none: of those that reflect light, and of those that emit it.
    default: [Option<MaterialId>; 2],
    textures: HashMap<ObjectId, Texture>,
    pictures: HashMap<(PathBuf, bool), Arc<Picture>>,
    /// What was mended, for the user to know.
    warnings: Vec<String>,
}

impl<'a> Materials<'a> {
    pub fn new(desc: &'a SceneDesc) -> Materials<'a> {
        Materials {
            desc,
            materials: Vec::new(),
            ids: HashMap::new(),
            default: [None; 2],
            textures: HashMap::new(),
            pictures: HashMap::new(),
            warnings: Vec::new(),
        }
    }

    /// The materials by id; the plan says how many need a look-up.
    pub fn finish(self, plan: &mut Plan, warnings: &mut Vec<String>) -> Vec<Material> {
        warnings.extend(self.warnings);
        let varying = self
            .materials
            .iter()
            .filter(|m| !matches!(m, Material::Uniform(_)))
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
        let material = self.material(&props)?.folded();
        self.materials.push(material);
        let id = MaterialId(self.materials.len() as u32 - 1);
        self.ids.insert(props.object_id(), id);
        Ok(id)
    }

    fn material(&mut self, p: &Props<'a>) -> Result<Material, SceneError> {
        Ok(match p.plugin() {
            "twosided" => {
                let sides = p.children(Category::Bsdf);
                for side in &sides {
                    if matches!(side.plugin(), "dielectric" | "twosided") {
                        let what = format!("\"{}\" already has two sides", side.plugin());
                        return Err(side
                            .error(what)
                            .with_help("use it without \"twosided\" around it"));
                    }
                }
                let [Some(first), last] = [sides.first(), sides.last()] else {
                    return Err(p.error("\"twosided\" needs a material inside"));
                };
                let front = Box::new(self.material(first)?);
                let back = match last {
                    Some(last) if sides.len() == 2 => Box::new(self.material(last)?),
                    _ => front.clone(),
                };
                Material::TwoSided { front, back }
            }
            "conductor" => Material::Conductor(self.metal(p)?),
            "roughconductor" => {
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
                let (alpha_u, alpha_v) =
                    (along("alpha_u", "alpha_v")?, along("alpha_v", "alpha_u")?);
                let shape = match p.choice("distribution")? {
                    "ggx" => Shape::Ggx,
                    _ => Shape::Beckmann,
                };
                let roughness = Roughness {
                    shape,
                    anisotropic: p.is_given("alpha_u"),
                    alpha_u,
                    alpha_v,
                    visible: p.bool("sample_visible")?,
                };
                Material::RoughConductor {
                    metal: self.metal(p)?,
                    roughness,
                }
            }
            "dielectric" => {
                let (inside, outside) = (p.ior("int_ior")?, p.ior("ext_ior")?);
                Material::Dielectric {
                    eta: (inside / outside) as f32,
                    reflectance: self.reflectance(p, "specular_reflectance")?,
                    transmittance: self.reflectance(p, "specular_transmittance")?,
                }
            }
            _ => Material::Diffuse {
                reflectance: self.reflectance(p, "reflectance")?,
            },
        })
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

    /// A reflectance or transmittance: what a picture has above 1 would make light out of nothing, on and
    /// on where it is enclosed.
    fn reflectance(&mut self, p: &Props<'a>, name: &str) -> Result<Texture, SceneError> {
        let value = p.rgb_or_texture(name)?;
        Ok(match self.resolve(value)? {
            Texture::Constant(c) => Texture::Constant(c.map(|v| v.min(1.0))),
            Texture::Bitmap(mut bitmap) => {
                if let Texels::Floats(data) = &bitmap.texels.texels
                    && data.iter().flatten().any(|v| *v > 1.0)
                {
                    let at = p.error_at(name, "values above 1 are cut to 1").at;
                    self.warnings.push(format!(
                        "{}:{}:{}: the picture has values above 1, which as \"{name}\" are cut to 1",
                        at.file.display(),
                        at.line,
                        at.column
                    ));
                    let cut = data.iter().map(|t| t.map(|v| v.min(1.0))).collect();
                    bitmap.texels = Arc::new(Picture {
                        texels: Texels::Floats(cut),
                        ..*bitmap.texels
                    });
                }
                Texture::Bitmap(bitmap)
            }
            other => other,
        })
    }

    fn scalar(&mut self, p: &Props<'a>, name: &str) -> Result<Texture, SceneError> {
        match p.float_or_texture(name)? {
            FloatOrTexture::Float(v) => Ok(Texture::Constant(Rgb::splat(v as f32))),
            FloatOrTexture::Texture(id) => self.texture(id),
        }
    }

    fn resolve(&mut self, value: RgbOrTexture) -> Result<Texture, SceneError> {
        match value {
            RgbOrTexture::Rgb(c) => Ok(Texture::Constant(c)),
            RgbOrTexture::Texture(id) => self.texture(id),
        }
    }

    pub fn texture(&mut self, id: ObjectId) -> Result<Texture, SceneError> {
        if let Some(texture) = self.textures.get(&id) {
            return Ok(texture.clone());
        }
        let p = self.desc.object(id);
        let to_uv = affine2(&p.transform("to_uv")?);
        let texture = match p.plugin() {
            "checkerboard" => Texture::Checkerboard(Box::new(Checkerboard {
                color0: self.reflectance(&p, "color0")?,
                color1: self.reflectance(&p, "color1")?,
                to_uv,
            })),
            _ => self.bitmap(&p, to_uv)?,
        };
        let texture = texture.folded();
        self.textures.insert(id, texture.clone());
        Ok(texture)
    }

    fn bitmap(&mut self, p: &Props<'a>, to_uv: Affine2) -> Result<Texture, SceneError> {
        // The pixels keep the precision of the file.
        p.ignore(&["format"]);
        let key = (p.file("filename")?.to_path_buf(), p.bool("raw")?);
        let texels = match self.pictures.get(&key) {
            Some(picture) => Arc::clone(picture),
            None => {
                let read = image_io::Bitmap::read(&key.0);
                let mut picture = read
                    .map(|b| picture(b, key.1))
                    .map_err(|e| p.error_at("filename", e.to_string()))?;
                if let Texels::Floats(data) = &mut picture.texels {
                    check_values(data, picture.width as usize)
                        .map_err(|what| p.error_at("filename", what))?;
                }
                let picture = Arc::new(picture);
                self.pictures.insert(key, Arc::clone(&picture));
                picture
            }
        };
        let interpolation = match p.choice("filter_type")? {
            "nearest" => Interpolation::Nearest,
            _ => Interpolation::Bilinear,
        };
        let wrap = match p.choice("wrap_mode")? {
            "mirror" => Wrap::Mirror,
            "clamp" => Wrap::Clamp,
            _ => Wrap::Repeat,
        };
        Ok(Texture::Bitmap(Bitmap {
            texels,
            interpolation,
            wrap,
            to_uv,
        }))
    }

    /// The pixels of an environment map, linear.
    pub fn environment(&mut self, p: &Props) -> Result<Picture, SceneError> {
        let read = image_io::Bitmap::read(p.file("filename")?);
        read.map(|b| picture(b, false))
            .map_err(|e| p.error_at("filename", e.to_string()))
    }
}

/// Reflectance of a shape without a material, as in Mitsuba, unless it emits light: then it is black.
const DEFAULT_REFLECTANCE: f32 = 0.5;

/// The colours of a file, alpha left out, grey as three equal channels.
fn picture(bitmap: image_io::Bitmap, raw: bool) -> Picture {
    let n = bitmap.channels;
    let colors = if n >= 3 { [0, 1, 2] } else { [0; 3] };
    let srgb = bitmap.encoding == Encoding::Srgb && !raw;
    let texels = match &bitmap.pixels {
        Pixels::U8(v) => Texels::Bytes {
            data: v.chunks_exact(n).map(|p| colors.map(|c| p[c])).collect(),
            srgb,
        },
        Pixels::F32(v) => {
            let decode = |v: f32| {
                if srgb {
                    image_io::color::srgb_to_linear(v)
                } else {
                    v
                }
            };
            Texels::Floats(
                v.chunks_exact(n)
                    .map(|p| colors.map(|c| decode(p[c])))
                    .collect(),
            )
        }
    };
    Picture {
        width: bitmap.width as u32,
        height: bitmap.height as u32,
        texels,
    }
}

/// Refuses what is no number, and makes zero of what lies below: pictures that were filtered with negative
/// lobes have a little of it, and no texture means it.
fn check_values(data: &mut [[f32; 3]], width: usize) -> Result<(), String> {
    for (i, value) in data.iter_mut().enumerate() {
        if !value.iter().all(|v| v.is_finite()) {
            return Err(format!(
                "pixel ({}, {}) is not a finite number",
                i % width,
                i / width
            ));
        }
        *value = value.map(|v| v.max(0.0));
    }
    Ok(())
}

/// The part of a transform that acts on the first two coordinates.
fn affine2(t: &Transform) -> Affine2 {
    let (x, y, o) = (t.vector(DVec3::X), t.vector(DVec3::Y), t.point(DVec3::ZERO));
    let flat = |v: DVec3| Vec2::new(v.x as f32, v.y as f32);
    Affine2::from_cols(flat(x), flat(y), flat(o))
}
