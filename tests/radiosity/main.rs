//! Radiosity on flat meshes: solvers against closed forms and each other, surfaces against what rays meet, and
//! scenes that are not meant well.

#[path = "../common/render.rs"]
mod render;

mod external;
mod extremes;
mod masks;
mod rooms;
mod sizes;
mod solvers;
mod stopping;
mod surfaces;
