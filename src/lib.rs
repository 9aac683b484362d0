//! luxel: light transport with a known error.
#![deny(unsafe_code)]

pub mod bsdf;
pub mod film;
pub mod format;
pub mod geom;
pub mod image_io;
pub mod light;
pub mod math;
pub mod sampler;
pub mod study;
