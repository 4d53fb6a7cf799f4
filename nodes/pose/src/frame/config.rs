//! The parameters of the features of a pair of images.

use geometry::{ParameterError, parameter};

use crate::feature::lines::{DepthSensor, LineConfig, SegmentDepthConfig};
use crate::feature::points::PointConfig;

geometry::parameters! {
    /// Parameters of [`FrameExtractor`](super::FrameExtractor).
    #[derive(Clone, PartialEq, Debug)]
    pub struct FrameConfig {
        /// Whether corners are extracted; at least one of corners and line segments is.
        use_points: bool = true;
        /// Whether line segments are extracted.
        use_lines: bool = true;
        /// How corners are found.
        points: PointConfig;
        /// How line segments are found.
        lines: LineConfig;
        /// Only this many line segments, the most meaningful ones, are described and located.
        // Of 500 segments of an indoor image these hold most of the length; time grows with their number.
        max_lines: usize = 200;
        /// How line segments are located.
        line_depth: SegmentDepthConfig;
        /// Standard deviation of the inverse of a depth, in 1/m: that of a depth of `z` metres is `z^2` times this.
        inverse_depth_std_dev: f64 = DepthSensor::default().inverse_depth_std_dev, positive;
        /// Farther depths are not used.
        max_depth_m: f64 = DepthSensor::default().max_depth_m, positive;
        /// A corner's depth is the mean of this many pixels to each side.
        // Structured light is matched in windows of 9 pixels: a smaller one adds no detail. A larger one than the bound
        // would reach over small objects.
        depth_window_px: usize = 1, whole(0, 10);
        /// Where depths around a corner differ by more standard deviations there is an edge, and the corner has no depth.
        // As for the two sides of a segment.
        edge_std_devs: f64 = 8.0, positive;
    }
    check = Self::check_features;
}

impl FrameConfig {
    fn check_features(&self) -> Result<(), ParameterError> {
        let is_any = self.use_points || self.use_lines;
        parameter::check("use_points", "true where use_lines is false", 0.0, is_any)
    }

    /// The accuracy of depths.
    pub(super) fn depth_sensor(&self) -> DepthSensor {
        let Self { inverse_depth_std_dev, max_depth_m, .. } = *self;
        DepthSensor { inverse_depth_std_dev, max_depth_m }
    }
}
