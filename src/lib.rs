//! luxel: light transport with a known error.
#![deny(unsafe_code)]

pub mod bsdf;
pub mod cli;
pub mod film;
pub mod format;
pub mod geom;
pub mod image_io;
pub mod light;
pub mod material;
pub mod math;
pub mod radiosity;
pub mod render;
pub mod sampler;
pub mod scene;
pub mod study;
pub mod texture;
pub mod transport;
