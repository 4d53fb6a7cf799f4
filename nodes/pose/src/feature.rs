//! What is found in an image.

pub mod points;
