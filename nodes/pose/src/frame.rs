//! The features of one pair of images: corners and line segments, and their depths.

mod config;
mod depth;
mod extraction;
mod left_out;
mod rolling_shutter;

use geometry::Stamp;

pub use config::FrameConfig;
pub use depth::{MeasuredDepth, depth_noise_m};
pub use extraction::{FrameExtractor, FrameInputError};
pub use left_out::{LeftOut, MovingThing};
pub use rolling_shutter::Twist;

use crate::feature::lines::{LineFeature, SegmentInSpace};
use crate::feature::points::Corner;

/// The features of a rectified gray image and of the depth image that belongs to it.
#[derive(Clone, PartialEq, Debug)]
pub struct Frame {
    /// When the images were taken.
    pub stamp: Stamp,
    /// Corners.
    pub corners: Vec<Corner>,
    /// How far each corner is, in their order; `None` where no depth is measured, or an edge leaves open whose it is.
    pub corner_depths: Vec<Option<MeasuredDepth>>,
    /// Line segments, the most meaningful first.
    pub lines: Vec<LineFeature>,
    /// Where each segment lies in the camera frame; `None` where its depths make no line.
    pub lines_in_space: Vec<Option<SegmentInSpace>>,
}

impl Frame {
    /// How many corners have a depth.
    #[must_use]
    pub fn measured_corners(&self) -> usize {
        self.corner_depths.iter().flatten().count()
    }

    /// How many segments lie in space.
    #[must_use]
    pub fn measured_lines(&self) -> usize {
        self.lines_in_space.iter().flatten().count()
    }
}
