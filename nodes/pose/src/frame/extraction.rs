//! Corners and segments of a pair of images.

use std::sync::Arc;

use estimation::executor::{join, map};
use estimation::{Executor, Serial};
use geometry::{CameraModel, CameraModelError, DepthImage, ParameterError};

use super::depth::depth_at;
use super::{Frame, FrameConfig, MeasuredDepth};
use crate::feature::lines::{
    LineDetector, LineFeature, LineSegment, SegmentInSpace, segment_in_space,
};
use crate::feature::points::{Corner, PointExtractor};
use crate::image::GrayImage;

/// Segments that a thread describes and locates at once: few enough that all threads end together.
const SEGMENTS_AT_ONCE: usize = 8;

/// Finds the features of pairs of images, one after another; it keeps the memory that it works on, and nothing else.
#[derive(Clone, Debug)]
pub struct FrameExtractor {
    config: FrameConfig,
    executor: Arc<dyn Executor>,
    points: PointExtractor,
    lines: LineDetector,
}

impl FrameExtractor {
    /// An extractor with these parameters.
    ///
    /// # Errors
    /// When a parameter has a value that means nothing.
    pub fn new(config: FrameConfig) -> Result<Self, ParameterError> {
        config.validate()?;
        let points = PointExtractor::new(config.points.clone())?;
        let lines = LineDetector::new(config.lines)?;
        Ok(Self { config, executor: Arc::new(Serial), points, lines })
    }

    /// Has this executor do the work; the features do not depend on its threads. Corners and segments are looked for at the
    /// same time; where only one of the two is wanted, it gets all threads.
    #[must_use]
    pub fn with_executor(self, executor: Arc<dyn Executor>) -> Self {
        let Self { config, points, lines, .. } = self;
        let both = config.use_points && config.use_lines;
        let each: Arc<dyn Executor> = if both { Arc::new(Serial) } else { Arc::clone(&executor) };
        let points = points.with_executor(Arc::clone(&each));
        Self { config, executor, points, lines: lines.with_executor(each) }
    }

    /// The parameters.
    #[must_use]
    pub fn config(&self) -> &FrameConfig {
        &self.config
    }

    /// The features of a rectified gray image and the depth image that belongs to it, pixel by pixel; `camera` is that of both. Its
    /// stamp is that of the depth image.
    ///
    /// # Errors
    /// When the three do not belong together, or the camera is none of rectified images.
    pub fn extract(
        &mut self,
        gray: &GrayImage,
        depth: &DepthImage,
        camera: &CameraModel,
    ) -> Result<Frame, FrameInputError> {
        check_inputs(gray, depth, camera)?;
        let Self { config, executor, points, lines: detector } = self;
        let pair = Pair { gray, depth, camera, config };
        let ((corners, corner_depths), segments) =
            join(&**executor, || pair.corners(points), || pair.segments(detector));
        let runs = segments.chunks(SEGMENTS_AT_ONCE).collect();
        let described = map(&**executor, runs, |run| pair.described(detector, run));
        let (lines, lines_in_space) = described.into_iter().flatten().unzip();
        Ok(Frame { stamp: depth.stamp, corners, corner_depths, lines, lines_in_space })
    }
}

/// Images that cannot be looked for features in together.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum FrameInputError {
    /// They are not of one size.
    #[error(
        "the gray image, the depth image and the camera must have one size: they have {} x {}, {} x {} and {} x {} pixels",
        gray_px.0, gray_px.1, depth_px.0, depth_px.1, camera_px.0, camera_px.1
    )]
    Sizes {
        /// Width and height of the gray image.
        gray_px: (usize, usize),
        /// Of the depth image.
        depth_px: (usize, usize),
        /// Of the camera's images.
        camera_px: (usize, usize),
    },
    /// The camera's numbers are none of a camera.
    #[error("the camera: {0}")]
    Camera(#[from] CameraModelError),
    /// The camera has distortion, so that its images are not rectified.
    #[error("the camera has distortion: rectify its images first")]
    Distorted,
}

fn check_inputs(
    gray: &GrayImage,
    depth: &DepthImage,
    camera: &CameraModel,
) -> Result<(), FrameInputError> {
    let gray_px = (gray.width_px(), gray.height_px());
    let depth_px = (depth.width_px(), depth.height_px());
    let camera_px = (camera.width_px, camera.height_px);
    if gray_px != depth_px || gray_px != camera_px {
        return Err(FrameInputError::Sizes { gray_px, depth_px, camera_px });
    }
    camera.validate()?;
    if camera.distortion.is_none() { Ok(()) } else { Err(FrameInputError::Distorted) }
}

/// Corners, and how far each is.
type Corners = (Vec<Corner>, Vec<Option<MeasuredDepth>>);
/// A segment, and where it lies in space.
type Line = (LineFeature, Option<SegmentInSpace>);

/// A pair of images, and what is looked for.
struct Pair<'a> {
    gray: &'a GrayImage,
    depth: &'a DepthImage,
    camera: &'a CameraModel,
    config: &'a FrameConfig,
}

impl Pair<'_> {
    fn corners(&self, extractor: &mut PointExtractor) -> Corners {
        if !self.config.use_points {
            return Corners::default();
        }
        let corners = extractor.extract(self.gray);
        let depth_of = |corner: &Corner| depth_at(self.depth, corner.pixel, self.config);
        let depths = corners.iter().map(depth_of).collect();
        (corners, depths)
    }

    /// The most meaningful segments.
    fn segments(&self, detector: &mut LineDetector) -> Vec<LineSegment> {
        if !self.config.use_lines {
            return Vec::new();
        }
        let mut segments = detector.detect(self.gray);
        segments.truncate(self.config.max_lines);
        segments
    }

    /// The descriptors of segments, and their depths.
    fn described(&self, detector: &LineDetector, segments: &[LineSegment]) -> Vec<Line> {
        let sensor = self.config.depth_sensor();
        let in_space = |line: LineFeature| {
            let Self { depth, camera, config, .. } = *self;
            let found = segment_in_space(&line.segment, depth, camera, sensor, &config.line_depth);
            (line, found.ok())
        };
        detector.describe(segments).into_iter().map(in_space).collect()
    }
}

#[cfg(test)]
mod tests {
    use geometry::{DepthPixels, Distortion, Stamp};

    use super::*;
    use crate::feature::points::PointConfig;
    use crate::testing::{Random, threads};

    const SIDE_PX: usize = 320;
    const RECTANGLES: usize = 150;

    /// Rectangles upon each other, each row of pixels farther away than the one below.
    fn images() -> (GrayImage, DepthImage, CameraModel) {
        let mut random = Random::new(1);
        let mut below = |most: usize| (random.uniform() * most as f64) as usize;
        let mut pixels = vec![0; SIDE_PX * SIDE_PX];
        for _ in 0..RECTANGLES {
            let (left, top, shade) = (below(SIDE_PX), below(SIDE_PX), below(256) as u8);
            let (width, height) = (10 + below(80), 10 + below(80));
            for row in top..(top + height).min(SIDE_PX) {
                pixels[row * SIDE_PX..][left..(left + width).min(SIDE_PX)].fill(shade);
            }
        }
        let gray = GrayImage::new(SIDE_PX, SIDE_PX, pixels).unwrap();
        let depth_m = (0..SIDE_PX * SIDE_PX).map(|pixel| 3.0 - (pixel / SIDE_PX) as f32 / 320.0);
        let pixels = DepthPixels::Metres(depth_m.collect());
        let stamp = Stamp::from_nanos(1);
        let depth = DepthImage::new(stamp, "camera".to_owned(), (SIDE_PX, SIDE_PX), pixels);
        let middle_px = SIDE_PX as f64 / 2.0;
        let camera = CameraModel {
            width_px: SIDE_PX,
            height_px: SIDE_PX,
            fx_px: 300.0,
            fy_px: 300.0,
            cx_px: middle_px,
            cy_px: middle_px,
            distortion: Distortion::None,
        };
        (gray, depth.unwrap(), camera)
    }

    fn extracted(config: FrameConfig, count: usize) -> Frame {
        let (gray, depth, camera) = images();
        let extractor = FrameExtractor::new(config).unwrap();
        extractor.with_executor(Arc::new(threads(count))).extract(&gray, &depth, &camera).unwrap()
    }

    /// Regression: a depth image of another size than the gray one was read at the pixels of the other grid, and gave wrong poses.
    #[test]
    fn images_that_do_not_belong_together_are_refused() {
        let (gray, depth, camera) = images();
        let mut extractor = FrameExtractor::new(FrameConfig::default()).unwrap();
        let half_px = SIDE_PX / 2;
        let half = DepthPixels::Metres(vec![1.0; half_px * half_px]);
        let half = DepthImage::new(depth.stamp, "camera".to_owned(), (half_px, half_px), half);
        let sizes = extractor.extract(&gray, &half.unwrap(), &camera).unwrap_err();
        let side_px = (SIDE_PX, SIDE_PX);
        let depth_px = (half_px, half_px);
        let expected = FrameInputError::Sizes { gray_px: side_px, depth_px, camera_px: side_px };
        assert_eq!(sizes, expected);
        assert!(sizes.to_string().contains("320 x 320, 160 x 160 and 320 x 320"), "{sizes}");
        let mut refused = |camera: CameraModel| extractor.extract(&gray, &depth, &camera).err();
        assert!(matches!(
            refused(CameraModel { fx_px: f64::NAN, ..camera }),
            Some(FrameInputError::Camera(CameraModelError::FocalLength { .. }))
        ));
        let distortion = Distortion::PlumbBob([0.1, 0.0, 0.0, 0.0, 0.0]);
        let distorted = CameraModel { distortion, ..camera };
        assert_eq!(refused(distorted), Some(FrameInputError::Distorted));
        assert_eq!(refused(camera), None);
    }

    #[test]
    fn two_threads_find_what_one_does() {
        let points = PointConfig { max_corners: 50, levels: 1, ..PointConfig::default() };
        let config = FrameConfig { points, max_lines: 1000, ..FrameConfig::default() };
        let one = extracted(config.clone(), 1);
        let least = 10 * SEGMENTS_AT_ONCE;
        assert!(one.measured_lines() > least, "{} segments", one.measured_lines());
        for _ in 0..20 {
            assert!(extracted(config.clone(), 2) == one);
        }
    }

    #[test]
    fn an_image_without_segments_has_corners_all_the_same() {
        let none = FrameConfig { max_lines: 0, ..FrameConfig::default() };
        let frame = extracted(none, 2);
        assert!(frame.lines.is_empty() && frame.measured_corners() > 100);
    }
}
