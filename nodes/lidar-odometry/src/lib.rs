//! Where a vehicle is by its turning LiDAR (the road thesis, sections 2 to 4).
//!
//! | room | what is in it |
//! |---|---|
//! | [`drawing`] | the way that was driven, as a picture |
//! | [`packets`] | what a Velodyne sends, to what its lasers saw |
//! | [`panorama`] | a revolution as a picture of all around |
//! | [`recorded`] | clouds of KITTI, and of CSV files, organised anew |
//! | [`revolution`] | packets to organised clouds, one a turn; the motion of the vehicle taken out of them |
//! | [`road_map`] | the 3D map of a drive, coloured by what came back |
//! | [`selection`] | which points take part: by ray, by the road's intensity, by the ground's shape |
//! | [`registration`] | how one cloud lies to another: ICP, point to plane, GICP, voxelised GICP |
//! | [`loop_closing`] | places that are found again, and what the odometry has drifted by since |
//! | [`odometry`] | each scan onto a map of the last ones, or onto the one before |
//! | `capture` | the datagrams of a pcap or pcapng file (feature `io`) |
//! | `live` | the datagrams of a scanner as they arrive (feature `io`) |
//! | `shell` | the node (feature `ros`) |
//!
//! Without the features `io` and `ros`: no ROS, no files, no clock, no randomness but what a seed gives.

#[cfg(feature = "io")]
pub mod capture;
pub mod drawing;
#[cfg(feature = "io")]
pub mod live;
pub mod loop_closing;
pub mod odometry;
pub mod packets;
pub mod panorama;
mod parallel;
pub mod recorded;
pub mod registration;
pub mod revolution;
pub mod road_map;
pub mod selection;
#[cfg(feature = "ros")]
pub mod shell;
#[cfg(test)]
mod testing;
