//! Where a vehicle is by its turning LiDAR (the road thesis, sections 2 to 4).
//!
//! | room | what is in it |
//! |---|---|
//! | [`registration`] | how one cloud lies to another: ICP, point to plane, GICP, voxelised GICP |
//! | [`odometry`] | each scan onto a map of the last ones, or onto the one before |
//! | [`selection`] | which points take part: by ray, by the road's intensity, by the ground's shape |
//!
//! No ROS, no files, no clock, no randomness but what a seed gives.

pub mod odometry;
mod parallel;
pub mod registration;
pub mod selection;
#[cfg(test)]
mod testing;
