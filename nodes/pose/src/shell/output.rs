//! What is told of a pose.

use std::collections::VecDeque;

use geometry::{Stamp, StampedPose};
use msgs::convert;
use msgs::geometry_msgs::{
    Pose, PoseStamped, PoseWithCovariance, Twist, TwistWithCovariance, Vector3,
};
use msgs::nav_msgs::{Odometry, Path};
use msgs::std_msgs::Header;
use nalgebra::{
    Isometry3, Matrix6, Quaternion, Translation3, UnitQuaternion, Vector3 as Vector, Vector4,
};
use node_shell::{Node, NodeFailure, Publisher, Qos, TransformBroadcaster};

use super::parameters::PoseParameters;
use crate::tracking::CameraPose;

/// Poses that a subscriber may be behind without losing one.
const POSES_KEPT: usize = 100;
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

/// How the camera in its map is the rig in the frame of the odometry.
#[derive(Clone, Debug)]
pub(super) struct Frames {
    pub(super) odom_frame_id: String,
    pub(super) map_frame_id: String,
    /// Whether there is a map: poses are told in its frame.
    has_map: bool,
    /// Where the frame of the odometry is in that of the map, as far as it is known.
    map_from_odom: Isometry3<f64>,
    base_frame_id: String,
    camera_from_rig: Isometry3<f64>,
    /// The tracker's map is the camera's frame at the first image.
    pub(super) odom_from_map: Isometry3<f64>,
    /// The map of keyframes is the camera's frame at the first image of who made it: where that is in `map_frame_id`.
    world_from_map: Isometry3<f64>,
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

/// The variance of a velocity that nothing is known of, in m^2/s^2 and rad^2/s^2: nobody is as fast as its root.
const UNKNOWN_VARIANCE: f64 = 1e4;

impl Frames {
    pub(super) fn new(parameters: &PoseParameters) -> Self {
        let rig_from_camera = parameters.rig_from_camera();
        let odom_from_map = geometry::pose_from_vector(&parameters.initial_pose) * rig_from_camera;
        Self {
            odom_frame_id: parameters.odom_frame_id.clone(),
            map_frame_id: parameters.map_frame_id.clone(),
            has_map: parameters.slam,
            map_from_odom: Isometry3::identity(),
            base_frame_id: parameters.base_frame_id.clone(),
            camera_from_rig: rig_from_camera.inverse(),
            odom_from_map,
            world_from_map: odom_from_map,
        }
    }

    /// A map of which this is known, or one that begins with the odometry.
    fn begin(&mut self, world_from_map: Option<&Isometry3<f64>>) {
        self.map_from_odom = Isometry3::identity();
        self.world_from_map = world_from_map.copied().unwrap_or(self.odom_from_map);
    }

    /// Where the map of keyframes is in `map_frame_id`.
    pub(super) fn world_from_map(&self) -> &Isometry3<f64> {
        &self.world_from_map
    }

    /// The frame that poses are told in.
    pub(super) fn pose_frame_id(&self) -> &str {
        if self.has_map { &self.map_frame_id } else { &self.odom_frame_id }
    }

    /// Where the tracker's frame is in it.
    pub(super) fn pose_frame_from_tracker(&self) -> Isometry3<f64> {
        self.map_from_odom * self.odom_from_map
    }

    fn header(&self, stamp: Stamp) -> Header {
        Header { stamp: convert::time_from_stamp(stamp), frame_id: self.odom_frame_id.clone() }
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
    fn tied(&self, tie: &Isometry3<f64>) -> Isometry3<f64> {
        self.world_from_map * tie * self.odom_from_map.inverse()
    }

    /// The covariance as REP 103 and `geometry_msgs/PoseWithCovariance` have it: the shift along the axes of the odometry's
    /// frame, the turn about them at the rig.
    pub(super) fn pose_covariance(&self, pose: &CameraPose) -> Matrix6<f64> {
        let odom_from_camera = self.odom_from_map * pose.camera_from_map.inverse();
        self.turned(&odom_from_camera, &pose.covariance)
    }

    /// Along the rig's own axes.
    fn in_rig(&self, covariance: &Matrix6<f64>) -> Matrix6<f64> {
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
        slopes * covariance * slopes.transpose()
    }
}

/// The mean of the last poses.
#[derive(Clone, Debug)]
struct Smoothing {
    poses: VecDeque<Isometry3<f64>>,
    length: usize,
}

impl Smoothing {
    fn new(length: usize) -> Self {
        Self { poses: VecDeque::new(), length: length.max(1) }
    }

    fn clear(&mut self) {
        self.poses.clear();
    }

    fn smoothed(&mut self, pose: Isometry3<f64>) -> Isometry3<f64> {
        self.poses.push_back(pose);
        while self.poses.len() > self.length {
            self.poses.pop_front();
        }
        if self.poses.len() == 1 {
            return pose;
        }
        let count = self.poses.len() as f64;
        let shift = self.poses.iter().map(|pose| pose.translation.vector).sum::<Vector<f64>>();
        // Of rotations that are near each other the normalised sum of the quaternions is the mean, in one hemisphere.
        let reference = pose.rotation.coords;
        let sum: Vector4<f64> = self
            .poses
            .iter()
            .map(|pose| pose.rotation.coords * reference.dot(&pose.rotation.coords).signum())
            .sum();
        let rotation = UnitQuaternion::from_quaternion(Quaternion::from_vector(sum));
        Isometry3::from_parts(Translation3::from(shift / count), rotation)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector6;

    use super::*;
    use crate::solve::perturbation::{perturbation_between, perturbed};

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
            let told = frames.pose_covariance(&at);
            assert!(
                (told - done * done.transpose()).amax() < 1e-6 * SMALL * SMALL.sqrt(),
                "{axis}"
            );
        }
    }

    #[test]
    fn the_mean_of_poses_lies_between_them() {
        let mut smoothing = Smoothing::new(2);
        let pose = |x: f64, yaw: f64| Isometry3::new(Vector::x() * x, Vector::z() * yaw);
        assert_eq!(smoothing.smoothed(pose(0.0, 0.1)), pose(0.0, 0.1));
        let mean = smoothing.smoothed(pose(0.2, 0.3));
        assert!(perturbation_between(&mean, &pose(0.1, 0.2)).norm() < 1e-9);
        let later = smoothing.smoothed(pose(0.4, 0.5));
        assert!(perturbation_between(&later, &pose(0.3, 0.4)).norm() < 1e-9);
    }
}
