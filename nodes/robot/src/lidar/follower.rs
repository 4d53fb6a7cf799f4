//! The node of LiDAR odometry in this process: it gets recorded messages, and its poses are collected.

use std::collections::BTreeMap;

use geometry::LidarCloud;
use lidar_odometry::shell::{LidarInput, LidarOdometryParameters, Stage};
use msgs::convert::{self, TimeUnit};
use msgs::geometry_msgs::PoseStamped;
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{Imu, PointCloud2};
use msgs::stillmap_msgs::StageReport;
use nalgebra::Isometry3;
use node_shell::{Host, Node, NodeFailure, Publisher, Qos, RosArguments};

use super::{NAMESPACE, NODE, Sensed};
use crate::pose_listener::PoseListener;

/// The node, with the publishers of its input and the subscriptions to its output.
pub struct LidarFollower {
    stage: Stage,
    listener: PoseListener,
    clouds: Publisher<PointCloud2>,
    imu: Publisher<Imu>,
    wheels: Publisher<Odometry>,
    base_from_lidar: Isometry3<f64>,
    unit: Option<TimeUnit>,
    /// Keeps the nodes alive, if this owns them.
    _host: Option<Host>,
}

/// The pose of a scan.
#[derive(Clone, Copy, Debug)]
pub struct FollowedScan {
    pub stamp: geometry::Stamp,
    pub odom_from_base: Isometry3<f64>,
    /// Whether it was measured with the scan; otherwise it is a prediction.
    pub is_measured: bool,
}

impl LidarFollower {
    /// A node in a host of its own.
    pub fn alone(parameters: &LidarOdometryParameters) -> Result<Self, NodeFailure> {
        let host = Host::in_process();
        let arguments = ["--ros-args", "-r", &format!("__ns:={NAMESPACE}")].map(str::to_owned);
        let arguments = RosArguments::parse(arguments)?;
        let (node, beside) = (host.node(NODE, &arguments)?, host.node("feed", &arguments)?);
        let mut follower = Self::new(&node, &beside, parameters)?;
        follower._host = Some(host);
        Ok(follower)
    }

    /// The odometry on `node`; `beside` publishes its input and subscribes to its output.
    pub fn new(
        node: &Node,
        beside: &Node,
        parameters: &LidarOdometryParameters,
    ) -> Result<Self, NodeFailure> {
        let parameters =
            LidarOdometryParameters { input: LidarInput::Points, ..parameters.clone() };
        let qos = Qos::sensor(1);
        Ok(Self {
            stage: Stage::new(node, &parameters)?.of_a_recording(),
            listener: PoseListener::new(node, NODE, beside)?,
            clouds: beside.publisher("points", &qos)?,
            imu: beside.publisher("imu", &qos)?,
            wheels: beside.publisher("wheels", &qos)?,
            base_from_lidar: geometry::pose_from_vector(&parameters.base_from_lidar),
            unit: parameters.unit(),
            _host: None,
        })
    }

    /// Passes a recorded message to the node; returns the pose that it caused, if any.
    pub fn take(&mut self, sensed: Sensed) -> Result<Option<FollowedScan>, NodeFailure> {
        match sensed {
            Sensed::Cloud(cloud) => drop(self.clouds.publish(cloud)?),
            // The node subscribes to these two only if its parameters say so.
            Sensed::Imu(imu) => drop(self.imu.publish(imu)?),
            Sensed::Wheels(wheels) => drop(self.wheels.publish(wheels)?),
            Sensed::Truth(..) => return Ok(None),
        }
        self.stage.take_waiting();
        let (poses, reports) = self.listener.receive();
        let is_held = reports.last().is_some_and(|report| {
            let mut named = report.count_names.iter().zip(&report.counts);
            named.any(|(name, count)| name == "held" && *count > 0)
        });
        let Some(pose) = poses.last() else { return Ok(None) };
        Ok(Some(FollowedScan {
            stamp: convert::stamp_from_time(pose.header.stamp),
            odom_from_base: convert::isometry_from_pose(&pose.pose)?,
            is_measured: !is_held,
        }))
    }

    /// A cloud as the node reads it; `None` if it cannot, which the node counts.
    pub fn cloud(&self, message: &PointCloud2) -> Option<LidarCloud> {
        convert::lidar_cloud_from_message(message, self.unit).ok().map(|reading| reading.cloud)
    }

    /// The poses of the vehicle so far.
    pub fn poses(&self) -> &[PoseStamped] {
        self.listener.poses()
    }

    /// The poses of the vehicle, corrected by all loops closed so far.
    pub fn final_poses(&self) -> Result<Vec<PoseStamped>, NodeFailure> {
        let closed = |pose: &PoseStamped| {
            let stamp = convert::stamp_from_time(pose.header.stamp);
            let odom_from_base = convert::isometry_from_pose(&pose.pose)?;
            let pose_in_map =
                convert::pose_from_isometry(&self.map_from_base(stamp, &odom_from_base));
            Ok(PoseStamped { header: pose.header.clone(), pose: pose_in_map })
        };
        self.poses().iter().map(closed).collect()
    }

    /// A pose of the odometry, corrected by all loops closed so far.
    pub fn map_from_base(
        &self,
        stamp: geometry::Stamp,
        odom_from_base: &Isometry3<f64>,
    ) -> Isometry3<f64> {
        let loops = self.stage.loops();
        loops.map_or(*odom_from_base, |loops| loops.map_from_vehicle(stamp, odom_from_base))
    }

    /// The number of closed loops.
    pub fn closed_loops(&self) -> usize {
        self.stage.loops().map_or(0, |known| known.closed)
    }

    /// Why the last doubtful pose is not to be trusted as others are.
    pub fn last_trouble(&self) -> Option<&str> {
        self.stage.last_trouble()
    }

    /// How the times of points were understood.
    pub fn point_times(&self) -> Option<String> {
        self.stage.point_times().map(|times| times.to_string())
    }

    /// The reports so far.
    pub fn reports(&self) -> &[StageReport] {
        self.listener.reports()
    }

    /// Why scans have no pose, by cause.
    pub fn drops(&self) -> BTreeMap<String, u64> {
        self.listener.drops()
    }

    /// What is lost of a recording whose time goes back.
    pub fn lost_after_the_end(&self) -> Option<String> {
        let back_s = self.stage.gone_back_s()?;
        let scans = self.drops().get(Stage::AFTER_THE_END).copied().unwrap_or_default();
        Some(format!(
            "the stamps of the scans go back by {back_s:.1} s after {} poses: the drive ends there, {scans} scans of another time are left \
             out",
            self.poses().len()
        ))
    }

    /// The pose of the scanner on the vehicle.
    pub fn base_from_lidar(&self) -> Isometry3<f64> {
        self.base_from_lidar
    }
}
