//! One turn of a 2D laser scanner.

use std::f64::consts::TAU;

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use crate::Stamp;

crate::choices! {
    /// The order in which a scanner measures the beams of its message.
    ///
    /// `LaserScan` defines `time_increment` as the time from a beam to the next, but the common drivers of
    /// scanners that turn clockwise (`rplidar_ros`) turn the readings round and leave the increment positive.
    #[derive(Default)]
    pub enum BeamOrder {
        /// Not known: every beam counts as measured in the middle of the turn, and the motion of the platform within the turn
        /// makes it less certain.
        Unknown = "unknown" as default,
        /// The first beam of the message is measured first (REP-138).
        FirstToLast = "first_to_last",
        /// The last beam of the message is measured first: drivers that turn the readings round.
        LastToFirst = "last_to_first",
    }
}

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

/// Increments by which a scan may exceed one turn: drivers differ in whether the last ray repeats the first, and round their
/// increments.
const SPARE_INCREMENTS: f64 = 2.0;
/// The part of a turn by which a scan may go on beyond it, to be cut off there: drivers that end a scan where they see its first
/// angle again have some rays twice. One that goes on for longer has a wrong increment.
const MOST_OVERLAP: f64 = 0.1;

/// How many rays a turn has; `None` where the increment is no angle.
#[must_use]
pub fn rays_in_turn(angle_increment_rad: f32) -> Option<usize> {
    let rays = (TAU / f64::from(angle_increment_rad).abs()).round();
    (rays.is_finite() && rays >= 1.0).then_some(rays as usize)
}

/// How many of `rays` are to be read: those of one turn, where some more were sent.
#[must_use]
pub fn rays_without_overlap(rays: usize, angle_increment_rad: f32) -> usize {
    match rays_in_turn(angle_increment_rad) {
        Some(turn) if rays > turn.saturating_add(SPARE_INCREMENTS as usize) => {
            let most = turn as f64 * (1.0 + MOST_OVERLAP);
            if rays as f64 <= most { turn } else { rays }
        }
        _ => rays,
    }
}

/// A scan says nothing of any place.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum ScanError {
    /// It has no rays.
    #[error("ranges is empty; the driver sent a scan without a single ray")]
    NoRays,
    /// Its angles are no angles.
    #[error(
        "angle_min {angle_min_rad} and angle_increment {angle_increment_rad} must be finite, and the increment not 0"
    )]
    Angles {
        /// Angle of the first ray.
        angle_min_rad: f32,
        /// Angle from a ray to the next.
        angle_increment_rad: f32,
    },
    /// Its rays go round more than once.
    #[error(
        "{rays} rays of {angle_increment_rad} rad span {span_rad} rad, more than one turn; ranges or angle_increment is wrong"
    )]
    Span {
        /// How many ranges there are.
        rays: usize,
        /// Angle from a ray to the next.
        angle_increment_rad: f32,
        /// Angle from the first ray to the last.
        span_rad: f64,
    },
    /// No range could lie within its limits.
    #[error("no range lies within range_min {range_min_m} and range_max {range_max_m}")]
    Limits {
        /// Shorter ranges are no measurements.
        range_min_m: f32,
        /// Longer ranges are no measurements.
        range_max_m: f32,
    },
}

impl Scan {
    /// Checks that it could say something.
    ///
    /// # Errors
    /// When it has no ray, its angles are not finite or do not advance, its rays go round more than once, or no range could lie
    /// within its limits.
    pub fn validate(&self) -> Result<(), ScanError> {
        let Self { angle_min_rad, angle_increment_rad, range_min_m, range_max_m, .. } = *self;
        let rays = self.ranges_m.len();
        let Some(increments) = rays.checked_sub(1) else { return Err(ScanError::NoRays) };
        if !angle_min_rad.is_finite()
            || !angle_increment_rad.is_finite()
            || angle_increment_rad == 0.0
        {
            return Err(ScanError::Angles { angle_min_rad, angle_increment_rad });
        }
        let increment_rad = f64::from(angle_increment_rad).abs();
        let span_rad = increments as f64 * increment_rad;
        if span_rad > TAU + SPARE_INCREMENTS * increment_rad {
            return Err(ScanError::Span { rays, angle_increment_rad, span_rad });
        }
        if !(range_min_m >= 0.0 && range_max_m > 0.0 && range_min_m <= range_max_m) {
            return Err(ScanError::Limits { range_min_m, range_max_m });
        }
        Ok(())
    }

    /// Azimuth of beam `index` in the scan's frame.
    #[must_use]
    pub fn azimuth_rad(&self, index: usize) -> f64 {
        f64::from(self.angle_min_rad) + index as f64 * f64::from(self.angle_increment_rad)
    }

    /// The range of beam `index` if it is a real return: finite, positive and within the sensor's limits. Neither is a range of 0,
    /// even where the sensor states 0 as its lower limit, since nothing stands in it; nor one that equals the upper limit: simulators and
    /// drivers from before REP-117 send that where nothing returned.
    #[must_use]
    pub fn measured_range_m(&self, index: usize) -> Option<f32> {
        let range_m = *self.ranges_m.get(index)?;
        let within_limits = range_m >= self.range_min_m && range_m < self.range_max_m;
        (range_m.is_finite() && range_m > 0.0 && within_limits).then_some(range_m)
    }

    /// Where beam `index` ended, in the scan frame; `None` where it has no real return.
    #[must_use]
    pub fn hit_m(&self, index: usize) -> Option<Point3<f64>> {
        let range_m = f64::from(self.measured_range_m(index)?);
        let (sin, cos) = self.azimuth_rad(index).sin_cos();
        Some(Point3::new(range_m * cos, range_m * sin, 0.0))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn scan(ranges_m: Vec<f32>) -> Scan {
        Scan { range_min_m: 0.15, range_max_m: 8.0, ranges_m, ..Scan::default() }
    }

    /// Also regression: of a scanner that sends its greatest range where nothing returns the floor plan had a wall in a circle around the robot.
    #[test]
    fn only_a_real_return_is_a_measured_range() {
        let none = [f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 0.0, -1.0, 0.149, 8.0, 8.001];
        let scan_of_none = scan(none.to_vec());
        for (index, range_m) in none.iter().enumerate() {
            assert_eq!(scan_of_none.measured_range_m(index), None, "{range_m}");
        }
        assert_eq!(scan_of_none.measured_range_m(none.len()), None);
        let real = scan(vec![0.15, 3.697, 7.999]);
        let measured: Vec<_> = (0..3).filter_map(|index| real.measured_range_m(index)).collect();
        assert_eq!(measured, [0.15, 3.697, 7.999]);
    }

    #[test]
    fn a_lower_limit_of_zero_makes_no_return_of_zero() {
        for range_min_m in [0.0, -0.0, -1.0] {
            let scan = Scan { range_min_m, ..scan(vec![0.0, -0.0, -0.5, 0.001]) };
            let measured: Vec<_> = (0..4).map(|index| scan.measured_range_m(index)).collect();
            assert_eq!(measured, [None, None, None, Some(0.001)]);
        }
    }

    #[test]
    fn a_sensor_without_known_limits_has_no_returns() {
        let unknown = Scan { range_max_m: f32::NAN, ..scan(vec![1.0]) };
        assert_eq!(unknown.measured_range_m(0), None);
        let unlimited = Scan { range_max_m: f32::INFINITY, ..scan(vec![1.0, f32::INFINITY]) };
        assert_eq!(unlimited.measured_range_m(0), Some(1.0));
        assert_eq!(unlimited.measured_range_m(1), None);
    }

    #[test]
    fn azimuths_go_by_the_increment_in_either_direction() {
        let increment_rad = 1_f32.to_radians();
        let mut scan = scan(vec![1.0; 360]);
        (scan.angle_min_rad, scan.angle_increment_rad) = (-std::f32::consts::PI, increment_rad);
        assert!((scan.azimuth_rad(0) + PI).abs() < 1e-6);
        assert!(scan.azimuth_rad(180).abs() < 1e-5);
        (scan.angle_min_rad, scan.angle_increment_rad) = (std::f32::consts::PI, -increment_rad);
        assert!((scan.azimuth_rad(270) + PI / 2.0).abs() < 1e-5);
    }
}
