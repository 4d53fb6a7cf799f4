//! Which feature of one image is which of another.

pub mod points;
