//! How depth along a segment is judged.

use geometry::{ParameterError, parameter};

/// The accuracy of a camera's depths.
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

/// Farther beside a segment there is something else.
const FARTHEST_SIDE_PX: i64 = 100;

geometry::parameters! {
    /// Parameters of [`segment_in_space`](super::segment_in_space).
    #[derive(Clone, Copy, PartialEq, Debug)]
    pub struct SegmentDepthConfig {
        /// Depths are looked up beside the segment from this distance on.
        // A pixel at an edge of the colour image may be of either side.
        nearest_side_px: usize = 1, whole(0, FARTHEST_SIDE_PX);
        /// Depths are looked up beside the segment up to this distance; at least nearest_side_px.
        // Colour and depth are aligned within 2 to 3 pixels.
        farthest_side_px: usize = 3, whole(0, FARTHEST_SIDE_PX);
        /// Where the depths of both sides differ by more than this many standard deviations there is an edge, and the nearer
        /// side is used.
        // A floor seen from 1 m above differs by 5 between 2 pixels to the one side and 2 to the other.
        step_std_devs: f64 = 8.0, positive;
        /// A depth is on the line when it deviates by at most this many standard deviations.
        // The usual three.
        max_std_devs: f64 = 3.0, positive;
        /// The middle is off the line of the ends by at most this many standard deviations.
        // As many: of 13 samples, the fewest that a segment has, the middle is uncertain by 0.9.
        max_bend_std_devs: f64 = 3.0, positive;
        /// The least number of places along the segment that have a depth on the line.
        // A half of the shortest segment that there is.
        min_samples: usize = 6, at_least(3.0);
        /// The least share of all places along the segment that have a depth on the line.
        min_support: f64 = 0.5, share;
        /// The least share of the places with a depth whose depth is on the line.
        // More than a half: of two lines that intersect neither is the segment.
        min_agreement: f64 = 0.6, share;
    }
    check = Self::check_sides;
}

impl SegmentDepthConfig {
    fn check_sides(&self) -> Result<(), ParameterError> {
        let (nearest, farthest) = (self.nearest_side_px as f64, self.farthest_side_px as f64);
        let accepted = ("at least nearest_side_px", nearest);
        parameter::check("farthest_side_px", accepted, farthest, farthest >= nearest)
    }
}
