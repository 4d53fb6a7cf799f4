//! When two descriptors are taken for the same.

use std::f64::consts::PI;

use crate::feature::points::DESCRIPTOR_BITS;

geometry::parameters! {
    /// The parameters of both kinds of matching.
    #[derive(Clone, Copy, PartialEq, Debug)]
    pub struct MatchConfig {
        /// Descriptors of one corner differ by at most this many bits.
        // Rublee et al. 2011, figure 6: distances of true matches stay below 64 bits in the main, those of false ones lie
        // about 128.
        max_distance: u32 = 64, whole(0, DESCRIPTOR_BITS as i64);
        /// The nearest descriptor is nearer than this share of the distance of the second nearest.
        // Lowe 2004, section 7.1: 0.8 drops 90 % of the false matches and less than 5 % of the true ones.
        max_ratio: f64 = 0.8, above_to(0.0, 1.0);
        /// The corners of two views of one scene turn alike: the rotation of a match deviates by at most this from that of most
        /// matches. pi or more accepts every match.
        // Three bins of 10 degrees to each side: three times what noise and perspective turn a corner.
        rotation_tolerance_rad: f64 = 30.0 * PI / 180.0, positive;
    }
}

impl MatchConfig {
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
