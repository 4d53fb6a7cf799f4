//! The parameters of the odometry, their defaults, and where these come from.

use std::f64::consts::PI;

use geometry::{BeamOrder, ParameterError, parameter};
use serde::{Deserialize, Serialize};

/// The parameters of [`crate::ScanOdometry`].
///
/// Every default is in [`ScanOdometryConfig::default`] and nowhere else. The noises only weigh one return against
/// another: how large they really are is estimated from what is left over.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct ScanOdometryConfig {
    /// Standard deviation of a range: this much, in quadrature with ...
    pub range_noise_m: f64,
    /// ... this share of the range.
    pub range_noise_ratio: f64,
    /// The order in which the scanner measures.
    pub beam_order: BeamOrder,
    /// Returns are used up to this distance, and the map reaches as far to each side of the scanner.
    pub reach_m: f64,
    /// Returns nearer than this may be of the platform itself, and are left out unless most of the returns are as near.
    pub body_radius_m: f64,
    /// The lines of the map are at least this far apart along a surface.
    pub line_spacing_m: f64,
    /// The map holds no more lines than this; the longest unseen go first.
    pub max_lines: usize,
    /// A line that has not been seen while the platform travelled this far is forgotten: it contains the drift of that distance.
    pub memory_distance_m: f64,
    /// A scan with fewer returns than this is not matched.
    pub min_returns: usize,
    /// A match in which a smaller share of the returns is on the map is refused.
    pub min_matched_share: f64,
    /// A direction is taken from the match only when this standard deviation is reached: a shift ...
    pub max_std_dev_m: f64,
    /// ... or a rotation. Otherwise it keeps the prediction.
    pub max_std_dev_rad: f64,
    /// Surfaces are plane only this well: normals that deviate this much at random determine no direction.
    pub surface_noise_rad: f64,
    /// Standard deviation of the platform's acceleration.
    pub acceleration_m_per_s2: f64,
    /// Standard deviation of its angular acceleration.
    pub acceleration_rad_per_s2: f64,
    /// The platform's largest speed: a match beyond is refused.
    pub max_speed_m_per_s: f64,
    /// A platform cannot turn faster.
    pub max_turn_rad_per_s: f64,
    /// The velocity is extrapolated for this long without a match; then the map begins anew at the predicted pose.
    /// Scans farther apart do not measure the velocity.
    pub max_held_s: f64,
}

impl Default for ScanOdometryConfig {
    fn default() -> Self {
        Self {
            // The RPLIDAR A1's data sheet: errors below 1 % of the range, half of which is taken as the deviation;
            // near by its steps and the surface's roughness. URG and SICK scanners state 1 to 3 cm.
            range_noise_m: 0.01,
            range_noise_ratio: 0.005,
            beam_order: BeamOrder::Unknown,
            // Beyond the reach of indoor scanners (RPLIDAR A1 12 m, URG-04LX 5.6 m, UTM-30LX 30 m).
            reach_m: 30.0,
            // Across a small robot; walls that it drives along are farther away.
            body_radius_m: 0.4,
            // Two or three beams of a third of a degree at 4 m, one of a whole degree at 3 m.
            line_spacing_m: 0.05,
            // The walls of 500 m at that spacing.
            max_lines: 10_000,
            // Across a large room and back: 1 % of drift is the width of a hand.
            memory_distance_m: 20.0,
            // A tenth of a scan of 180 beams is hardly more than one thing.
            min_returns: 20,
            // More than half may be hidden by people, or seen for the first time behind a door.
            min_matched_share: 0.3,
            // What a platform that brakes from walking pace may be off a constant velocity in a turn of 7 Hz.
            max_std_dev_m: 0.03,
            max_std_dev_rad: 2.0 * PI / 180.0,
            // 3 mm over 9 cm, as plaster and curtains have it.
            surface_noise_rad: 2.0 * PI / 180.0,
            // From standing to walking pace in a second.
            acceleration_m_per_s2: 1.0,
            // From standing to a quarter of a turn a second in a second.
            acceleration_rad_per_s2: 0.5 * PI,
            // Twice a walking pace, and half a turn a second: beyond what indoor platforms do.
            max_speed_m_per_s: 3.0,
            max_turn_rad_per_s: PI,
            // A second of walking pace is still within a room.
            max_held_s: 1.0,
        }
    }
}

/// The map's reach is bounded: its grid has `(2 * reach / 0.25 m)^2` cells of 4 bytes, 41 MB at most.
const LONGEST_REACH_M: f64 = 400.0;
/// A map of more lines would not be searched within a scan's time.
const MOST_LINES: f64 = 1e6;

impl ScanOdometryConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        for (name, value) in [
            ("range_noise_m", self.range_noise_m),
            ("memory_distance_m", self.memory_distance_m),
            ("max_std_dev_m", self.max_std_dev_m),
            ("max_std_dev_rad", self.max_std_dev_rad),
            ("acceleration_m_per_s2", self.acceleration_m_per_s2),
            ("acceleration_rad_per_s2", self.acceleration_rad_per_s2),
            ("max_speed_m_per_s", self.max_speed_m_per_s),
            ("max_turn_rad_per_s", self.max_turn_rad_per_s),
            ("max_held_s", self.max_held_s),
        ] {
            parameter::positive(name, value)?;
        }
        for (name, value) in [
            ("range_noise_ratio", self.range_noise_ratio),
            ("min_matched_share", self.min_matched_share),
            ("surface_noise_rad", self.surface_noise_rad),
        ] {
            parameter::below_one(name, value)?;
        }
        parameter::between("reach_m", self.reach_m, 1.0, LONGEST_REACH_M)?;
        parameter::not_negative("body_radius_m", self.body_radius_m)?;
        parameter::between("line_spacing_m", self.line_spacing_m, 0.01, 0.2)?;
        parameter::between("max_lines", self.max_lines as f64, 100.0, MOST_LINES)?;
        parameter::at_least("min_returns", self.min_returns, 3)
    }

    /// Standard deviation of a range.
    pub(crate) fn range_std_dev_m(&self, range_m: f64) -> f64 {
        self.range_noise_m.hypot(self.range_noise_ratio * range_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_each_bad_parameter_is_named() {
        type Spoil = fn(&mut ScanOdometryConfig);
        assert_eq!(ScanOdometryConfig::default().validate(), Ok(()));
        let cases: [(&str, Spoil); 11] = [
            ("range_noise_m", |c| c.range_noise_m = 0.0),
            ("range_noise_ratio", |c| c.range_noise_ratio = 1.0),
            ("reach_m", |c| c.reach_m = f64::NAN),
            ("body_radius_m", |c| c.body_radius_m = -0.1),
            ("line_spacing_m", |c| c.line_spacing_m = 0.0),
            ("max_lines", |c| c.max_lines = 5),
            ("memory_distance_m", |c| c.memory_distance_m = f64::INFINITY),
            ("min_returns", |c| c.min_returns = 2),
            ("min_matched_share", |c| c.min_matched_share = -0.1),
            ("max_speed_m_per_s", |c| c.max_speed_m_per_s = -1.0),
            ("max_held_s", |c| c.max_held_s = f64::NAN),
        ];
        for (name, spoil) in cases {
            let mut config = ScanOdometryConfig::default();
            spoil(&mut config);
            let message = config.validate().unwrap_err().to_string();
            assert!(message.contains(name), "{message}");
        }
    }
}
