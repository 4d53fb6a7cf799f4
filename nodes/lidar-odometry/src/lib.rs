//! Where a vehicle is by its turning LiDAR (the road thesis, sections 2 to 4).
//!
//! | module | contents |
//! |---|---|
//! | [`drawing`] | the trajectory, as a picture |
//! | [`packets`] | from the packets of a Velodyne to the returns of its lasers |
//! | [`panorama`] | a revolution as a panoramic picture |
//! | [`recorded`] | clouds of KITTI, and of CSV files, organised again |
//! | [`revolution`] | packets to organised clouds, one a turn; the motion of the vehicle taken out of them |
//! | [`road_map`] | the 3D map of a drive, coloured by the returns |
//! | [`selection`] | which points take part: by ray, by the road's intensity, by the ground's shape |
//! | `registration` | a crate of its own: the pose of one cloud relative to another: ICP, point to plane, GICP, voxelised GICP |
//! | [`loop_closing`] | places that are found again, and what the odometry has drifted by since |
//! | [`odometry`] | each scan onto a map of the last ones, or onto the one before |
//! | `capture` | the datagrams of a pcap or pcapng file (feature `io`) |
//! | `live` | the datagrams of a scanner as they arrive (feature `io`) |
//! | `shell` | the node (feature `ros`) |
//!
//! Without the features `io` and `ros`: no ROS, no files, no clock, no randomness but what a seed gives.
//!
//! ```
//! use std::sync::Arc;
//!
//! use estimation::Serial;
//! use geometry::Stamp;
//! use lidar_odometry::odometry::{LidarOdometry, LidarOdometryConfig, LidarScan};
//! use nalgebra::{Isometry3, Point3};
//!
//! // Floor and walls of a room of 20 m, from a vehicle that goes 0.2 m between two scans.
//! let grid = || (0..60).flat_map(|a| (0..60).map(move |b| (a as f32 / 3.0 - 10.0, b as f32 / 3.0 - 10.0)));
//! let room: Vec<Point3<f32>> = grid()
//!     .flat_map(|(a, b)| [Point3::new(a, b, -1.0), Point3::new(-10.0, a, b / 3.0), Point3::new(a, 10.0, b / 3.0)])
//!     .collect();
//! let mut odometry = LidarOdometry::new(LidarOdometryConfig::default(), Arc::new(Serial))?;
//! let mut x_m = 0.0;
//! for scan in 0..10_u32 {
//!     let lidar_from_room = Isometry3::translation(-0.2 * scan as f32, 0.0, 0.0);
//!     let points_m: Vec<_> = room.iter().map(|point_m| lidar_from_room * point_m).collect();
//!     let stamp = Stamp::from_secs_nanos(100, 100_000_000 * scan);
//!     let pose = odometry.step(&LidarScan { stamp, points_m: &points_m, times_s: None }).unwrap();
//!     x_m = pose.odom_from_lidar.translation.x;
//! }
//! assert!((x_m - 1.8).abs() < 0.05, "{x_m}");
//! # Ok::<(), geometry::ParameterError>(())
//! ```

#[cfg(feature = "io")]
pub mod capture;
pub mod drawing;
#[cfg(feature = "io")]
pub mod live;
pub mod loop_closing;
pub mod odometry;
pub mod packets;
pub mod panorama;
pub mod recorded;
pub mod revolution;
pub mod road_map;
pub mod selection;
#[cfg(feature = "ros")]
pub mod shell;

pub use ::registration;
#[cfg(test)]
use ::registration::testing;
