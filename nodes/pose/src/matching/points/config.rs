//! When two descriptors are taken for the same.

use std::f64::consts::PI;

use geometry::{ParameterError, parameter};
use serde::{Deserialize, Serialize};

use crate::feature::points::DESCRIPTOR_BITS;

/// The parameters of both kinds of matching. Every default stands in [`MatchConfig::default`] and nowhere else.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct MatchConfig {
    /// Descriptors that differ in more bits are not of the same corner.
    pub max_distance: u32,
    /// The nearest descriptor must be nearer than this share of the distance of the next one.
    pub max_ratio: f64,
    /// The corners of two views of one scene turn alike: what a match turns may deviate so much from what most turn.
    /// A half turn or more lets every match pass.
    pub rotation_tolerance_rad: f64,
}

impl Default for MatchConfig {
    fn default() -> Self {
        Self {
            // Rublee et al. 2011, figure 6: distances of true matches stay below 64 bits in the main, those of false
            // ones lie about 128.
            max_distance: 64,
            // Lowe 2004, section 7.1: 0.8 drops 90 % of the false matches and less than 5 % of the true ones.
            max_ratio: 0.8,
            // Three bins of 10 degrees to each side: three times what noise and perspective turn a corner.
            rotation_tolerance_rad: 30.0 * PI / 180.0,
        }
    }
}

impl MatchConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let distance = f64::from(self.max_distance);
        parameter::check(
            "max_distance",
            "in 0 .. 256",
            distance,
            distance <= DESCRIPTOR_BITS as f64,
        )?;
        let ratio = self.max_ratio;
        parameter::check("max_ratio", "in (0, 1]", ratio, ratio > 0.0 && ratio <= 1.0)?;
        parameter::positive("rotation_tolerance_rad", self.rotation_tolerance_rad)
    }

    /// Whether the nearest descriptor is near enough, and nearer than the next, if there is one.
    pub(super) fn accepts(&self, distance: u32, next_distance: Option<u32>) -> bool {
        let is_clear =
            next_distance.is_none_or(|next| f64::from(distance) < self.max_ratio * f64::from(next));
        distance <= self.max_distance && is_clear
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_each_bad_parameter_is_named() {
        let valid = MatchConfig::default();
        assert_eq!(valid.validate(), Ok(()));
        for (name, config) in [
            ("max_distance", MatchConfig { max_distance: 257, ..valid }),
            ("max_ratio", MatchConfig { max_ratio: 0.0, ..valid }),
            ("max_ratio", MatchConfig { max_ratio: f64::NAN, ..valid }),
            ("rotation_tolerance_rad", MatchConfig { rotation_tolerance_rad: 0.0, ..valid }),
        ] {
            let message = config.validate().unwrap_err().to_string();
            assert!(message.contains(name), "{message}");
        }
    }
}
