//! When two segments are one line.

use std::f64::consts::PI;

use geometry::{ParameterError, parameter};
use serde::{Deserialize, Serialize};

use crate::feature::lines::LineDescriptor;

geometry::parameters! {
    /// Parameters of the matching of line segments.
    #[derive(Clone, Copy, PartialEq, Debug)]
    pub struct LineMatchConfig {
        /// Descriptors of one line differ by at most this many bits.
        // Two descriptors that have nothing to do with each other differ by 128 of 256 bits, give or take: a half of that is far
        // from chance.
        max_distance_bits: u32 = 64, whole(0, LineDescriptor::BITS as i64);
        /// The nearest descriptor is nearer than this share of the distance of the second nearest.
        // Lowe (2004), section 7.1.
        max_ratio: f64 = 0.8, above_to(0.0, 1.0);
        /// Segments of one line differ by at most this in direction. pi compares all with all.
        // One bin of 10 degrees to each side (PL-SLAM).
        max_turn_rad: f64 = PI / 18.0, between(0.0, PI);
    }
}

/// Parameters of [`match_projected_lines`](super::match_projected_lines).
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ProjectedLineConfig {
    /// When two segments are alike.
    pub matching: LineMatchConfig,
    /// A segment's ends lie at most this far from where its line was predicted.
    pub max_offset_px: f64,
    /// Along the line, the two share at least this much of the shorter one.
    pub min_overlap: f64,
}

impl Default for ProjectedLineConfig {
    fn default() -> Self {
        Self {
            matching: LineMatchConfig::default(),
            // ORB-SLAM searches 15 pixels around a point that the motion model predicts.
            max_offset_px: 15.0,
            // Segments break; what shares less than a half may be the next one on the same wall.
            min_overlap: 0.5,
        }
    }
}

impl ProjectedLineConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        self.matching.validate()?;
        parameter::not_negative("max_offset_px", self.max_offset_px)?;
        parameter::between("min_overlap", self.min_overlap, 0.0, 1.0)
    }
}
