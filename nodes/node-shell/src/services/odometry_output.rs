//! The output of an odometry for each pose: `pose`, `odom`, `/tf` and `path`.

use std::collections::VecDeque;

use geometry::{Stamp, StampedPose};
use msgs::convert;
use msgs::geometry_msgs::{PoseStamped, PoseWithCovariance, Twist, TwistWithCovariance, Vector3};
use msgs::nav_msgs::{Odometry, Path};
use msgs::std_msgs::Header;
use nalgebra::{Isometry3, Matrix6, Vector3 as Vector};

use super::transforms::TransformBroadcaster;
use crate::endpoints::publisher::Publisher;
use crate::node::Node;
use crate::settings::qos::Qos;
use crate::wire::error::ShellError;

/// Poses that a subscriber may be behind without losing one.
const POSES_KEPT: usize = 100;
/// A path is sent no more often: it grows with each pose.
const PATH_PERIOD_S: f64 = 1.0;
/// The variance of an unknown velocity, in m^2/s^2 and rad^2/s^2: no platform is as fast as its root.
const UNKNOWN_VARIANCE: f64 = 1e4;

/// The frames of an odometry (REP 105).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct OdometryFrames {
    /// The frame that poses lead to.
    pub odom_frame_id: String,
    /// The frame of the rig or vehicle.
    pub base_frame_id: String,
    /// The frame of the map, where there is one.
    pub map_frame_id: String,
}

/// A pose as it is published.
#[derive(Clone, Copy, Debug)]
pub struct PublishedPose<'a> {
    /// That of the data it was computed from.
    pub stamp: Stamp,
    /// The rig in the odom frame.
    pub odom_from_base: &'a Isometry3<f64>,
    /// Of that, as REP 103 and `geometry_msgs/PoseWithCovariance` have it: the shift along the axes of the odom frame, the
    /// turn about them at the rig.
    pub covariance: &'a Matrix6<f64>,
    /// The independent error of one pose, along the axes of the rig: the error of the velocity between two of them.
    pub covariance_in_base: &'a Matrix6<f64>,
    /// Where the odom frame is in the map.
    pub map_from_odom: MapFromOdom<'a>,
}

/// Where the odom frame is in the map.
#[derive(Clone, Copy, Debug)]
pub enum MapFromOdom<'a> {
    /// There is no map: `pose` and `path` are in the odom frame.
    NoMap,
    /// Not known yet: `odom` and its transform alone are published. A `pose` in the odom frame would have a map that is loaded begun
    /// anew.
    NotFound,
    /// `pose` and `path` are in the map's frame, and `/tf` has this.
    Found(&'a Isometry3<f64>),
}

/// The publishers of an odometry.
pub struct OdometryOutput {
    poses: Publisher<PoseStamped>,
    odometry: Publisher<Odometry>,
    transforms: Option<TransformBroadcaster>,
    paths: Publisher<Path>,
    frames: OdometryFrames,
    path: VecDeque<PoseStamped>,
    path_poses: usize,
    path_sent: Option<Stamp>,
    last: Option<(Stamp, Isometry3<f64>)>,
}

impl OdometryOutput {
    /// Publishes to `pose`, `odom` and `path`, reliable, and to `/tf` where that is wanted. The path holds the last
    /// `path_poses`.
    ///
    /// # Errors
    /// When a publisher cannot be had.
    pub fn new(
        node: &Node,
        frames: OdometryFrames,
        publish_tf: bool,
        path_poses: usize,
    ) -> Result<Self, ShellError> {
        let qos = Qos::reliable(POSES_KEPT);
        Ok(Self {
            poses: node.publisher("pose", &qos)?,
            odometry: node.publisher("odom", &qos)?,
            transforms: publish_tf.then(|| TransformBroadcaster::new(node)).transpose()?,
            paths: node.publisher("path", &Qos::reliable(1))?,
            frames,
            path: VecDeque::new(),
            path_poses,
            path_sent: None,
            last: None,
        })
    }

    /// How many poses the path has, and how many it may have.
    #[must_use]
    pub fn path_fill(&self) -> (usize, usize) {
        (self.path.len(), self.path_poses)
    }

    /// The motion is unknown from now on: the next pose has no velocity.
    pub fn interrupt(&mut self) {
        self.last = None;
    }

    /// The path begins anew, too.
    pub fn reset(&mut self) {
        self.interrupt();
        self.path.clear();
        self.path_sent = None;
    }

    /// Publishes a pose.
    pub fn publish(&mut self, pose: &PublishedPose<'_>) {
        let PublishedPose { stamp, odom_from_base, map_from_odom, .. } = *pose;
        let OdometryFrames { odom_frame_id, base_frame_id, map_frame_id } = &self.frames;
        if let Some(transforms) = &self.transforms {
            transforms.send(stamp, odom_frame_id, base_frame_id, odom_from_base);
            if let MapFromOdom::Found(map_from_odom) = map_from_odom {
                transforms.send(stamp, map_frame_id, odom_frame_id, map_from_odom);
            }
        }
        self.odometry.publish_or_warn(self.odometry(pose));
        self.last = Some((stamp, *odom_from_base));
        match map_from_odom {
            MapFromOdom::NoMap => self.publish_pose(stamp, odom_frame_id.clone(), odom_from_base),
            MapFromOdom::NotFound => {}
            MapFromOdom::Found(map_from_odom) => {
                let map_from_base = map_from_odom * odom_from_base;
                self.publish_pose(stamp, map_frame_id.clone(), &map_from_base);
            }
        }
    }

    fn publish_pose(&mut self, stamp: Stamp, frame_id: String, frame_from_base: &Isometry3<f64>) {
        let map_from_rig = *frame_from_base;
        let message = convert::message_from_pose(&StampedPose { stamp, frame_id, map_from_rig });
        self.path.push_back(message.clone());
        while self.path.len() > self.path_poses {
            self.path.pop_front();
        }
        let path_header = message.header.clone();
        self.poses.publish_or_warn(message);
        self.publish_path(stamp, path_header);
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

    fn odometry(&self, pose: &PublishedPose<'_>) -> Odometry {
        Odometry {
            header: Header {
                stamp: convert::time_from_stamp(pose.stamp),
                frame_id: self.frames.odom_frame_id.clone(),
            },
            child_frame_id: self.frames.base_frame_id.clone(),
            pose: PoseWithCovariance {
                pose: convert::pose_from_isometry(pose.odom_from_base),
                covariance: convert::covariance_by_rows(pose.covariance),
            },
            twist: self.twist(pose),
        }
    }

    /// The mean velocity since the last pose, along the rig's axes; nothing is known of it at the first one.
    fn twist(&self, pose: &PublishedPose<'_>) -> TwistWithCovariance {
        let elapsed = self.last.map(|(stamp, last)| (pose.stamp.seconds_since(stamp), last));
        let Some((elapsed_s, last)) = elapsed.filter(|(elapsed_s, _)| *elapsed_s > 0.0) else {
            return TwistWithCovariance {
                twist: Twist::default(),
                covariance: convert::covariance_by_rows(&(UNKNOWN_VARIANCE * Matrix6::identity())),
            };
        };
        let motion = last.inverse() * pose.odom_from_base;
        let shift = motion.translation.vector / elapsed_s;
        let turn = motion.rotation.scaled_axis() / elapsed_s;
        // Both poses were measured against the same map: what they are off by on their own.
        let covariance = 2.0 * pose.covariance_in_base / elapsed_s.powi(2);
        let vector = |v: Vector<f64>| Vector3 { x: v.x, y: v.y, z: v.z };
        TwistWithCovariance {
            twist: Twist { linear: vector(shift), angular: vector(turn) },
            covariance: convert::covariance_by_rows(&covariance),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Host, RosArguments};

    #[test]
    fn the_path_has_the_latest_poses() {
        let arguments = RosArguments::parse(Vec::<String>::new()).unwrap();
        let node = Host::in_process().node("pose", &arguments).unwrap();
        let name = |name: &str| name.to_owned();
        let frames = OdometryFrames {
            odom_frame_id: name("odom"),
            base_frame_id: name("base_link"),
            map_frame_id: name("map"),
        };
        let mut output = OdometryOutput::new(&node, frames, false, 3).unwrap();
        for second in 0..10 {
            output.publish(&PublishedPose {
                stamp: Stamp::from_nanos(second * 1_000_000_000),
                odom_from_base: &Isometry3::translation(second as f64, 0.0, 0.0),
                covariance: &Matrix6::identity(),
                covariance_in_base: &Matrix6::identity(),
                map_from_odom: MapFromOdom::NoMap,
            });
        }
        assert_eq!(output.path_fill(), (3, 3));
        let along_m: Vec<f64> = output.path.iter().map(|pose| pose.pose.position.x).collect();
        assert_eq!(along_m, [7.0, 8.0, 9.0]);
    }
}
