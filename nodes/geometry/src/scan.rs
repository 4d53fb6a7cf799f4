//! One turn of a 2D laser scanner.

use serde::{Deserialize, Serialize};

use crate::Stamp;

/// A 2D laser scan, the content of `sensor_msgs/LaserScan` (REP-138).
///
/// Beam `i` points at the azimuth `angle_min_rad + i * angle_increment_rad`, measured from the scan
/// frame's x axis towards its y axis. A range may be `+Inf` (nothing within reach), `-Inf` (too near)
/// or NaN (no measurement), as REP-117 says.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Scan {
    /// When the first beam was measured.
    pub stamp: Stamp,
    /// The frame that the angles are measured in.
    pub frame_id: String,
    /// Azimuth of the first beam.
    pub angle_min_rad: f32,
    /// Azimuth from a beam to the next; negative for a scanner that turns clockwise.
    pub angle_increment_rad: f32,
    /// Time from a beam to the next.
    pub time_increment_s: f32,
    /// Time from a scan to the next.
    pub scan_time_s: f32,
    /// Ranges below this one are no measurements.
    pub range_min_m: f32,
    /// Ranges above this one are no measurements.
    pub range_max_m: f32,
    /// The measured ranges, one a beam.
    pub ranges_m: Vec<f32>,
}

impl Scan {
    /// Azimuth of beam `index` in the scan's frame.
    #[must_use]
    pub fn azimuth_rad(&self, index: usize) -> f64 {
        f64::from(self.angle_min_rad) + index as f64 * f64::from(self.angle_increment_rad)
    }

    /// The range of beam `index` if it is a real return: finite and within the sensor's limits.
    #[must_use]
    pub fn measured_range_m(&self, index: usize) -> Option<f32> {
        let range_m = *self.ranges_m.get(index)?;
        (range_m.is_finite() && range_m >= self.range_min_m && range_m <= self.range_max_m)
            .then_some(range_m)
    }
}
