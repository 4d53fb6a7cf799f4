//! What is found in an image.

pub mod lines;
pub mod points;
