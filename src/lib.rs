//! luxel: light transport with a known error.
#![deny(unsafe_code)]

pub mod bsdf;
pub mod cli;
pub mod geom;
pub mod image_io;
pub mod math;
pub mod study;
