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
        let Self { config, points, lines } = self;
        let mut corners = || {
            let corners = if config.use_points { points.extract(gray) } else { Vec::new() };
            let depth_of = |corner: &Corner| depth_at(depth, corner.pixel, config);
            let depths: Vec<_> = corners.iter().map(depth_of).collect();
            (corners, depths)
        };
        let mut lines = || {
            let lines =
                if config.use_lines { segments(lines, gray, config.max_lines) } else { Vec::new() };
            let sensor = config.depth_sensor();
            let in_space = |line: &LineFeature| {
                segment_in_space(&line.segment, depth, camera, sensor, &config.line_depth).ok()
            };
            let in_space: Vec<_> = lines.iter().map(in_space).collect();
            (lines, in_space)
        };
        let ((corners, corner_depths), (lines, lines_in_space)) =
            if config.in_parallel && config.use_points && config.use_lines {
                both(corners, lines)
            } else {
                (corners(), lines())
            };
        Frame { stamp: depth.stamp, corners, corner_depths, lines, lines_in_space }
    }
}

/// What both find, one on a thread of its own.
fn both<A: Send + Default, B>(one: impl FnOnce() -> A + Send, other: impl FnOnce() -> B) -> (A, B) {
    thread::scope(|scope| {
        let one = scope.spawn(one);
        let other = other();
        // It does not panic.
        (one.join().unwrap_or_default(), other)
    })
}

/// The most meaningful segments of an image, described.
fn segments(detector: &mut LineDetector, gray: &GrayImage, most: usize) -> Vec<LineFeature> {
    let mut segments = detector.detect(gray);
    segments.truncate(most);
    detector.describe(&segments)
}
