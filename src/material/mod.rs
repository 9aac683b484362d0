//! Materials: from a hit, by way of textures, to the numbers of a [`Bsdf`].

mod dielectrics;
mod principled;
mod relief;
mod shading;

pub use dielectrics::{Coated, Glass};
pub use principled::{BaseTextures, PrincipledTextures, ThinTextures};
pub use relief::{Map, Relief};
pub use shading::Shading;

use relief::Smooth;
use shading::Bend;

use crate::bsdf::{Bsdf, Conductor, Diffuse, Microfacet, Null, RoughConductor, Shape};
use crate::geom::Hit;
use crate::math::fp::ONE_MINUS_EPSILON;
use crate::math::{Frame, Rgb, Vec3};
use crate::texture::{At, Texture};

/// How a surface scatters light, as a function of the place on it.
#[derive(Clone, Debug)]
pub enum Material {
    /// The same everywhere: nothing to look up.
    Uniform(Bsdf),
    /// The same everywhere and on both sides, each as if it were the front.
    UniformBothSides(Bsdf),
    Diffuse {
        reflectance: Texture,
    },
    Conductor(Metal),
    RoughConductor {
        metal: Metal,
        roughness: Roughness,
    },
    Dielectric(Glass),
    ThinDielectric(Glass),
    RoughDielectric {
        glass: Glass,
        roughness: Roughness,
    },
    /// Plastic, smooth or rough.
    Coated(Coated),
    /// `inside` where the texture (a share, 0 to 1) has the surface there; elsewhere light passes straight on.
    Mask {
        opacity: Texture,
        inside: Box<Material>,
    },
    /// A mixture: the second part with probability `weight` (0 to 1), else the first.
    Blend {
        weight: Texture,
        parts: Box<[Material; 2]>,
    },
    /// `inside` with a bump or normal map.
    Relief {
        relief: Box<Relief>,
        inside: Box<Material>,
    },
    Principled(Box<PrincipledTextures>),
    PrincipledThin(Box<ThinTextures>),
    /// One-sided materials for the front and the back, each as if its side were the front.
    TwoSided {
        front: Box<Material>,
        back: Box<Material>,
    },
}

/// Textures of a metal's index of refraction and reflectance factor.
#[derive(Clone, Debug)]
pub struct Metal {
    pub eta: Texture,
    pub k: Texture,
    pub reflectance: Texture,
}

/// Textures of a microfacet surface; roughness along the two tangents.
#[derive(Clone, Debug)]
pub struct Roughness {
    pub shape: Shape,
    pub alpha_u: Texture,
    pub alpha_v: Texture,
    /// Whether the two are given apart.
    pub anisotropic: bool,
    /// Sample visible normals rather than all.
    pub visible: bool,
}

impl Material {
    /// What the material is at `hit`. `u` in [0,1) decides where it is a mixture (see
    /// [`Material::is_mixed`]); `dp_duv` gives the tangents dp/du and dp/dv there, which reliefs ask for.
    #[inline]
    pub fn shade(&self, hit: &Hit, u: f32, dp_duv: impl Fn() -> (Vec3, Vec3)) -> Shading {
        match self {
            Material::Uniform(bsdf) => Shading::new(hit, hit.frame, *bsdf),
            Material::UniformBothSides(bsdf) => Shading::new(hit, facing(hit.frame, hit.wo), *bsdf),
            _ => self.shade_in(hit, hit.frame, u, &dp_duv),
        }
    }

    /// The same in a frame that may be turned to the back of the surface or bent by a relief.
    fn shade_in(
        &self,
        hit: &Hit,
        frame: Frame,
        u: f32,
        dp_duv: &impl Fn() -> (Vec3, Vec3),
    ) -> Shading {
        match self {
            Material::UniformBothSides(bsdf) => Shading::new(hit, facing(frame, hit.wo), *bsdf),
            Material::TwoSided { front, back } => {
                let side = if hit.wo.dot(frame.n) < 0.0 {
                    back
                } else {
                    front
                };
                side.shade_in(hit, facing(frame, hit.wo), u, dp_duv)
            }
            Material::Mask { opacity, inside } => {
                let opacity = opacity.eval_scalar(&at(hit)).clamp(0.0, 1.0);
                match split(u, opacity) {
                    (true, u) => inside.shade_in(hit, frame, u, dp_duv),
                    (false, _) => Shading::new(hit, frame, PASS),
                }
            }
            Material::Blend { weight, parts } => {
                let weight = weight.eval_scalar(&at(hit)).clamp(0.0, 1.0);
                let (second, u) = split(u, weight);
                parts[usize::from(second)].shade_in(hit, frame, u, dp_duv)
            }
            Material::Relief { relief, inside } => {
                let (dp_du, dp_dv) = dp_duv();
                // In the unturned frame, so that the back of a relief is the mirror image of its front.
                let smooth = Smooth {
                    dp_du: hit.frame.to_local(dp_du),
                    dp_dv: hit.frame.to_local(dp_dv),
                    ng: hit.frame.to_local(hit.ng),
                };
                let bent = relief.bend(&frame, frame.to_local(hit.wo), &smooth, &at(hit));
                let shading = inside.shade_in(hit, bent.frame, u, dp_duv);
                // What has two sides inside may have turned the bent frame around: the smooth one follows.
                let turned = shading.normal().dot(bent.frame.n) < 0.0;
                shading.bent(Some(Bend {
                    normal: if turned { -frame.n } else { frame.n },
                    alpha2: bent.alpha2,
                }))
            }
            plain => Shading::new(hit, frame, plain.bsdf(&at(hit))),
        }
    }

    /// Share of light that does not pass straight through at this place, in the mean over all chances.
    pub fn opacity(&self, at: &At) -> f32 {
        match self {
            Material::Uniform(Bsdf::Null(null)) => 1.0 - null.transmittance.luminance(),
            Material::Mask { opacity, inside } => {
                opacity.eval_scalar(at).clamp(0.0, 1.0) * inside.opacity(at)
            }
            Material::Blend { weight, parts } => {
                let weight = weight.eval_scalar(at).clamp(0.0, 1.0);
                (1.0 - weight) * parts[0].opacity(at) + weight * parts[1].opacity(at)
            }
            Material::Relief { inside, .. } => inside.opacity(at),
            _ => 1.0,
        }
    }

    /// Whether [`Material::opacity`] can be less than 1.
    pub fn lets_through(&self) -> bool {
        match self {
            Material::Uniform(Bsdf::Null(_)) | Material::Mask { .. } => true,
            Material::Blend { parts, .. } => parts.iter().any(Material::lets_through),
            Material::Relief { inside, .. } => inside.lets_through(),
            _ => false,
        }
    }

    /// Whether some part of the material has a lobe that is not a delta one.
    pub fn receives(&self) -> bool {
        match self {
            Material::Uniform(bsdf) | Material::UniformBothSides(bsdf) => !bsdf.is_delta(),
            Material::Conductor(_) | Material::Dielectric(_) | Material::ThinDielectric(_) => false,
            Material::TwoSided { front, back } => front.receives() || back.receives(),
            Material::Mask { inside, .. } | Material::Relief { inside, .. } => inside.receives(),
            Material::Blend { parts, .. } => parts.iter().any(Material::receives),
            _ => true,
        }
    }

    /// Whether some part of the material has a diffuse lobe that is not black.
    pub fn is_diffuse(&self) -> bool {
        match self {
            Material::Uniform(bsdf) | Material::UniformBothSides(bsdf) => {
                !bsdf.diffuse_albedo().is_black()
            }
            Material::TwoSided { front, back } => front.is_diffuse() || back.is_diffuse(),
            Material::Mask { inside, .. } | Material::Relief { inside, .. } => inside.is_diffuse(),
            Material::Blend { parts, .. } => parts.iter().any(Material::is_diffuse),
            Material::Diffuse { .. } | Material::Coated(_) => true,
            Material::Principled(_) | Material::PrincipledThin(_) => true,
            _ => false,
        }
    }

    /// Whether some part of the material has a lobe that is neither a delta nor a diffuse one.
    pub fn is_glossy(&self) -> bool {
        match self {
            Material::TwoSided { front, back } => front.is_glossy() || back.is_glossy(),
            Material::Mask { inside, .. } | Material::Relief { inside, .. } => inside.is_glossy(),
            Material::Blend { parts, .. } => parts.iter().any(Material::is_glossy),
            Material::Uniform(bsdf) | Material::UniformBothSides(bsdf) => bsdf.is_glossy(),
            plain => plain.bsdf(&At::default()).is_glossy(),
        }
    }

    /// Whether some part of the material has a delta lobe that reflects or refracts: it can throw a caustic.
    pub fn is_specular(&self) -> bool {
        match self {
            Material::Uniform(bsdf) | Material::UniformBothSides(bsdf) => bsdf.has_delta(),
            Material::Conductor(_) | Material::Dielectric(_) | Material::ThinDielectric(_) => true,
            Material::TwoSided { front, back } => front.is_specular() || back.is_specular(),
            Material::Mask { inside, .. } | Material::Relief { inside, .. } => inside.is_specular(),
            Material::Blend { parts, .. } => parts.iter().any(Material::is_specular),
            plain => plain.bsdf(&At::default()).has_delta(),
        }
    }

    /// The numbers of a material without structure of its own.
    fn bsdf(&self, at: &At) -> Bsdf {
        match self {
            Material::Uniform(bsdf) | Material::UniformBothSides(bsdf) => *bsdf,
            Material::Diffuse { reflectance } => Bsdf::Diffuse(Diffuse::new(reflectance.eval(at))),
            Material::Conductor(metal) => Bsdf::Conductor(metal.at(at)),
            Material::RoughConductor { metal, roughness } => Bsdf::RoughConductor(RoughConductor {
                facets: roughness.at(at),
                metal: metal.at(at),
            }),
            Material::Dielectric(glass) => Bsdf::Dielectric(glass.smooth(at)),
            Material::ThinDielectric(glass) => glass.thin(at),
            Material::RoughDielectric { glass, roughness } => glass.rough(roughness, at),
            Material::Coated(coated) => coated.at(at),
            Material::Principled(p) => p.at(at),
            Material::PrincipledThin(p) => p.at(at),
            Material::TwoSided { front: inside, .. }
            | Material::Mask { inside, .. }
            | Material::Relief { inside, .. } => inside.bsdf(at),
            Material::Blend { parts, .. } => parts[0].bsdf(at),
        }
    }

    /// Whether a principled material that light goes through is somewhere in the material.
    pub fn is_clear(&self) -> bool {
        match self {
            Material::Principled(m) => m.base.is_clear(),
            Material::TwoSided { front, back } => front.is_clear() || back.is_clear(),
            Material::Mask { inside, .. } | Material::Relief { inside, .. } => inside.is_clear(),
            Material::Blend { parts, .. } => parts.iter().any(Material::is_clear),
            _ => false,
        }
    }

    /// Whether a bump or normal map is somewhere in the material.
    pub fn has_relief(&self) -> bool {
        match self {
            Material::Relief { .. } => true,
            Material::TwoSided { front, back } => front.has_relief() || back.has_relief(),
            Material::Mask { inside, .. } => inside.has_relief(),
            Material::Blend { parts, .. } => parts.iter().any(Material::has_relief),
            _ => false,
        }
    }

    /// Whether a texture must be looked up at every hit.
    pub fn is_textured(&self) -> bool {
        let varies = |t: &Texture| t.as_constant().is_none();
        match self {
            Material::TwoSided { front, back } => front.is_textured() || back.is_textured(),
            Material::Mask { opacity, inside } => varies(opacity) || inside.is_textured(),
            Material::Blend { weight, parts } => {
                varies(weight) || parts.iter().any(Material::is_textured)
            }
            Material::Relief { .. } => true,
            plain => plain.textures().into_iter().any(varies),
        }
    }

    /// Whether chance decides what the material is at a hit.
    pub fn is_mixed(&self) -> bool {
        match self {
            Material::Mask { .. } | Material::Blend { .. } => true,
            Material::TwoSided { front, back } => front.is_mixed() || back.is_mixed(),
            Material::Relief { inside, .. } => inside.is_mixed(),
            _ => false,
        }
    }

    /// Whether the directions of the tangents matter: roughness given for each, or a relief.
    pub fn follows_tangents(&self) -> bool {
        match self {
            Material::Uniform(Bsdf::RoughConductor(b))
            | Material::UniformBothSides(Bsdf::RoughConductor(b)) => {
                b.facets.alpha.x != b.facets.alpha.y
            }
            Material::Uniform(Bsdf::RoughDielectric(b)) => b.facets.alpha.x != b.facets.alpha.y,
            Material::RoughConductor { roughness, .. }
            | Material::RoughDielectric { roughness, .. } => roughness.anisotropic,
            Material::TwoSided { front, back } => {
                front.follows_tangents() || back.follows_tangents()
            }
            Material::Mask { inside, .. } => inside.follows_tangents(),
            Material::Blend { parts, .. } => parts.iter().any(Material::follows_tangents),
            Material::Relief { .. } => true,
            Material::Uniform(Bsdf::Principled(b))
            | Material::UniformBothSides(Bsdf::Principled(b)) => b.base.is_anisotropic(),
            Material::Uniform(Bsdf::PrincipledThin(b)) => b.base.is_anisotropic(),
            Material::Principled(p) => p.base.is_anisotropic(),
            Material::PrincipledThin(p) => p.base.is_anisotropic(),
            _ => false,
        }
    }

    /// The same material in its cheapest form: uniform where no texture varies and both sides agree.
    pub fn folded(self) -> Material {
        let scalar = |t: &Texture| t.as_constant().map(|c| c.luminance().clamp(0.0, 1.0));
        match self {
            Material::UniformBothSides(_) => self,
            Material::TwoSided { front, back } => {
                let (front, back) = (front.folded(), back.folded());
                match (&front, &back) {
                    (Material::Uniform(f), Material::Uniform(b)) if f == b => {
                        Material::UniformBothSides(*f)
                    }
                    _ => Material::TwoSided {
                        front: Box::new(front),
                        back: Box::new(back),
                    },
                }
            }
            Material::Mask { opacity, inside } => match scalar(&opacity) {
                Some(0.0) => Material::Uniform(PASS),
                Some(1.0) => inside.folded(),
                _ => Material::Mask {
                    opacity,
                    inside: Box::new(inside.folded()),
                },
            },
            Material::Blend { weight, parts } => {
                let [first, second] = *parts;
                match scalar(&weight) {
                    Some(0.0) => first.folded(),
                    Some(1.0) => second.folded(),
                    _ => Material::Blend {
                        weight,
                        parts: Box::new([first.folded(), second.folded()]),
                    },
                }
            }
            Material::Relief { relief, inside } => {
                let inside = inside.folded();
                match relief.map.is_flat() {
                    true => inside,
                    false => Material::Relief {
                        relief,
                        inside: Box::new(inside),
                    },
                }
            }
            plain => match plain.is_textured() {
                true => plain,
                false => Material::Uniform(plain.bsdf(&At::default())),
            },
        }
    }

    /// The textures of a material without structure of its own.
    fn textures(&self) -> Vec<&Texture> {
        match self {
            Material::Uniform(_)
            | Material::UniformBothSides(_)
            | Material::TwoSided { .. }
            | Material::Mask { .. }
            | Material::Blend { .. }
            | Material::Relief { .. } => vec![],
            Material::Diffuse { reflectance } => vec![reflectance],
            Material::Conductor(m) => vec![&m.eta, &m.k, &m.reflectance],
            Material::RoughConductor {
                metal: m,
                roughness: r,
            } => {
                vec![&m.eta, &m.k, &m.reflectance, &r.alpha_u, &r.alpha_v]
            }
            Material::Dielectric(glass) | Material::ThinDielectric(glass) => glass.textures(),
            Material::RoughDielectric {
                glass,
                roughness: r,
            } => [glass.textures(), vec![&r.alpha_u, &r.alpha_v]].concat(),
            Material::Coated(coated) => coated.textures(),
            Material::Principled(p) => p.textures(),
            Material::PrincipledThin(p) => p.textures(),
        }
    }
}

/// The place of a hit, as textures see it.
pub fn at(hit: &Hit) -> At {
    At {
        uv: hit.uv,
        prim: hit.prim,
        bary: hit.bary,
    }
}

/// `frame`, its normal turned to the side of `wo`. The tangents stay, so that the back is the mirror image
/// of the front.
#[inline]
fn facing(mut frame: Frame, wo: Vec3) -> Frame {
    if wo.dot(frame.n) < 0.0 {
        frame.n = -frame.n;
    }
    frame
}

/// A boundary that is not there.
const PASS: Bsdf = Bsdf::Null(Null {
    transmittance: Rgb::WHITE,
});

/// Whether `u` in [0,1) falls to the choice of probability `prob`, and the number in [0,1) that is left of
/// it for further choices.
#[inline]
fn split(u: f32, prob: f32) -> (bool, f32) {
    let rest = if u < prob {
        u / prob
    } else {
        (u - prob) / (1.0 - prob)
    };
    (u < prob, rest.min(ONE_MINUS_EPSILON))
}

impl Metal {
    fn at(&self, at: &At) -> Conductor {
        Conductor {
            reflectance: self.reflectance.eval(at),
            ..Conductor::new(self.eta.eval(at), self.k.eval(at))
        }
    }
}

impl Roughness {
    fn at(&self, at: &At) -> Microfacet {
        let alpha = |t: &Texture| t.eval_scalar(at);
        Microfacet {
            visible: self.visible,
            ..Microfacet::new(self.shape, alpha(&self.alpha_u), alpha(&self.alpha_v))
        }
    }
}
