//! Scores against the truth, of runs, maps, detection and trajectories. [`score_dynamic`] says how much of each moving
//! object a run removed and what that cost the static scene; [`trajectory`] compares an estimate with a reference.
//!
//! No ROS, no files, no clock: the same input gives the same figures.

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

pub use cloud_distance::{CloudDistance, CloudDistanceError, cloud_distance};
pub use correlation::{Correlation, CorrelationError, LocalisedView, correlation};
pub use dynamic_score::{ScoreError, score_dynamic};
pub use identity::{IdentityCycle, score_identities};
pub use scan_zones::{LabelledScan, ScanZoneScore, score_scan_zones};
pub use truth::{LabelledPoint, TruthFrame, TruthFrameError};
