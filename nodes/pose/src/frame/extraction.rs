//! Corners and segments of a pair of images.

use std::thread;

use geometry::{CameraModel, DepthImage};

use super::depth::depth_at;
use super::{Frame, FrameConfig, FrameConfigError};
use crate::feature::lines::{LineDetector, LineFeature, segment_in_space};
use crate::feature::points::{Corner, PointExtractor};
use crate::image::GrayImage;

/// Finds the features of pairs of images, one after another; it keeps the memory that it works on, and nothing else.
#[derive(Clone, Debug)]
pub struct FrameExtractor {
    config: FrameConfig,
    points: PointExtractor,
    lines: LineDetector,
}

/// The steps of [`FrameExtractor::extract_in_steps`], in their order.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum FrameStep {
    /// Corners and segments are found.
    Features,
    /// They have their depths.
    Depths,
}

impl FrameExtractor {
    /// An extractor with these parameters.
    ///
    /// # Errors
    /// When a parameter has a value that means nothing.
    pub fn new(config: FrameConfig) -> Result<Self, FrameConfigError> {
        config.validate()?;
        let points =
            PointExtractor::new(config.points.clone()).map_err(FrameConfigError::Points)?;
        let lines = LineDetector::new(config.lines).map_err(FrameConfigError::Lines)?;
        Ok(Self { config, points, lines })
    }

    /// The parameters.
    #[must_use]
    pub fn config(&self) -> &FrameConfig {
        &self.config
    }

    /// The features of a rectified gray image and the depth image that belongs to it, pixel by pixel. Its stamp is that of
    /// the depth image.
    pub fn extract(&mut self, gray: &GrayImage, depth: &DepthImage, camera: &CameraModel) -> Frame {
        self.extract_in_steps(gray, depth, camera, |_| ())
    }

    /// The same, calling `done` after each step: so that the steps can be timed, by whoever has a clock.
    pub fn extract_in_steps(
        &mut self,
        gray: &GrayImage,
        depth: &DepthImage,
        camera: &CameraModel,
        mut done: impl FnMut(FrameStep),
    ) -> Frame {
        let Self { config, points, lines } = self;
        let mut corners = || if config.use_points { points.extract(gray) } else { Vec::new() };
        let mut segments =
            || if config.use_lines { segments(lines, gray, config.max_lines) } else { Vec::new() };
        let (corners, lines) = if config.in_parallel && config.use_points && config.use_lines {
            both(corners, segments)
        } else {
            (corners(), segments())
        };
        done(FrameStep::Features);
        let corner_depths =
            corners.iter().map(|corner| depth_at(depth, corner.pixel, config)).collect();
        let sensor = config.depth_sensor();
        let in_space = |line: &LineFeature| {
            segment_in_space(&line.segment, depth, camera, sensor, &config.line_depth).ok()
        };
        let lines_in_space = lines.iter().map(in_space).collect();
        done(FrameStep::Depths);
        Frame { stamp: depth.stamp, corners, corner_depths, lines, lines_in_space }
    }
}

/// What both find, one on a thread of its own.
fn both(
    corners: impl FnOnce() -> Vec<Corner> + Send,
    segments: impl FnOnce() -> Vec<LineFeature> + Send,
) -> (Vec<Corner>, Vec<LineFeature>) {
    thread::scope(|scope| {
        let corners = scope.spawn(corners);
        let segments = segments();
        // It does not panic.
        (corners.join().unwrap_or_default(), segments)
    })
}

/// The most meaningful segments of an image, described.
fn segments(detector: &mut LineDetector, gray: &GrayImage, most: usize) -> Vec<LineFeature> {
    let mut segments = detector.detect(gray);
    segments.truncate(most);
    detector.describe(&segments)
}
