//! Where a vehicle is by its turning LiDAR (the road thesis, sections 2 to 4).
//!
//! | room | what is in it |
//! |---|---|
//!
//! No ROS, no files, no clock, no randomness but what a seed gives.
