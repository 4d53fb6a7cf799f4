//! A cloud of points.

use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

use crate::{Stamp, rigid::RigidTransform};

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

/// A cloud with the colours of its points.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct ColouredCloud {
    /// The points.
    pub cloud: Cloud,
    /// Red, green and blue of each point, [`NO_COLOUR`](crate::NO_COLOUR) where none was seen; none at all where the cloud has no
    /// colours.
    pub colours: Vec<[u8; 3]>,
}

impl Cloud {
    /// The cloud in another frame.
    #[must_use]
    pub fn transformed(
        mut self,
        target_from_cloud: &Isometry3<f64>,
        target_frame_id: &str,
    ) -> Self {
        let transform = RigidTransform::new(target_from_cloud);
        for point in &mut self.points_m {
            *point = Point3::from(transform.apply([point.x, point.y, point.z]));
        }
        target_frame_id.clone_into(&mut self.frame_id);
        self
    }
}

/// Whether a point is somewhere: a cloud from outside may hold points without a number.
#[must_use]
pub fn is_finite(point_m: &Point3<f32>) -> bool {
    point_m.iter().all(|value_m| value_m.is_finite())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::pose_from_vector;

    #[test]
    fn the_optical_axis_becomes_the_forward_axis() {
        // The default of `rig_from_camera`: the camera's optical frame seen from the rig.
        let rig_from_camera = pose_from_vector(&[0.0, 0.0, 0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2]);
        let cloud = Cloud {
            stamp: Stamp::from_nanos(7),
            frame_id: "camera".to_owned(),
            points_m: vec![Point3::new(1.0, 2.0, 3.0)],
        };
        let in_rig = cloud.clone().transformed(&rig_from_camera, "rig");
        assert_eq!((in_rig.stamp, in_rig.frame_id.as_str()), (cloud.stamp, "rig"));
        assert!((in_rig.points_m[0] - Point3::new(3.0, -1.0, -2.0)).norm() < 1e-6);
        let again = in_rig.clone().transformed(&rig_from_camera.inverse(), "camera");
        assert!((again.points_m[0] - cloud.points_m[0]).norm() < 1e-6);
    }
}
