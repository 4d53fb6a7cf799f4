//! Finds the dynamic zones of a 2D laser scan by the variability of its ranges, and reduces the cloud
//! (Rec-HV 3.2.1 to 3.2.3, 3.3.2).
//!
//! | module | step | source |
//! |---|---|---|
//! | [`matching`] | a scan, a cloud and a pose become one cycle | 3.3.1 |
//! | [`aperture`] | the beams of the forward 90 degrees, in the rig frame | 3.2.1, eq. 1 |
//! | [`gap_fill`] | a range for every beam | 3.2.1.1, 3.3.2.1 |
//! | [`variability`] | mean and deviation of each beam over n scans | 3.2.1.2, eq. 2 to 4 |
//! | [`zone_finder`] | the angles that bound the moving object | 3.2.2, 3.3.2.2, eq. 5 |
//! | [`free_space`] | in place of the last three: returns in observed free space | ours |
//! | [`detector`] | all of them in turn, and the voxel grid of the cloud | 3.2.3 |
//!
//! This crate without its feature `ros` is the core: it uses no ROS, no clock and no file.
//!
//! ```
//! use detection::variability::VariabilityWindow;
//!
//! // Three scans of three beams; in the last one an object is in front of the wall that the middle beam hit.
//! let mut window = VariabilityWindow::new(3);
//! for ranges_m in [vec![3.0, 3.0, 3.0], vec![3.0, 3.0, 3.0], vec![3.0, 1.5, 3.0]] {
//!     window.push(ranges_m);
//! }
//! let std_dev_m = window.statistics().unwrap().std_dev_m;
//! assert!(std_dev_m[1] > 0.7 && std_dev_m[0] == 0.0 && std_dev_m[2] == 0.0);
//! ```

pub mod aperture;
pub mod colour_images;
pub mod config;
pub mod detector;
pub mod free_space;
pub mod gap_fill;
pub mod matching;
#[cfg(feature = "ros")]
pub mod shell;
pub mod variability;
pub mod zone_finder;

pub use config::{DetectionConfig, FreeSpaceConfig, RecHvConfig, RunBound};
pub use detector::{CycleInput, CycleStatistics, Detected, DetectionError, Detector, Step, View};
pub use free_space::PoseJump;
pub use matching::{DropCause, Dropped, Input, MatchEvent, Matched, Matcher};
pub use zone_finder::Unmeasured;
