//! What is looked for in a pair of images.

use geometry::{ParameterError, parameter};
use serde::{Deserialize, Serialize};

use crate::feature::lines::{DepthSensor, LineConfig, SegmentDepthConfig};
use crate::feature::points::PointConfig;

/// Parameters of [`FrameExtractor`](super::FrameExtractor).
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FrameConfig {
    /// Whether corners are looked for.
    pub use_points: bool,
    /// Whether line segments are.
    pub use_lines: bool,
    /// How corners are found.
    pub points: PointConfig,
    /// How line segments are found.
    pub lines: LineConfig,
    /// No more than the most meaningful segments are described and located.
    pub max_lines: usize,
    /// How segments are located.
    pub line_depth: SegmentDepthConfig,
    /// Standard deviation of the inverse of a depth, in 1/m: that of a depth of `z` metres is `z^2` times this.
    pub inverse_depth_std_dev: f64,
    /// Depths beyond are not used.
    pub max_depth_m: f64,
    /// A corner's depth is the mean of so many pixels to each side.
    pub depth_window_px: usize,
    /// Where depths around a corner differ by more standard deviations there is an edge, and the corner has no depth.
    pub edge_std_devs: f64,
    /// Corners and segments are looked for by two threads at once. It changes no result.
    pub in_parallel: bool,
}

impl Default for FrameConfig {
    fn default() -> Self {
        let sensor = DepthSensor::default();
        Self {
            use_points: true,
            use_lines: true,
            points: PointConfig::default(),
            lines: LineConfig::default(),
            // Of 500 segments of an indoor image these hold most of the length; time grows with their number.
            max_lines: 200,
            line_depth: SegmentDepthConfig::default(),
            inverse_depth_std_dev: sensor.inverse_depth_std_dev,
            max_depth_m: sensor.max_depth_m,
            // Structured light is matched in windows of 9 pixels: a smaller one tells nothing more.
            depth_window_px: 1,
            // As for the two sides of a segment.
            edge_std_devs: 8.0,
            in_parallel: true,
        }
    }
}

/// A parameter has a value that means nothing.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum FrameConfigError {
    /// One of the corners'.
    #[error("points: {0}")]
    Points(ParameterError),
    /// One of the segments'.
    #[error("lines: {0}")]
    Lines(ParameterError),
    /// One of the segments' depths'.
    #[error("line_depth: {0}")]
    LineDepth(ParameterError),
    /// One of these.
    #[error(transparent)]
    Own(#[from] ParameterError),
}

/// A larger window would reach over whatever is small.
const WIDEST_WINDOW_PX: usize = 10;

impl FrameConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), FrameConfigError> {
        self.points.validate().map_err(FrameConfigError::Points)?;
        self.lines.validate().map_err(FrameConfigError::Lines)?;
        self.line_depth.validate().map_err(FrameConfigError::LineDepth)?;
        let nothing = !self.use_points && !self.use_lines;
        parameter::check("use_points", "true where use_lines is false", 0.0, !nothing)?;
        parameter::positive("inverse_depth_std_dev", self.inverse_depth_std_dev)?;
        parameter::positive("max_depth_m", self.max_depth_m)?;
        parameter::positive("edge_std_devs", self.edge_std_devs)?;
        let window = self.depth_window_px;
        let holds = window <= WIDEST_WINDOW_PX;
        parameter::check("depth_window_px", "in 0 .. 10", window as f64, holds)?;
        Ok(())
    }

    /// What depths are worth.
    pub(super) fn depth_sensor(&self) -> DepthSensor {
        let Self { inverse_depth_std_dev, max_depth_m, .. } = *self;
        DepthSensor { inverse_depth_std_dev, max_depth_m }
    }
}
