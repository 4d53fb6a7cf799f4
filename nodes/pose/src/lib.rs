//! Where an RGB-D camera is, from the points and the line segments that it sees (PL-SLAM, sections 2.1 to 2.3).
//!
//! | room | what is in it |
//! |---|---|
//! | [`image`] | gray images, pyramids, gradients, rectification |
//! | [`feature`] | corners with descriptors, line segments with descriptors |
//! | [`matching`] | which feature of one image is which of another |
//! | [`motion`] | where the camera will be, by its motion so far, a gyroscope or wheels |
//! | [`solve`] | the pose that explains matches, how sure it is, and what it cannot say |
//!
//! No ROS, no files, no clock, no randomness but what a seed gives.

pub mod feature;
pub mod image;
pub mod matching;
pub mod motion;
pub mod solve;
#[cfg(test)]
mod testing;
