//! The points and lines that the camera has seen, and where they are: what a pose is measured against.
//!
//! Each landmark is a Gaussian in the map frame. Each further observation makes it more accurate (a Kalman filter for each, with the
//! camera's pose taken as known); landmarks that are often expected and seldom seen are dropped. So a camera that looks about and
//! returns sees the landmarks of before, and its pose does not drift meanwhile.
//!
//! The common error of a landmark and all others that were added with it is not in its own covariance: it is
//! that of the pose from which they were first seen (`arrivals`).

mod arrivals;
mod config;
mod hidden;
mod line;
mod numbers;
mod place;
mod point;
mod search;
mod upkeep;

use geometry::CameraModel;
use nalgebra::{Isometry3, Matrix6, Point3, Vector3, Vector6};

pub use config::LocalMapConfig;
use estimation::perturbation::parts;
pub use hidden::Hidden;
pub use line::{LineEnd, LineLandmark};
pub use numbers::LandmarkNumbers;
pub(crate) use place::image_slopes;
pub use point::PointLandmark;

use crate::feature::lines::LineFeature;
use crate::feature::points::Corner;
use crate::frame::{Frame, Twist};
use crate::solve::Verdict;
use arrivals::Arrivals;
use line::SeenLine;
use point::SeenPoint;

/// A bounded map of points and lines.
#[derive(Clone, Debug)]
pub struct LocalMap {
    config: LocalMapConfig,
    points: Vec<PointLandmark>,
    lines: Vec<LineLandmark>,
    arrivals: Arrivals,
    next_id: u64,
}

/// A frame and from where it was taken.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// The number of the frame, from 1 on.
    pub number: u64,
    /// Its features.
    pub frame: &'a Frame,
    /// The rectified camera.
    pub camera: &'a CameraModel,
    /// The camera's pose, or its estimate.
    pub camera_from_map: Isometry3<f64>,
    /// Its derivative by the readout time.
    pub readout_derivative: ReadoutDerivative,
}

/// The derivative of a view by the time that the camera takes to read an image, which may be wrong: to first order, for each second
/// that it is longer.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct ReadoutDerivative {
    /// How fast the camera moves.
    pub twist: Twist,
    /// How the perturbation of the pose changes.
    pub pose_per_s: Vector6<f64>,
}

/// A landmark, and the feature that is held to be it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Association {
    /// Which of the landmarks.
    pub landmark: usize,
    /// Which of the frame's corners or segments.
    pub feature: usize,
}

/// The landmarks of the map in a frame.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Associations {
    /// Which points should be seen.
    pub predicted_points: Vec<usize>,
    /// Which lines should be seen.
    pub predicted_lines: Vec<usize>,
    /// Points that are seen.
    pub points: Vec<Association>,
    /// Lines that are seen.
    pub lines: Vec<Association>,
}

/// The verdicts of the pose on the associations, one for each.
#[derive(Clone, Copy, Debug)]
pub struct Verdicts<'a> {
    /// Of the points.
    pub points: &'a [Verdict],
    /// Of the lines.
    pub lines: &'a [Verdict],
}

impl LocalMap {
    /// A map of nothing.
    #[must_use]
    pub fn new(config: LocalMapConfig) -> Self {
        let (points, lines) = (Vec::new(), Vec::new());
        Self { config, points, lines, arrivals: Arrivals::default(), next_id: 0 }
    }

    /// The points.
    #[must_use]
    pub fn points(&self) -> &[PointLandmark] {
        &self.points
    }

    /// The lines.
    #[must_use]
    pub fn lines(&self) -> &[LineLandmark] {
        &self.lines
    }

    /// The derivatives of the points of the associations by the readout time, one for each; see [`PointLandmark::readout_derivative_m_per_s`].
    #[must_use]
    pub fn readout_derivatives_m_per_s(&self, associations: &Associations) -> Vec<Vector3<f64>> {
        let derivative = |pair: &Association| {
            self.points
                .get(pair.landmark)
                .map_or_else(Vector3::zeros, PointLandmark::readout_derivative_m_per_s)
        };
        associations.points.iter().map(derivative).collect()
    }

    /// Moves the points to where they are when the camera takes this much longer to read an image than assumed.
    pub fn correct_readout(&mut self, longer_s: f64) {
        for point in &mut self.points {
            point.correct_readout(longer_s);
        }
    }

    /// The points as the corners that they last were, in their order; they have no place in an image.
    #[must_use]
    pub fn as_corners(&self) -> Vec<Corner> {
        self.points.iter().map(PointLandmark::as_corner).collect()
    }

    /// The lines as features, in their order; they have no place in an image.
    #[must_use]
    pub fn as_segments(&self) -> Vec<LineFeature> {
        self.lines.iter().map(LineLandmark::as_segment).collect()
    }

    /// The common error of the landmarks that the verdicts accept: the covariance of the camera's perturbation at the
    /// view, were the view's own errors none.
    #[must_use]
    pub fn covariance_at(
        &self,
        view: &View<'_>,
        associations: &Associations,
        verdicts: Verdicts<'_>,
    ) -> Matrix6<f64> {
        let accepted = |(pair, verdict): (&Association, &Verdict)| {
            verdict.is_inlier().then_some(pair.landmark)
        };
        let points = associations.points.iter().zip(verdicts.points).filter_map(accepted);
        let points = points.filter_map(|index| Some(self.points.get(index)?.arrival));
        let lines = associations.lines.iter().zip(verdicts.lines).filter_map(accepted);
        let lines = lines.filter_map(|index| Some(self.lines.get(index)?.arrival));
        self.arrivals.covariance_at(points.chain(lines), &view.camera_from_map)
    }
}

impl Associations {
    /// How many features that have depths are landmarks that the verdicts accept.
    #[must_use]
    pub fn measured_inliers(&self, frame: &Frame, verdicts: Verdicts<'_>) -> usize {
        let is_corner =
            |pair: &Association| frame.corner_depths.get(pair.feature).is_some_and(Option::is_some);
        let is_line = |pair: &Association| {
            frame.lines_in_space.get(pair.feature).is_some_and(Option::is_some)
        };
        let points = self.points.iter().zip(verdicts.points);
        let lines = self.lines.iter().zip(verdicts.lines);
        let points = points.filter(|(pair, verdict)| verdict.is_inlier() && is_corner(pair));
        points.count()
            + lines.filter(|(pair, verdict)| verdict.is_inlier() && is_line(pair)).count()
    }
}

impl ReadoutDerivative {
    /// How a place in the camera frame changes that a feature shows.
    pub(crate) fn of_measured(
        &self,
        in_camera_m: &Point3<f64>,
        row_px: f64,
        camera: &CameraModel,
    ) -> Vector3<f64> {
        let after = row_px / camera.height_px as f64 - 0.5;
        -after * (self.twist.shift_m_per_s + self.twist.turn_rad_per_s.cross(&in_camera_m.coords))
    }

    /// How the place of a point of the map changes in the camera frame, by the pose alone.
    pub(crate) fn of_pose(&self, in_camera_m: &Point3<f64>) -> Vector3<f64> {
        let (shift, turn) = parts(&self.pose_per_s);
        shift + turn.cross(&in_camera_m.coords)
    }
}

fn seen_point(frame: &Frame, feature: usize) -> Option<SeenPoint<'_>> {
    let corner = frame.corners.get(feature)?;
    Some(SeenPoint { corner, depth: frame.corner_depths.get(feature).copied().flatten() })
}

fn seen_line(frame: &Frame, feature: usize) -> Option<SeenLine<'_>> {
    let line = frame.lines.get(feature)?;
    Some(SeenLine { feature: line, in_space: frame.lines_in_space.get(feature)?.as_ref() })
}
