//! What is told of a pose.

use std::collections::VecDeque;

use geometry::{Stamp, StampedPose};
use msgs::convert;
use msgs::geometry_msgs::{
    Pose, PoseStamped, PoseWithCovariance, Twist, TwistWithCovariance, Vector3,
};
use msgs::nav_msgs::{Odometry, Path};
use msgs::std_msgs::Header;
use nalgebra::{Isometry3, Matrix6, Vector3 as Vector};
use node_shell::{Node, NodeFailure, Publisher, Qos, TransformBroadcaster};

use super::frames::Frames;
use super::parameters::PoseParameters;
use super::smoothing::Smoothing;
use crate::tracking::CameraPose;

/// Poses that a subscriber may be behind without losing one.
const POSES_KEPT: usize = 100;
/// The variance of a velocity that nothing is known of, in m^2/s^2 and rad^2/s^2: nobody is as fast as its root.
const UNKNOWN_VARIANCE: f64 = 1e4;
/// A path is sent no more often: it grows with each pose.
const PATH_PERIOD_S: f64 = 1.0;

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
    smoothing: Smoothing,
    last: Option<(Stamp, Isometry3<f64>)>,
}

impl Output {
    pub(super) fn new(node: &Node, parameters: &PoseParameters) -> Result<Self, NodeFailure> {
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
            smoothing: Smoothing::new(parameters.smoothing_poses),
            last: None,
        })
    }

    pub(super) fn frames(&self) -> &Frames {
        &self.frames
    }

    /// What was known of the motion is not any more: the next pose begins anew.
    pub(super) fn interrupt(&mut self) {
        self.smoothing.clear();
        self.last = None;
    }

    /// The path begins anew, too, in a map that is there, or in one that is to be made.
    pub(super) fn reset(&mut self, world_from_map: Option<&Isometry3<f64>>) {
        self.interrupt();
        self.frames.begin(world_from_map);
        self.path.clear();
        self.path_sent = None;
    }

    /// Tells a pose of the camera in the tracker's frame; with a map in that of the map, too.
    pub(super) fn publish(&mut self, pose: &CameraPose, map_from_odom: Option<&Isometry3<f64>>) {
        let odom_from_rig = self.smoothing.smoothed(self.frames.odom_from_rig(pose));
        let header = self.frames.header(pose.stamp);
        let map_from_odom = map_from_odom.map(|tie| self.frames.tied(tie));
        self.frames.map_from_odom = map_from_odom.unwrap_or(self.frames.map_from_odom);
        let stamped = match &map_from_odom {
            Some(map_from_odom) => StampedPose {
                stamp: pose.stamp,
                frame_id: self.frames.map_frame_id.clone(),
                map_from_rig: map_from_odom * odom_from_rig,
            },
            None => StampedPose {
                stamp: pose.stamp,
                frame_id: self.frames.odom_frame_id.clone(),
                map_from_rig: odom_from_rig,
            },
        };
        let message = convert::message_from_pose(&stamped);
        self.path.push_back(message.clone());
        while self.path.len() > self.path_poses {
            self.path.pop_front();
        }
        if let Some(transforms) = &self.transforms {
            let Frames { odom_frame_id, map_frame_id, base_frame_id, .. } = &self.frames;
            transforms.send(pose.stamp, odom_frame_id, base_frame_id, &odom_from_rig);
            if let Some(map_from_odom) = &map_from_odom {
                transforms.send(pose.stamp, map_frame_id, odom_frame_id, map_from_odom);
            }
        }
        let path_header = message.header.clone();
        self.odometry.publish_or_warn(self.odometry(pose, &odom_from_rig, header));
        self.poses.publish_or_warn(message);
        self.publish_path(pose.stamp, path_header);
        self.last = Some((pose.stamp, odom_from_rig));
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
        pose: &CameraPose,
        odom_from_rig: &Isometry3<f64>,
        header: Header,
    ) -> Odometry {
        let turned = self.frames.pose_covariance(pose);
        let pose_message: Pose = convert::pose_from_isometry(odom_from_rig);
        Odometry {
            header,
            child_frame_id: self.frames.base_frame_id.clone(),
            pose: PoseWithCovariance {
                pose: pose_message,
                covariance: convert::covariance_by_rows(&turned),
            },
            twist: self.twist(pose, odom_from_rig),
        }
    }

    /// The mean velocity since the last pose, along the rig's axes; nothing is known of it at the first one.
    fn twist(&self, pose: &CameraPose, odom_from_rig: &Isometry3<f64>) -> TwistWithCovariance {
        let elapsed = self.last.map(|(stamp, last)| (pose.stamp.seconds_since(stamp), last));
        let Some((elapsed_s, last)) = elapsed.filter(|(elapsed_s, _)| *elapsed_s > 0.0) else {
            return TwistWithCovariance {
                twist: Twist::default(),
                covariance: convert::covariance_by_rows(&(UNKNOWN_VARIANCE * Matrix6::identity())),
            };
        };
        let motion = last.inverse() * odom_from_rig;
        let shift = motion.translation.vector / elapsed_s;
        let turn = motion.rotation.scaled_axis() / elapsed_s;
        // Both poses were measured against the same map: what they are off by on their own.
        let covariance = 2.0 * self.frames.in_rig(&pose.frame_covariance) / elapsed_s.powi(2);
        let vector = |v: Vector<f64>| Vector3 { x: v.x, y: v.y, z: v.z };
        TwistWithCovariance {
            twist: Twist { linear: vector(shift), angular: vector(turn) },
            covariance: convert::covariance_by_rows(&covariance),
        }
    }
}
