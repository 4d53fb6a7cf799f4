//! The frames of published poses: from the camera in its map to the rig in the frame of the odometry.

use estimation::covariance::propagated;
use nalgebra::{Isometry3, Matrix6};

use super::parameters::PoseParameters;
use crate::tracking::CameraPose;

/// How the camera in its map is the rig in the frame of the odometry.
#[derive(Clone, Debug)]
pub(super) struct Frames {
    pub(super) odom_frame_id: String,
    pub(super) map_frame_id: String,
    /// Whether there is a map: poses are published in its frame.
    has_map: bool,
    /// Where the frame of the odometry is in that of the map, as far as it is known.
    pub(super) map_from_odom: Isometry3<f64>,
    camera_from_rig: Isometry3<f64>,
    /// The tracker's map is the camera's frame at the first image.
    pub(super) odom_from_map: Isometry3<f64>,
    /// The map of keyframes is the camera's frame at the first image when the map was made: its pose in `map_frame_id`.
    world_from_map: Isometry3<f64>,
}

impl Frames {
    pub(super) fn new(parameters: &PoseParameters) -> Self {
        let rig_from_camera = parameters.rig_from_camera();
        let odom_from_map = geometry::pose_from_vector(&parameters.initial_pose) * rig_from_camera;
        Self {
            odom_frame_id: parameters.odom_frame_id.clone(),
            map_frame_id: parameters.map_frame_id.clone(),
            has_map: parameters.slam,
            map_from_odom: Isometry3::identity(),
            camera_from_rig: rig_from_camera.inverse(),
            odom_from_map,
            world_from_map: odom_from_map,
        }
    }

    /// A map of which this is known, or one that begins with the odometry.
    pub(super) fn begin(&mut self, world_from_map: Option<&Isometry3<f64>>) {
        self.map_from_odom = Isometry3::identity();
        self.world_from_map = world_from_map.copied().unwrap_or(self.odom_from_map);
    }

    /// Where the map of keyframes is in `map_frame_id`.
    pub(super) fn world_from_map(&self) -> &Isometry3<f64> {
        &self.world_from_map
    }

    /// The frame that poses are published in.
    pub(super) fn pose_frame_id(&self) -> &str {
        if self.has_map { &self.map_frame_id } else { &self.odom_frame_id }
    }

    /// Where the tracker's frame is in it.
    pub(super) fn pose_frame_from_tracker(&self) -> Isometry3<f64> {
        self.map_from_odom * self.odom_from_map
    }

    pub(super) fn odom_from_rig(&self, pose: &CameraPose) -> Isometry3<f64> {
        self.rig_of(&pose.camera_from_map)
    }

    /// The rig, by the camera in the tracker's frame.
    fn rig_of(&self, camera_from_map: &Isometry3<f64>) -> Isometry3<f64> {
        self.odom_from_map * camera_from_map.inverse() * self.camera_from_rig
    }

    /// The rig in `map_frame_id`, by the camera in the map of keyframes.
    pub(super) fn map_from_rig(&self, camera_from_map: &Isometry3<f64>) -> Isometry3<f64> {
        self.world_from_map * camera_from_map.inverse() * self.camera_from_rig
    }

    /// How the two frames are tied, by how those of the camera are.
    pub(super) fn tied(&self, tie: &Isometry3<f64>) -> Isometry3<f64> {
        self.world_from_map * tie * self.odom_from_map.inverse()
    }

    /// The covariance as REP 103 and `geometry_msgs/PoseWithCovariance` have it: the shift along the axes of the odometry's
    /// frame, the turn about them at the rig.
    pub(super) fn pose_covariance(&self, pose: &CameraPose) -> Matrix6<f64> {
        let odom_from_camera = self.odom_from_map * pose.camera_from_map.inverse();
        self.turned(&odom_from_camera, &pose.covariance)
    }

    /// Along the rig's own axes.
    pub(super) fn in_rig(&self, covariance: &Matrix6<f64>) -> Matrix6<f64> {
        self.turned(&self.camera_from_rig.inverse(), covariance)
    }

    /// A perturbation `[v; w]` of `camera_from_map` shifts the rig by `-(v + w x r)` and turns it by `-w`, both along the
    /// camera's axes, where `r` is the rig's place in the camera frame.
    fn turned(
        &self,
        target_from_camera: &Isometry3<f64>,
        covariance: &Matrix6<f64>,
    ) -> Matrix6<f64> {
        let rotation = target_from_camera.rotation.to_rotation_matrix().into_inner();
        let lever = rotation * self.camera_from_rig.translation.vector.cross_matrix();
        let mut slopes = Matrix6::zeros();
        slopes.fixed_view_mut::<3, 3>(0, 0).copy_from(&-rotation);
        slopes.fixed_view_mut::<3, 3>(0, 3).copy_from(&lever);
        slopes.fixed_view_mut::<3, 3>(3, 3).copy_from(&-rotation);
        propagated(&slopes, covariance)
    }
}

#[cfg(test)]
mod tests {
    use estimation::perturbation::left::perturbed;
    use geometry::Stamp;
    use nalgebra::{Vector3 as Vector, Vector6};

    use super::*;

    #[test]
    fn the_covariance_of_the_rig_is_what_its_poses_scatter_by() {
        let parameters = PoseParameters {
            rig_from_camera: [0.3, -0.2, 0.5, -1.4, 0.1, -1.6],
            initial_pose: [1.0, 2.0, 0.0, 0.7, 0.0, 0.0],
            ..PoseParameters::default()
        };
        let frames = Frames::new(&parameters);
        let camera_from_map =
            Isometry3::new(Vector::new(0.2, 0.1, -0.4), Vector::new(0.3, -0.5, 0.2));
        let pose = |camera_from_map, covariance| CameraPose {
            stamp: Stamp::from_nanos(0),
            camera_from_map,
            covariance,
            frame_covariance: covariance,
        };
        // The covariance of one perturbation alone is the square of what it does.
        for axis in 0..6 {
            const SMALL: f64 = 1e-6;
            let mut perturbation = Vector6::zeros();
            perturbation[axis] = SMALL;
            let covariance = perturbation * perturbation.transpose();
            let at = pose(camera_from_map, covariance);
            let moved = pose(perturbed(&camera_from_map, &perturbation), covariance);
            let (before, after) = (frames.odom_from_rig(&at), frames.odom_from_rig(&moved));
            let shift = after.translation.vector - before.translation.vector;
            let turn = (after.rotation * before.rotation.inverse()).scaled_axis();
            let done = Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z);
            let converted = frames.pose_covariance(&at);
            assert!(
                (converted - done * done.transpose()).amax() < 1e-6 * SMALL * SMALL.sqrt(),
                "{axis}"
            );
        }
    }
}
