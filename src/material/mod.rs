//! Materials: from a hit, by way of textures, to the numbers of a [`Bsdf`].

mod principled;
mod shading;

pub use principled::{BaseTextures, PrincipledTextures, ThinTextures};
pub use shading::Shading;

use crate::bsdf::{Bsdf, Conductor, Dielectric, Diffuse, Microfacet, RoughConductor, Shape};
use crate::geom::Hit;
use crate::math::Frame;
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
    Dielectric {
        eta: f32,
        reflectance: Texture,
        transmittance: Texture,
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
    /// [`Material::is_mixed`]).
    #[inline]
    pub fn shade(&self, hit: &Hit, u: f32) -> Shading {
        match self {
            Material::Uniform(bsdf) => Shading::new(hit, hit.frame, *bsdf),
            Material::UniformBothSides(bsdf) => Shading::new(hit, facing(hit), *bsdf),
            _ => self.shade_in(hit, hit.frame, u),
        }
    }

    /// The same in a frame that may be turned to the back of the surface.
    fn shade_in(&self, hit: &Hit, frame: Frame, u: f32) -> Shading {
        match self {
            Material::UniformBothSides(bsdf) => Shading::new(hit, facing(hit), *bsdf),
            Material::TwoSided { front, back } => {
                let side = if hit.wo.dot(hit.frame.n) < 0.0 {
                    back
                } else {
                    front
                };
                side.shade_in(hit, facing(hit), u)
            }
            plain => Shading::new(hit, frame, plain.bsdf(&at(hit))),
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
            Material::Dielectric {
                eta,
                reflectance,
                transmittance,
            } => Bsdf::Dielectric(Dielectric {
                reflectance: reflectance.eval(at),
                transmittance: transmittance.eval(at),
                ..Dielectric::new(*eta)
            }),
            Material::Principled(p) => p.at(at),
            Material::PrincipledThin(p) => p.at(at),
            Material::TwoSided { front, .. } => front.bsdf(at),
        }
    }

    /// Whether chance decides what the material is at a hit.
    pub fn is_mixed(&self) -> bool {
        match self {
            Material::TwoSided { front, back } => front.is_mixed() || back.is_mixed(),
            _ => false,
        }
    }

    /// Whether the material scatters differently along the two tangents: roughness given for each.
    pub fn is_anisotropic(&self) -> bool {
        match self {
            Material::Uniform(Bsdf::RoughConductor(b))
            | Material::UniformBothSides(Bsdf::RoughConductor(b)) => {
                b.facets.alpha.x != b.facets.alpha.y
            }
            Material::Uniform(Bsdf::Principled(b))
            | Material::UniformBothSides(Bsdf::Principled(b)) => b.base.is_anisotropic(),
            Material::Uniform(Bsdf::PrincipledThin(b)) => b.base.is_anisotropic(),
            Material::RoughConductor { roughness, .. } => roughness.anisotropic,
            Material::Principled(p) => p.base.is_anisotropic(),
            Material::PrincipledThin(p) => p.base.is_anisotropic(),
            Material::TwoSided { front, back } => front.is_anisotropic() || back.is_anisotropic(),
            _ => false,
        }
    }

    /// The same material in its cheapest form: uniform where no texture varies and both sides agree.
    pub fn folded(self) -> Material {
        if let Material::UniformBothSides(_) = self {
            return self;
        }
        if let Material::TwoSided { front, back } = self {
            let (front, back) = (front.folded(), back.folded());
            return match (&front, &back) {
                (Material::Uniform(f), Material::Uniform(b)) if f == b => {
                    Material::UniformBothSides(*f)
                }
                _ => Material::TwoSided {
                    front: Box::new(front),
                    back: Box::new(back),
                },
            };
        }
        match self.textures().iter().all(|t| t.as_constant().is_some()) {
            true => Material::Uniform(self.bsdf(&At::default())),
            false => self,
        }
    }

    /// The textures of a one-sided material.
    fn textures(&self) -> Vec<&Texture> {
        match self {
            Material::Uniform(_) | Material::UniformBothSides(_) | Material::TwoSided { .. } => {
                vec![]
            }
            Material::Diffuse { reflectance } => vec![reflectance],
            Material::Conductor(m) => vec![&m.eta, &m.k, &m.reflectance],
            Material::RoughConductor {
                metal: m,
                roughness: r,
            } => {
                vec![&m.eta, &m.k, &m.reflectance, &r.alpha_u, &r.alpha_v]
            }
            Material::Dielectric {
                reflectance,
                transmittance,
                ..
            } => vec![reflectance, transmittance],
            Material::Principled(p) => p.textures(),
            Material::PrincipledThin(p) => p.textures(),
        }
    }
}

/// The place of a hit, as textures see it.
fn at(hit: &Hit) -> At {
    At {
        uv: hit.uv,
        prim: hit.prim,
        bary: hit.bary,
    }
}

/// The frame of the hit, its normal turned to the side that is seen. The tangents stay, so that the back
/// is the mirror image of the front.
#[inline]
fn facing(hit: &Hit) -> Frame {
    let mut frame = hit.frame;
    if hit.wo.dot(frame.n) < 0.0 {
        frame.n = -frame.n;
    }
    frame
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
