//! Where a platform is by the scans of its 2D scanner alone: planar odometry for rigs and recordings without any pose.
//!
//! Each scan is registered to a map of short lines of the scans before it, so that a static platform does
//! not drift and a moving one drifts only as fast as the map is renewed.
//!
//! | module | step | source |
//! |---|---|---|
//! | `scan_returns` | the returns of a scan beyond the platform itself, each with when and how well it was measured; deskewed by the velocity | |
//! | `local_line` | a line through the neighbours of each return on the same surface | |
//! | `local_map` | the lines seen so far, refined by each scan, bounded | |
//! | `registration` | the pose that registers the returns to the lines: point to line, reweighted Gauss-Newton | Censi 2008 (PL-ICP); Chen and Medioni 1992 |
//! | `observability` | which directions the lines determine; the others keep the prediction | Zhang, Kaess and Singh 2016 |
//! | `velocity` | how fast the platform is, and how well that is known: the prediction | |
//! | `search` | a coarse search where the prediction finds no match | Olson 2009 |
//! | `uncertainty` | the covariance of a step, and of the pose since the start | |
//! | `odometry` | all of them in turn | |
//!
//! # Frames
//!
//! | name | origin and axes |
//! |---|---|
//! | `odom` | the scanner's frame at the stamp of the first scan that was taken |
//! | `lidar` | the scan's own frame at the stamp of the scan |
//! | `middle` | the same in the middle of the turn |
//!
//! All are planar, x and y of the scan's frame. No ROS, no files, no clock.
//!
//! ```
//! use scan_odometry::{ScanOdometry, ScanOdometryConfig};
//! use simulator::{Sample, Scenario};
//!
//! // The scans of the simulated demo, whose rig is at rest.
//! let mut odometry = ScanOdometry::new(ScanOdometryConfig::default())?;
//! let samples = Scenario::demo().with_depth_size(32, 24).with_duration_s(3.0).samples().unwrap();
//! for sample in samples {
//!     if let Sample::Scan { scan, .. } = sample {
//!         let pose = odometry.step(&scan);
//!         assert!(pose.odom_from_lidar.translation.vector.norm() < 0.02);
//!     }
//! }
//! # Ok::<(), geometry::ParameterError>(())
//! ```

mod config;
mod local_line;
mod local_map;
mod observability;
mod odometry;
mod registration;
mod scan_pose;
mod scan_returns;
mod search;
#[cfg(test)]
mod testing;
mod twist;
mod uncertainty;
mod velocity;

pub use config::ScanOdometryConfig;
pub use odometry::ScanOdometry;
pub use scan_pose::{DegenerateDirection, MatchOutcome, MatchQuality, Refusal, ScanPose};
