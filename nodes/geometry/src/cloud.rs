//! A cloud of points.

use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

use crate::Stamp;

/// Points of one moment in one frame. Every point is finite: what returned nothing has no point.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Cloud {
    /// When the points were measured.
    pub stamp: Stamp,
    /// The frame of the points.
    pub frame_id: String,
    /// The points.
    pub points_m: Vec<Point3<f32>>,
}

impl Cloud {
    /// The cloud in another frame.
    #[must_use]
    pub fn transformed(&self, target_from_cloud: &Isometry3<f64>, target_frame_id: &str) -> Self {
        let transform: Isometry3<f32> = target_from_cloud.cast();
        Self {
            stamp: self.stamp,
            frame_id: target_frame_id.to_owned(),
            points_m: self.points_m.iter().map(|point| transform * point).collect(),
        }
    }
}
