//! How depth along a segment is judged.

use geometry::{ParameterError, parameter};
use serde::{Deserialize, Serialize};

/// What the depths of a camera are worth.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DepthSensor {
    /// Standard deviation of the inverse of a depth, in 1/m: that of a depth of `z` metres is `z^2` times this.
    pub inverse_depth_std_dev: f64,
    /// Depths beyond are not used.
    pub max_depth_m: f64,
}

impl Default for DepthSensor {
    fn default() -> Self {
        Self {
            // Khoshelham and Elberink (2012): 1.425e-3 for the Kinect, rounded up.
            inverse_depth_std_dev: 1.5e-3,
            // There, at 8 m: a deviation of 0.1 m.
            max_depth_m: 8.0,
        }
    }
}

/// Parameters of [`segment_in_space`](super::segment_in_space).
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SegmentDepthConfig {
    /// Depths are looked up beside the segment, from so many pixels off ...
    pub nearest_side_px: usize,
    /// ... to so many.
    pub farthest_side_px: usize,
    /// Where the sides differ by more than so many standard deviations there is an edge, and the nearer one counts.
    pub step_std_devs: f64,
    /// A depth is on the line when it deviates by at most so many standard deviations.
    pub max_std_devs: f64,
    /// The middle is off the line of the ends by at most so many standard deviations.
    pub max_bend_std_devs: f64,
    /// At least so many places along the segment have a depth that is on the line, ...
    pub min_samples: usize,
    /// ... and at least this share of all.
    pub min_support: f64,
    /// At least this share of the depths is on the line, whatever has none.
    pub min_agreement: f64,
}

impl Default for SegmentDepthConfig {
    fn default() -> Self {
        Self {
            // A pixel at an edge of the colour image may be of either side.
            nearest_side_px: 1,
            // Colour and depth are aligned within 2 to 3 pixels.
            farthest_side_px: 3,
            // A floor seen from 1 m above differs by 5 between 2 pixels to the one side and 2 to the other.
            step_std_devs: 8.0,
            // The usual three.
            max_std_devs: 3.0,
            // As many: of 13 samples, the fewest that a segment has, the middle is uncertain by 0.9.
            max_bend_std_devs: 3.0,
            // A half of the shortest segment that there is.
            min_samples: 6,
            min_support: 0.5,
            // More than a half: of two lines that meet neither is the segment.
            min_agreement: 0.6,
        }
    }
}

/// Farther beside a segment there is something else.
const FARTHEST_SIDE_PX: usize = 100;

impl SegmentDepthConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        for (name, value) in [
            ("step_std_devs", self.step_std_devs),
            ("max_std_devs", self.max_std_devs),
            ("max_bend_std_devs", self.max_bend_std_devs),
        ] {
            parameter::check(name, "a positive number", value, value > 0.0 && value.is_finite())?;
        }
        let (nearest, farthest) = (self.nearest_side_px, self.farthest_side_px);
        let holds = (nearest..=FARTHEST_SIDE_PX).contains(&farthest);
        parameter::check("farthest_side_px", "in nearest_side_px .. 100", farthest as f64, holds)?;
        let samples = self.min_samples;
        parameter::check("min_samples", "at least 3", samples as f64, samples >= 3)?;
        for (name, value) in
            [("min_support", self.min_support), ("min_agreement", self.min_agreement)]
        {
            parameter::check(name, "in [0, 1]", value, (0.0..=1.0).contains(&value))?;
        }
        Ok(())
    }
}
