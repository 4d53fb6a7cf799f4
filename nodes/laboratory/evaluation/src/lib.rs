//! Scores against ground truth, of runs, maps, detection and trajectories. [`score_dynamic`] measures how much of each
//! moving object a run removed and how much static scene it lost; [`trajectory`] compares an estimate with a reference.
//!
//! No ROS, no files, no clock: the same input gives the same figures.
//!
//! ```
//! use evaluation::ReducedClouds;
//! use nalgebra::Point3;
//!
//! // In the map one point of the reference is missing, and another is off by 1 cm.
//! let reference_m = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]].map(Point3::from);
//! let map_m = [[0.0, 0.0, 0.0], [1.01, 0.0, 0.0]].map(Point3::from);
//! let distance = ReducedClouds::of(&reference_m, &map_m, 0.05)?.distance(0.05)?;
//! assert_eq!(distance.precision, 1.0);
//! assert!((distance.accuracy_m - 0.005).abs() < 1e-6);
//! # Ok::<(), evaluation::CloudDistanceError>(())
//! ```

mod cloud_distance;
mod correlation;
mod dynamic_score;
mod identity;
mod scan_zones;
#[cfg(test)]
mod score_on_page;
#[cfg(test)]
mod testing;
pub mod trajectory;
mod truth;

pub use cloud_distance::{CloudDistanceError, ReducedClouds};
pub use correlation::{Correlation, CorrelationError, LocalisedView, correlation};
pub use dynamic_score::{ScoreError, score_dynamic};
pub use identity::{IdentityCycle, score_identities};
pub use scan_zones::{LabelledScan, ScanReturn, ScanZoneScore, score_scan_zones};
pub use truth::{LabelledPoint, TruthFrame, TruthFrameError};
