//! Which feature of one image is which of another.

pub mod lines;
pub mod points;
