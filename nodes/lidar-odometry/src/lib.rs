//! Where a vehicle is by its turning LiDAR (the road thesis, sections 2 to 4).
//!
//! | room | what is in it |
//! |---|---|
//! | [`packets`] | what a Velodyne sends, to what its lasers saw |
//! | [`revolution`] | packets to organised clouds, one a turn; the motion of the vehicle taken out of them |
//!
//! No ROS, no files, no clock, no randomness but what a seed gives.

pub mod packets;
pub mod revolution;
