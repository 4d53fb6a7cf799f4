//! Subscriptions to a pose node in this process: its poses and its reports, collected.

use std::collections::BTreeMap;

use msgs::geometry_msgs::PoseStamped;
use msgs::stillmap_msgs::StageReport;
use nalgebra::{Point3, distance};
use node_shell::{Counters, Node, NodeFailure, Qos, Subscription};

/// Poses and reports that one message may cause.
const KEPT: usize = 100;

/// The subscriptions, and what they received.
pub(crate) struct PoseListener {
    counters: Counters,
    pose_subscription: Subscription<PoseStamped>,
    report_subscription: Subscription<StageReport>,
    poses: Vec<PoseStamped>,
    reports: Vec<StageReport>,
}

impl PoseListener {
    /// Subscribes to the topics of `node`, whose name is `name`, with subscriptions of `beside`.
    pub(crate) fn new(node: &Node, name: &str, beside: &Node) -> Result<Self, NodeFailure> {
        let qos = Qos::reliable(KEPT);
        Ok(Self {
            counters: node.counters(),
            pose_subscription: beside.subscription("pose", &qos)?,
            report_subscription: beside.subscription(&format!("{name}/report"), &qos)?,
            poses: Vec::new(),
            reports: Vec::new(),
        })
    }

    /// Takes the messages that have arrived since the last call, and returns them.
    pub(crate) fn receive(&mut self) -> (&[PoseStamped], &[StageReport]) {
        let (poses, reports) = (self.poses.len(), self.reports.len());
        while let Some(received) = self.pose_subscription.try_next() {
            self.poses.push((*received.message).clone());
        }
        while let Some(received) = self.report_subscription.try_next() {
            self.reports.push((*received.message).clone());
        }
        (
            self.poses.get(poses..).unwrap_or_default(),
            self.reports.get(reports..).unwrap_or_default(),
        )
    }

    /// The poses so far.
    pub(crate) fn poses(&self) -> &[PoseStamped] {
        &self.poses
    }

    /// The reports so far.
    pub(crate) fn reports(&self) -> &[StageReport] {
        &self.reports
    }

    /// The numbers of unusable messages, by cause.
    pub(crate) fn drops(&self) -> BTreeMap<String, u64> {
        self.counters.drops()
    }
}

/// How long the way from pose to pose is.
pub(crate) fn path_m(poses: &[PoseStamped]) -> f64 {
    let place = |pose: &PoseStamped| {
        let place = &pose.pose.position;
        Point3::new(place.x, place.y, place.z)
    };
    let steps = poses.iter().zip(poses.iter().skip(1));
    // The sum of nothing is -0.
    steps
        .map(|(from, to)| distance(&place(from), &place(to)))
        .fold(0.0, |path_m, step_m| path_m + step_m)
}
