//! Textures and the pictures they show; an image is read once for all textures that show it.

use std::sync::Arc;

use glam::Affine2;

use super::Materials;
use crate::format::{FloatOrTexture, ObjectId, Props, RgbOrTexture, SceneError};
use crate::image_io::{self, Encoding, Pixels};
use crate::math::{DVec3, Rgb, Transform, Vec2};
use crate::texture::{Bitmap, Checkerboard, Interpolation, Picture, Texels, Texture, Wrap};

impl<'a> Materials<'a> {
    /// A reflectance or transmittance: what a picture has above 1 would make light out of nothing, on and
    /// on where it is enclosed.
    pub(super) fn reflectance(&mut self, p: &Props<'a>, name: &str) -> Result<Texture, SceneError> {
        let value = p.rgb_or_texture(name)?;
        Ok(match self.resolve(value)? {
            Texture::Constant(c) => Texture::Constant(c.map(|v| v.min(1.0))),
            Texture::Bitmap(mut bitmap) => {
                if let Texels::Floats(data) = &bitmap.texels.texels
                    && data.iter().flatten().any(|v| !(0.0..=1.0).contains(v))
                {
                    if data.iter().flatten().any(|v| *v > 1.0) {
                        let at = p.error_at(name, "values above 1 are cut to 1").at;
                        self.warnings.push(format!(
                            "{}:{}:{}: the picture has values above 1, which as \"{name}\" are cut to 1",
                            at.file.display(),
                            at.line,
                            at.column
                        ));
                    }
                    let cut = data.iter().map(|t| t.map(|v| v.clamp(0.0, 1.0))).collect();
                    bitmap.texels = Arc::new(Picture {
                        texels: Texels::Floats(cut),
                        ..*bitmap.texels
                    });
                }
                Texture::Bitmap(bitmap)
            }
            Texture::MeshAttribute(a) => Texture::MeshAttribute(self.share(p, name, a)),
            other => other,
        })
    }

    pub(super) fn scalar(&mut self, p: &Props<'a>, name: &str) -> Result<Texture, SceneError> {
        match p.float_or_texture(name)? {
            FloatOrTexture::Float(v) => Ok(Texture::Constant(Rgb::splat(v as f32))),
            FloatOrTexture::Texture(id) => {
                let texture = self.texture(id)?;
                self.check_scalar(id)?;
                // What a picture of one colour was folded to is still a picture's.
                Ok(match (texture, self.desc.object(id).plugin()) {
                    (Texture::Constant(c), "bitmap") => {
                        Texture::Constant(Rgb::splat(c.luminance()))
                    }
                    (texture, _) => texture,
                })
            }
        }
    }

    pub fn resolve(&mut self, value: RgbOrTexture) -> Result<Texture, SceneError> {
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
        if p.plugin() == "mesh_attribute" {
            return self.mesh_attribute(&p);
        }
        let to_uv = affine2(&p.transform("to_uv")?);
        let outer = std::mem::take(&mut self.per_shape);
        let texture = match p.plugin() {
            "checkerboard" => Texture::Checkerboard(Box::new(Checkerboard {
                color0: self.reflectance(&p, "color0")?,
                color1: self.reflectance(&p, "color1")?,
                to_uv,
            })),
            _ => self.bitmap(&p, to_uv)?,
        };
        let texture = texture.folded();
        if !self.per_shape {
            self.textures.insert(id, texture.clone());
        }
        self.per_shape |= outer;
        Ok(texture)
    }

    /// Width and height of the picture that a texture shows, also where it folded into one colour; 1 by 1 for
    /// any other texture. Of those that are compiled already.
    pub fn picture_size(&self, id: ObjectId) -> [u32; 2] {
        let p = self.desc.object(id);
        let key = match (p.plugin(), p.file("filename"), p.bool("raw")) {
            ("bitmap", Ok(file), Ok(raw)) => (file.to_path_buf(), raw),
            _ => return [1; 2],
        };
        let picture = self.pictures.get(&key);
        picture.map_or([1; 2], |picture| [picture.width, picture.height])
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
                    check_values(data, picture.width as usize, key.1)
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
/// lobes have a little of it, and no texture means it but one of raw numbers.
fn check_values(data: &mut [[f32; 3]], width: usize, raw: bool) -> Result<(), String> {
    for (i, value) in data.iter_mut().enumerate() {
        if !value.iter().all(|v| v.is_finite()) {
            return Err(format!(
                "pixel ({}, {}) is not a finite number",
                i % width,
                i / width
            ));
        }
        if !raw {
            *value = value.map(|v| v.max(0.0));
        }
    }
    Ok(())
}

/// The part of a transform that acts on the first two coordinates.
fn affine2(t: &Transform) -> Affine2 {
    let (x, y, o) = (t.vector(DVec3::X), t.vector(DVec3::Y), t.point(DVec3::ZERO));
    let flat = |v: DVec3| Vec2::new(v.x as f32, v.y as f32);
    Affine2::from_cols(flat(x), flat(y), flat(o))
}
