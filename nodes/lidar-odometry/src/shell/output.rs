//! What is told of a pose.

use std::collections::VecDeque;

use geometry::{Stamp, StampedPose, pose_from_vector};
use msgs::convert;
use msgs::geometry_msgs::{PoseStamped, PoseWithCovariance, Twist, TwistWithCovariance, Vector3};
use msgs::nav_msgs::{Odometry, Path};
use msgs::std_msgs::Header;
use nalgebra::{Isometry3, Matrix3, Matrix6, Vector3 as Vector};
use node_shell::{Node, NodeFailure, Publisher, Qos, TransformBroadcaster};

use super::parameters::LidarOdometryParameters;
use crate::odometry::LidarPose;

/// Poses that a subscriber may be behind without losing one.
const POSES_KEPT: usize = 100;
/// A path is sent no more often: it grows with each pose.
const PATH_PERIOD_S: f64 = 1.0;
/// The variance of a velocity that nothing is known of, in m^2/s^2 and rad^2/s^2: nobody is as fast as its root.
const UNKNOWN_VARIANCE: f64 = 1e4;

/// The publishers of poses.
pub(super) struct Output {
    poses: Publisher<PoseStamped>,
    odometry: Publisher<Odometry>,
    transforms: Option<TransformBroadcaster>,
    paths: Publisher<Path>,
    frames: Frames,
    path: VecDeque<PoseStamped>,
    path_poses: usize,
    path_sent: Option<Stamp>,
    last: Option<(Stamp, Isometry3<f64>)>,
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
        let qos = Qos::reliable(POSES_KEPT);
        let transforms =
            parameters.publish_tf.then(|| TransformBroadcaster::new(node)).transpose()?;
        Ok(Self {
            poses: node.publisher("pose", &qos)?,
            odometry: node.publisher("odom", &qos)?,
            transforms,
            paths: node.publisher("path", &Qos::reliable(1))?,
            frames: Frames::new(parameters),
            path: VecDeque::new(),
            path_poses: parameters.path_poses,
            path_sent: None,
            last: None,
        })
    }

    pub(super) fn frames(&self) -> &Frames {
        &self.frames
    }

    /// How many poses the path has, and how many it may have.
    pub(super) fn path_fill(&self) -> (usize, usize) {
        (self.path.len(), self.path_poses)
    }

    /// Everything begins anew.
    pub(super) fn forget(&mut self) {
        self.last = None;
        self.path.clear();
        self.path_sent = None;
    }

    /// Publishes a pose of the scanner; gives that of the vehicle.
    pub(super) fn publish(&mut self, pose: &LidarPose) -> Isometry3<f64> {
        let odom_from_base = self.frames.odom_from_base(&pose.odom_from_lidar);
        let header = self.frames.header(pose.stamp);
        let message = convert::message_from_pose(&StampedPose {
            stamp: pose.stamp,
            frame_id: self.frames.odom_frame_id.clone(),
            map_from_rig: odom_from_base,
        });
        self.path.push_back(message.clone());
        while self.path.len() > self.path_poses {
            self.path.pop_front();
        }
        if let Some(transforms) = &self.transforms {
            let Frames { odom_frame_id, base_frame_id, .. } = &self.frames;
            transforms.send(pose.stamp, odom_frame_id, base_frame_id, &odom_from_base);
        }
        self.odometry.publish_or_warn(self.odometry(pose, &odom_from_base, header.clone()));
        self.poses.publish_or_warn(message);
        self.publish_path(pose.stamp, header);
        self.last = Some((pose.stamp, odom_from_base));
        odom_from_base
    }

    fn publish_path(&mut self, stamp: Stamp, header: Header) {
        let since_s = |sent: Stamp| stamp.seconds_since(sent);
        let is_due =
            self.path_sent.is_none_or(|sent| !(0.0..PATH_PERIOD_S).contains(&since_s(sent)));
        if is_due && self.paths.subscriber_count() > 0 {
            self.path_sent = Some(stamp);
            self.paths.publish_or_warn(Path { header, poses: self.path.iter().cloned().collect() });
        }
    }

    fn odometry(
        &self,
        pose: &LidarPose,
        odom_from_base: &Isometry3<f64>,
        header: Header,
    ) -> Odometry {
        let covariance = self.frames.pose_covariance(pose);
        Odometry {
            header,
            child_frame_id: self.frames.base_frame_id.clone(),
            pose: PoseWithCovariance {
                pose: convert::pose_from_isometry(odom_from_base),
                covariance: convert::covariance_by_rows(&covariance),
            },
            twist: self.twist(pose.stamp, odom_from_base, &covariance),
        }
    }

    /// The mean velocity since the last pose, along the vehicle's axes; nothing is known of it at the first one.
    fn twist(
        &self,
        stamp: Stamp,
        odom_from_base: &Isometry3<f64>,
        covariance: &Matrix6<f64>,
    ) -> TwistWithCovariance {
        let elapsed = self.last.map(|(before, last)| (stamp.seconds_since(before), last));
        let Some((elapsed_s, last)) = elapsed.filter(|(elapsed_s, _)| *elapsed_s > 0.0) else {
            return TwistWithCovariance {
                twist: Twist::default(),
                covariance: convert::covariance_by_rows(&(UNKNOWN_VARIANCE * Matrix6::identity())),
            };
        };
        let motion = last.inverse() * odom_from_base;
        let shift = motion.translation.vector / elapsed_s;
        let turn = motion.rotation.scaled_axis() / elapsed_s;
        // Both poses were measured against the same map: what they are off by on their own.
        let along = blocks(&odom_from_base.rotation.inverse().to_rotation_matrix().into_inner());
        let covariance = 2.0 * along * covariance * along.transpose() / elapsed_s.powi(2);
        let vector = |v: Vector<f64>| Vector3 { x: v.x, y: v.y, z: v.z };
        TwistWithCovariance {
            twist: Twist { linear: vector(shift), angular: vector(turn) },
            covariance: convert::covariance_by_rows(&covariance),
        }
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
        let mut slopes = blocks(&turn);
        slopes.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-turn * base.cross_matrix()));
        slopes * pose.covariance * slopes.transpose()
    }
}

/// A turn of both halves of a perturbation.
fn blocks(turn: &Matrix3<f64>) -> Matrix6<f64> {
    let mut both = Matrix6::zeros();
    both.fixed_view_mut::<3, 3>(0, 0).copy_from(turn);
    both.fixed_view_mut::<3, 3>(3, 3).copy_from(turn);
    both
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector6;

    use super::*;
    use crate::odometry::{Outcome, Quality};
    use crate::registration::{perturbation_between, perturbed};

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
            let told = frames.pose_covariance(&pose(lidar, covariance));
            assert!((told - done * done.transpose()).amax() < 1e-5 * SMALL * SMALL, "{axis}");
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
