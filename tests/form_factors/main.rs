//! Form factors: the three methods against closed forms (numbers as in Howell's catalogue), against each other in
//! a room, and what must hold of any.

mod closed_forms;
mod rooms;
