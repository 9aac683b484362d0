//! Textures of the principled materials, and the numbers that come of them at a place.

use crate::bsdf::principled::Base;
use crate::bsdf::{Bsdf, Principled, PrincipledThin};
use crate::texture::{At, Texture};

/// Textures of what both principled materials have.
#[derive(Clone, Debug)]
pub struct BaseTextures {
    pub color: Texture,
    pub roughness: Texture,
    pub anisotropic: Texture,
    pub spec_trans: Texture,
    pub spec_tint: Texture,
    pub sheen: Texture,
    pub sheen_tint: Texture,
    pub flatness: Texture,
}

/// A principled surface whose numbers vary over it (see [`Principled`]).
#[derive(Clone, Debug)]
pub struct PrincipledTextures {
    pub base: BaseTextures,
    pub eta: f32,
    pub metallic: Texture,
    pub clearcoat: Texture,
    pub clearcoat_gloss: Texture,
    pub rates: [f32; 3],
}

/// A principled sheet whose numbers vary over it (see [`PrincipledThin`]).
#[derive(Clone, Debug)]
pub struct ThinTextures {
    pub base: BaseTextures,
    pub eta: Texture,
    pub diff_trans: Texture,
    pub rates: [f32; 4],
}

/// A share: pictures may hold more than 1, which the model makes no sense of.
fn share(texture: &Texture, at: &At) -> f32 {
    texture.eval_scalar(at).clamp(0.0, 1.0)
}

impl BaseTextures {
    fn at(&self, at: &At) -> Base {
        let color = self.color.eval(at).map(|v| v.clamp(0.0, 1.0));
        Base {
            spec_tint: share(&self.spec_tint, at),
            sheen: self.sheen.eval_scalar(at).max(0.0),
            sheen_tint: share(&self.sheen_tint, at),
            flatness: share(&self.flatness, at),
            ..Base::new(
                color,
                share(&self.roughness, at),
                share(&self.anisotropic, at),
            )
        }
    }

    fn textures(&self) -> [&Texture; 8] {
        [
            &self.color,
            &self.roughness,
            &self.anisotropic,
            &self.spec_trans,
            &self.spec_tint,
            &self.sheen,
            &self.sheen_tint,
            &self.flatness,
        ]
    }

    /// Whether the surface scatters differently along the two tangents.
    pub(super) fn is_anisotropic(&self) -> bool {
        !is_zero(&self.anisotropic)
    }

    /// Whether light passes through the clear part of the material.
    pub fn is_clear(&self) -> bool {
        !is_zero(&self.spec_trans)
    }
}

fn is_zero(texture: &Texture) -> bool {
    texture.as_constant().is_some_and(|c| c.is_black())
}

impl PrincipledTextures {
    pub(super) fn at(&self, at: &At) -> Bsdf {
        let bsdf = Principled {
            metallic: share(&self.metallic, at),
            spec_trans: share(&self.base.spec_trans, at),
            clearcoat: self.clearcoat.eval_scalar(at).max(0.0),
            clearcoat_gloss: share(&self.clearcoat_gloss, at),
            ..Principled::new(self.base.at(at), self.eta)
        };
        Bsdf::Principled(bsdf.with_rates(self.rates))
    }

    pub(super) fn textures(&self) -> Vec<&Texture> {
        let own = [&self.metallic, &self.clearcoat, &self.clearcoat_gloss];
        [&self.base.textures()[..], &own].concat()
    }
}

impl ThinTextures {
    pub(super) fn at(&self, at: &At) -> Bsdf {
        let eta = self.eta.eval_scalar(at).max(0.0);
        let bsdf = PrincipledThin {
            spec_trans: share(&self.base.spec_trans, at),
            diff_trans: self.diff_trans.eval_scalar(at).clamp(0.0, 2.0),
            ..PrincipledThin::new(self.base.at(at), eta)
        };
        Bsdf::PrincipledThin(bsdf.with_rates(self.rates))
    }

    pub(super) fn textures(&self) -> Vec<&Texture> {
        let own = [&self.eta, &self.diff_trans];
        [&self.base.textures()[..], &own].concat()
    }
}
