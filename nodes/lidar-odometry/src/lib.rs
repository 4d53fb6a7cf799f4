//! Where a vehicle is by its turning LiDAR (the road thesis, sections 2 to 4).
//!
//! | room | what is in it |
//! |---|---|
//! | [`registration`] | how one cloud lies to another: ICP, point to plane, GICP, voxelised GICP |
//! | [`odometry`] | each scan onto a map of the last ones, or onto the one before |
//!
//! No ROS, no files, no clock, no randomness but what a seed gives.

pub mod odometry;
mod parallel;
pub mod registration;
#[cfg(test)]
mod testing;
