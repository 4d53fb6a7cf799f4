//! The surface in the depth image where a return is projected.

mod edge;
mod patch;
#[cfg(test)]
mod tests;

use geometry::{CameraModel, RayTable};
use nalgebra::{Point3, Vector3};

pub(crate) use edge::{EdgeSought, edge_at};
pub(crate) use patch::{ImageNoise, Patch};

/// How a depth camera sees; lens distortion is in the rays.
#[derive(Clone, Copy, Debug)]
pub struct DepthOptics<'a> {
    /// The camera.
    pub camera: &'a CameraModel,
    /// The rays of its pixels.
    pub rays: &'a RayTable,
}

/// A plane on which returns must lie: a piece of a surface, or, for an edge, the plane through the camera's
/// centre and the edge.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Surface {
    /// Its normal in the camera frame, of length 1.
    pub normal: Vector3<f64>,
    /// Its distance from the camera's centre along the normal.
    pub offset_m: f64,
    /// Standard deviation of that distance where it was looked for.
    pub std_dev_m: f64,
    /// Standard deviation of the normal's direction.
    pub normal_std_dev_rad: f64,
}

impl Surface {
    /// How far a point of the camera frame lies from the plane, along its normal.
    #[must_use]
    pub fn distance_m(&self, point_in_camera_m: &Point3<f64>) -> f64 {
        self.normal.dot(&point_in_camera_m.coords) - self.offset_m
    }
}
