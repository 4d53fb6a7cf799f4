//! The features of an image.

pub mod lines;
pub mod points;
