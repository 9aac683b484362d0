//! The commands of the program `luxel`.

pub mod compare;
