//! Light as it leaves the emitters: its densities against its samples, against what meets it from the other
//! end, and its power against closed forms.

#[path = "../common/mod.rs"]
mod common;
#[path = "../shapes/mod.rs"]
mod shapes;

mod agreement;
mod cells;
mod extremes;
mod received;
mod stages;
