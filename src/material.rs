//! Materials: from a hit, by way of textures, to the numbers of a [`Bsdf`].

use crate::bsdf::{Bsdf, Conductor, Dielectric, Diffuse, Microfacet, RoughConductor, Shape};
use crate::geom::Hit;
use crate::math::Vec2;
use crate::texture::Texture;

/// How a surface scatters light, as a function of the place on it.
#[derive(Clone, Debug)]
pub enum Material {
    /// The same everywhere: nothing to look up.
    Uniform(Bsdf),
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
    /// What the material is at `hit`.
    #[inline]
    pub fn bsdf(&self, hit: &Hit) -> Bsdf {
        match self {
            Material::Uniform(bsdf) => *bsdf,
            Material::TwoSided { front, back } => {
                let side = if hit.wo.dot(hit.frame.n) < 0.0 {
                    back
                } else {
                    front
                };
                side.one_sided(hit.uv).two_sided()
            }
            one_sided => one_sided.one_sided(hit.uv),
        }
    }

    fn one_sided(&self, uv: Vec2) -> Bsdf {
        match self {
            Material::Uniform(bsdf) => *bsdf,
            Material::Diffuse { reflectance } => Bsdf::Diffuse(Diffuse::new(reflectance.eval(uv))),
            Material::Conductor(metal) => Bsdf::Conductor(metal.at(uv)),
            Material::RoughConductor { metal, roughness } => Bsdf::RoughConductor(RoughConductor {
                facets: roughness.at(uv),
                metal: metal.at(uv),
            }),
            Material::Dielectric {
                eta,
                reflectance,
                transmittance,
            } => Bsdf::Dielectric(Dielectric {
                reflectance: reflectance.eval(uv),
                transmittance: transmittance.eval(uv),
                ..Dielectric::new(*eta)
            }),
            Material::TwoSided { front, .. } => front.one_sided(uv),
        }
    }

    /// Whether the material scatters differently along the two tangents: roughness given for each.
    pub fn is_anisotropic(&self) -> bool {
        match self {
            Material::Uniform(Bsdf::RoughConductor(b)) => b.facets.alpha.x != b.facets.alpha.y,
            Material::RoughConductor { roughness, .. } => roughness.anisotropic,
            Material::TwoSided { front, back } => front.is_anisotropic() || back.is_anisotropic(),
            _ => false,
        }
    }

    /// The same material in its cheapest form: uniform where no texture varies and both sides agree.
    pub fn folded(self) -> Material {
        if let Material::TwoSided { front, back } = self {
            let (front, back) = (front.folded(), back.folded());
            return match (&front, &back) {
                (Material::Uniform(f), Material::Uniform(b)) if f == b => {
                    Material::Uniform(f.two_sided())
                }
                _ => Material::TwoSided {
                    front: Box::new(front),
                    back: Box::new(back),
                },
            };
        }
        match self.textures().iter().all(|t| t.as_constant().is_some()) {
            true => Material::Uniform(self.one_sided(Vec2::ZERO)),
            false => self,
        }
    }

    /// The textures of a one-sided material.
    fn textures(&self) -> Vec<&Texture> {
        match self {
            Material::Uniform(_) | Material::TwoSided { .. } => vec![],
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
        }
    }
}

impl Metal {
    fn at(&self, uv: Vec2) -> Conductor {
        Conductor {
            reflectance: self.reflectance.eval(uv),
            ..Conductor::new(self.eta.eval(uv), self.k.eval(uv))
        }
    }
}

impl Roughness {
    fn at(&self, uv: Vec2) -> Microfacet {
        let alpha = |t: &Texture| t.eval_scalar(uv);
        Microfacet {
            visible: self.visible,
            ..Microfacet::new(self.shape, alpha(&self.alpha_u), alpha(&self.alpha_v))
        }
    }
}
