//! When two segments are one line.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use crate::feature::lines::LineDescriptor;

/// Parameters of the matching of line segments.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LineMatchConfig {
    /// The descriptors of one line differ by at most so many bits of 256.
    pub max_distance_bits: u32,
    /// The best candidate differs by at most this share of what the second best does.
    pub max_ratio: f64,
    /// The segments of one line differ by at most so much in direction. Half a turn compares all with all.
    pub max_turn_rad: f64,
    /// A segment's ends lie at most so far from where its line was foreseen.
    pub max_offset_px: f64,
    /// Along the line, the two share at least this much of the shorter one.
    pub min_overlap: f64,
}

impl Default for LineMatchConfig {
    fn default() -> Self {
        Self {
            // Two descriptors that have nothing to do with each other differ by 128 of 256 bits, give or take: a half
            // of that is far from chance.
            max_distance_bits: 64,
            // Lowe (2004), section 7.1.
            max_ratio: 0.8,
            // One bin of 10 degrees to each side (PL-SLAM).
            max_turn_rad: PI / 18.0,
            // ORB-SLAM searches 15 pixels around a point that the motion model foresees.
            max_offset_px: 15.0,
            // Segments break; what shares less than a half may be the next one on the same wall.
            min_overlap: 0.5,
        }
    }
}

/// A parameter has a value that means nothing.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
#[error("parameter {name} must be {accepted}, not {value}")]
pub struct LineMatchConfigError {
    /// The parameter.
    pub name: &'static str,
    /// What it may be.
    pub accepted: &'static str,
    /// What it is.
    pub value: f64,
}

impl LineMatchConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), LineMatchConfigError> {
        let check = |name, accepted, value: f64, holds: bool| {
            if holds { Ok(()) } else { Err(LineMatchConfigError { name, accepted, value }) }
        };
        let bits = self.max_distance_bits;
        check("max_distance_bits", "in 0 .. 256", f64::from(bits), bits <= LineDescriptor::BITS)?;
        let ratio = self.max_ratio;
        check("max_ratio", "in (0, 1]", ratio, ratio > 0.0 && ratio <= 1.0)?;
        let turn = self.max_turn_rad;
        check("max_turn_rad", "in [0, pi] radians", turn, (0.0..=PI).contains(&turn))?;
        let offset = self.max_offset_px;
        check("max_offset_px", "0 or more pixels", offset, offset.is_finite() && offset >= 0.0)?;
        let overlap = self.min_overlap;
        check("min_overlap", "in [0, 1]", overlap, (0.0..=1.0).contains(&overlap))
    }
}
