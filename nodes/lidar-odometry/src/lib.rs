//! Where a vehicle is by its turning LiDAR (the road thesis, sections 2 to 4).
//!
//! | room | what is in it |
//! |---|---|
//! | [`registration`] | how one cloud lies to another: ICP, point to plane, GICP, voxelised GICP |
//!
//! No ROS, no files, no clock, no randomness but what a seed gives.

mod parallel;
pub mod registration;
#[cfg(test)]
mod testing;
