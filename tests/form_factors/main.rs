//! Form factors: the three methods against closed forms (numbers as in Howell's catalogue), against each other in
//! a room, and what must hold of any.

#[path = "../common/mod.rs"]
mod common;

mod closed_forms;
mod extremes;
mod identities;
mod rates;
mod rooms;
mod sight;
