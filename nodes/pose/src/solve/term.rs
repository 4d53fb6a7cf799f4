//! The residual of an observation, and its derivatives by the pose.
//!
//! All errors are in standard deviations. The first two are of the image, the others of depths.

mod line;
mod point;
#[cfg(test)]
mod tests;

use geometry::CameraModel;
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

pub(crate) use line::LineTerm;
pub(crate) use point::PointTerm;

/// A point nearer to the camera than this is in no image: no focal length is as short.
const NEAREST_M: f64 = 0.05;
/// Errors of the image come first, as many for a point as for a line.
pub(crate) const PIXEL_ROWS: usize = 2;
/// Two ends of a line, each with a depth.
pub(crate) const MAX_ROWS: usize = 4;

/// A pose as points are moved by it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed {
    rotation: Matrix3<f64>,
    translation: Vector3<f64>,
}

impl Placed {
    pub(crate) fn new(camera_from_map: &Isometry3<f64>) -> Self {
        Self {
            rotation: camera_from_map.rotation.to_rotation_matrix().into_inner(),
            translation: camera_from_map.translation.vector,
        }
    }

    #[inline]
    pub(crate) fn rotation(&self) -> &Matrix3<f64> {
        &self.rotation
    }

    #[inline]
    fn in_camera(&self, in_map_m: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * in_map_m + self.translation
    }
}

/// An observation whose numbers can be used.
pub(crate) trait Term {
    /// How many errors it has.
    fn rows(&self) -> usize;

    /// The errors at a pose. `None` where the pose has it behind the camera.
    fn errors(&self, camera: &CameraModel, pose: &Placed) -> Option<Errors>;

    /// The same, with their derivatives.
    fn block(&self, camera: &CameraModel, pose: &Placed) -> Option<Block>;
}

/// The errors of an observation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Errors {
    /// The sum of the squared errors in the image.
    pub(crate) pixel_chi2: f64,
    /// The sum of all.
    pub(crate) chi2: f64,
}

/// The errors of an observation with their derivatives by the perturbation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    errors: [f64; MAX_ROWS],
    jacobian: [[f64; 6]; MAX_ROWS],
    rows: usize,
}

impl Block {
    /// The first rows, each an error and its derivatives.
    #[inline]
    pub(crate) fn rows(&self, most: usize) -> impl Iterator<Item = (f64, &[f64; 6])> {
        let rows = self.rows.min(most);
        self.errors.iter().copied().zip(&self.jacobian).take(rows)
    }

    /// The sum of the squared errors of the first rows.
    #[inline]
    pub(crate) fn chi2(&self, most: usize) -> f64 {
        self.rows(most).map(|(error, _)| error * error).sum()
    }
}

/// The derivative by the perturbation of what changes by `by_place` as a point moves: the point moves by `v + w x p`.
#[inline]
fn by_perturbation(place: &Vector3<f64>, by_place: &Vector3<f64>) -> [f64; 6] {
    let turn = place.cross(by_place);
    [by_place.x, by_place.y, by_place.z, turn.x, turn.y, turn.z]
}

/// Whether a standard deviation can be divided by.
fn is_std_dev(value: f64) -> bool {
    value.is_finite() && value.recip().is_finite() && value > 0.0
}

fn is_finite_point(point: &Point3<f64>) -> bool {
    point.iter().all(|value| value.is_finite())
}
