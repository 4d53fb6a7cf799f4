//! The messages of a pose.

use estimation::covariance::{propagated, rotation_of_both};
use geometry::{Stamp, pose_from_vector};
use msgs::convert;
use msgs::std_msgs::Header;
use nalgebra::{Isometry3, Matrix6};
use node_shell::{MapFromOdom, Node, NodeFailure, OdometryFrames, OdometryOutput, PublishedPose};

use super::parameters::LidarOdometryParameters;
use crate::odometry::LidarPose;

/// The publishers of poses.
pub(super) struct Output {
    published: OdometryOutput,
    frames: Frames,
}

/// How the scanner in its own odometry is the vehicle in the frame that poses lead to.
#[derive(Clone, Debug)]
pub(super) struct Frames {
    pub(super) odom_frame_id: String,
    pub(super) base_frame_id: String,
    pub(super) base_from_lidar: Isometry3<f64>,
    /// The core's frame is the scanner's at the first scan.
    pub(super) odom_from_first: Isometry3<f64>,
}

impl Output {
    pub(super) fn new(
        node: &Node,
        parameters: &LidarOdometryParameters,
    ) -> Result<Self, NodeFailure> {
        let frames = OdometryFrames {
            odom_frame_id: parameters.odom_frame_id.clone(),
            base_frame_id: parameters.base_frame_id.clone(),
            map_frame_id: parameters.map_frame_id.clone(),
        };
        let (publish_tf, path_poses) = (parameters.publish_tf, parameters.path_poses);
        Ok(Self {
            published: OdometryOutput::new(node, frames, publish_tf, path_poses)?,
            frames: Frames::new(parameters),
        })
    }

    pub(super) fn frames(&self) -> &Frames {
        &self.frames
    }

    /// How many poses the path has, and how many it may have.
    pub(super) fn path_fill(&self) -> (usize, usize) {
        self.published.path_fill()
    }

    /// Everything begins anew.
    pub(super) fn forget(&mut self) {
        self.published.reset();
    }

    /// Publishes a pose of the scanner; gives that of the vehicle.
    pub(super) fn publish(&mut self, pose: &LidarPose) -> Isometry3<f64> {
        let odom_from_base = self.frames.odom_from_base(&pose.odom_from_lidar);
        let covariance = self.frames.pose_covariance(pose);
        let base_from_odom = odom_from_base.rotation.inverse().to_rotation_matrix().into_inner();
        self.published.publish(&PublishedPose {
            stamp: pose.stamp,
            odom_from_base: &odom_from_base,
            covariance: &covariance,
            covariance_in_base: &propagated(&rotation_of_both(&base_from_odom), &covariance),
            map_from_odom: MapFromOdom::NoMap,
        });
        odom_from_base
    }
}

impl Frames {
    pub(super) fn new(parameters: &LidarOdometryParameters) -> Self {
        let base_from_lidar = parameters.base_from_lidar();
        Self {
            odom_frame_id: parameters.odom_frame_id.clone(),
            base_frame_id: parameters.base_frame_id.clone(),
            base_from_lidar,
            odom_from_first: pose_from_vector(&parameters.initial_pose) * base_from_lidar,
        }
    }

    pub(super) fn header(&self, stamp: Stamp) -> Header {
        Header { stamp: convert::time_from_stamp(stamp), frame_id: self.odom_frame_id.clone() }
    }

    pub(super) fn odom_from_base(&self, first_from_lidar: &Isometry3<f64>) -> Isometry3<f64> {
        self.odom_from_first * first_from_lidar * self.base_from_lidar.inverse()
    }

    /// The covariance as REP 103 and `geometry_msgs/PoseWithCovariance` have it: the shift of the vehicle along the axes of
    /// the odometry's frame, its turn about them. A turn of the scanner shifts the vehicle, which lies beside it.
    fn pose_covariance(&self, pose: &LidarPose) -> Matrix6<f64> {
        let turn = self.odom_from_first.rotation.to_rotation_matrix().into_inner();
        let base =
            pose.odom_from_lidar.rotation * self.base_from_lidar.inverse().translation.vector;
        let mut slopes = rotation_of_both(&turn);
        slopes.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-turn * base.cross_matrix()));
        propagated(&slopes, &pose.covariance)
    }
}

#[cfg(test)]
mod tests {
    use estimation::perturbation::composite::{perturbation_between, perturbed};
    use nalgebra::{Vector3 as Vector, Vector6};

    use super::*;
    use crate::odometry::{Outcome, Quality};

    fn pose(odom_from_lidar: Isometry3<f64>, covariance: Matrix6<f64>) -> LidarPose {
        let quality = Quality {
            outcome: Outcome::Matched,
            points: 0,
            map_voxels: 0,
            reach_m: 0.0,
            iterations: 0,
            converged: true,
            overlap: 1.0,
            residual_rms_m: 0.0,
            unknown_s: 0.0,
            degenerate: Vec::new(),
        };
        LidarPose { stamp: Stamp::default(), odom_from_lidar, covariance, quality }
    }

    #[test]
    fn the_covariance_of_the_vehicle_is_what_its_poses_scatter_by() {
        let parameters = LidarOdometryParameters {
            base_from_lidar: [0.3, -0.2, 1.5, -1.4, 0.1, -0.6],
            initial_pose: [1.0, 2.0, 0.0, 0.7, 0.0, 0.2],
            ..LidarOdometryParameters::default()
        };
        let frames = Frames::new(&parameters);
        let lidar = Isometry3::new(Vector::new(0.2, 0.1, -0.4), Vector::new(0.3, -0.5, 0.2));
        // The covariance of one perturbation alone is the square of what it does.
        for axis in 0..6 {
            const SMALL: f64 = 1e-6;
            let mut perturbation = Vector6::zeros();
            perturbation[axis] = SMALL;
            let covariance = perturbation * perturbation.transpose();
            let before = frames.odom_from_base(&lidar);
            let after = frames.odom_from_base(&perturbed(&lidar, &perturbation));
            let done = perturbation_between(&before, &after);
            let converted = frames.pose_covariance(&pose(lidar, covariance));
            assert!((converted - done * done.transpose()).amax() < 1e-5 * SMALL * SMALL, "{axis}");
        }
    }

    #[test]
    fn the_vehicle_begins_where_it_is_said_to() {
        let parameters = LidarOdometryParameters {
            base_from_lidar: [0.0, 0.0, 1.5, 0.5, 0.0, 0.0],
            initial_pose: [4.0, 5.0, 6.0, 0.0, 0.0, 0.0],
            ..LidarOdometryParameters::default()
        };
        let at = Frames::new(&parameters).odom_from_base(&Isometry3::identity());
        assert!((at.translation.vector - Vector::new(4.0, 5.0, 6.0)).norm() < 1e-12, "{at}");
        assert!(at.rotation.angle() < 1e-9);
    }
}
