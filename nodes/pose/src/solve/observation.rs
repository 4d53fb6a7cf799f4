//! A point or a line of the map, and where the image has it.

use nalgebra::{Point2, Point3, Vector2};

/// A point of the map as the camera sees it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PointObservation {
    /// The point in the map frame.
    pub point_in_map_m: Point3<f64>,
    /// Where the rectified image has it, as column and row.
    pub pixel_px: Point2<f64>,
    /// Its depth (z of the camera frame) where there is one.
    pub depth_m: Option<f64>,
    /// Standard deviation of the column and of the row.
    pub pixel_std_dev_px: f64,
    /// The error of the map's point itself in the image: one standard deviation, in this direction. A point whose
    /// depth is unsure is so along the line through its images by both cameras, and not across it.
    pub spread_px: Vector2<f64>,
    /// Standard deviation of the depth; not looked at without a depth.
    pub depth_std_dev_m: f64,
}

/// A straight line of the map as the camera sees a part of it.
///
/// The ends need not be those of the map's segment: only how far they lie from the line counts, never where along it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LineObservation {
    /// A point of the line in the map frame.
    pub start_in_map_m: Point3<f64>,
    /// Another one.
    pub end_in_map_m: Point3<f64>,
    /// Where the segment in the rectified image begins.
    pub start_px: Point2<f64>,
    /// Where it ends.
    pub end_px: Point2<f64>,
    /// Standard deviation of each end across the segment.
    pub pixel_std_dev_px: f64,
    /// The depth at the segment's beginning, where there is one. It makes a residual of its own: the distance of the seen
    /// end from the line of the map, along the ray.
    pub start_depth_m: Option<f64>,
    /// The depth at its end.
    pub end_depth_m: Option<f64>,
    /// Standard deviation of both depths; not looked at without them.
    pub depth_std_dev_m: f64,
}

/// The status of an observation.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Verdict {
    /// The pose explains it.
    Fits,
    /// The pose explains where it is in the image but not its depth, as happens at the edges of things: its depth was not
    /// used.
    FitsWithoutDepth,
    /// The pose does not explain it, or has it behind the camera.
    Outlier,
    /// It says nothing: a number is not finite, a standard deviation is not positive, a line has no length.
    Unusable,
}

impl Verdict {
    /// Whether the pose explains the place in the image.
    #[must_use]
    pub fn is_inlier(self) -> bool {
        matches!(self, Self::Fits | Self::FitsWithoutDepth)
    }
}
