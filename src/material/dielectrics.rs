//! Materials made of transparent matter: their textures, and the BSDF these give at a place.

use super::Roughness;
use crate::bsdf::{
    Base, Bsdf, Coat, Dielectric, Microfacet, Plastic, RoughDielectric, RoughPlastic,
    ThinDielectric,
};
use crate::texture::{At, Texture};

/// A boundary between two transparent media.
#[derive(Clone, Debug)]
pub struct Glass {
    /// Index of refraction inside over that outside.
    pub eta: f32,
    /// Factors on what is reflected and on what passes.
    pub reflectance: Texture,
    pub transmittance: Texture,
}

impl Glass {
    pub(super) fn smooth(&self, at: &At) -> Dielectric {
        Dielectric {
            eta: self.eta,
            reflectance: self.reflectance.eval(at),
            transmittance: self.transmittance.eval(at),
        }
    }

    pub(super) fn thin(&self, at: &At) -> Bsdf {
        Bsdf::ThinDielectric(ThinDielectric {
            eta: self.eta,
            reflectance: self.reflectance.eval(at),
            transmittance: self.transmittance.eval(at),
        })
    }

    /// Equal indices leave no boundary, however rough.
    pub(super) fn rough(&self, roughness: &Roughness, at: &At) -> Bsdf {
        match self.eta == 1.0 {
            true => Bsdf::Dielectric(self.smooth(at)),
            false => Bsdf::RoughDielectric(RoughDielectric {
                facets: roughness.at(at),
                surface: self.smooth(at),
            }),
        }
    }

    pub(super) fn textures(&self) -> Vec<&Texture> {
        vec![&self.reflectance, &self.transmittance]
    }
}

/// A diffuse base under a clear boundary.
#[derive(Clone, Debug)]
pub struct Coated {
    /// Index of refraction inside over that outside.
    pub eta: f32,
    /// What the boundary does with the light from the base.
    pub base: Base,
    /// The facets of the boundary and what passes them; `None`: it is smooth.
    pub rough: Option<(Microfacet, &'static Coat)>,
    /// Albedo of the base, and factor on what the boundary reflects.
    pub diffuse: Texture,
    pub reflectance: Texture,
}

impl Coated {
    pub(super) fn at(&self, at: &At) -> Bsdf {
        let (diffuse, reflectance) = (self.diffuse.eval(at), self.reflectance.eval(at));
        match self.rough {
            None => Bsdf::Plastic(Plastic::new(self.eta, &self.base, diffuse, reflectance)),
            Some((facets, coat)) => Bsdf::RoughPlastic(RoughPlastic::new(
                facets,
                self.eta,
                coat,
                &self.base,
                diffuse,
                reflectance,
            )),
        }
    }

    pub(super) fn textures(&self) -> Vec<&Texture> {
        vec![&self.diffuse, &self.reflectance]
    }
}
