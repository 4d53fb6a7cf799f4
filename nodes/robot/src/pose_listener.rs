//! What a node of this process that finds poses says: its poses and its reports, gathered.

use std::collections::BTreeMap;

use msgs::geometry_msgs::PoseStamped;
use msgs::stillmap_msgs::StageReport;
use node_shell::{Counters, Node, NodeFailure, Qos, Subscription};

/// Poses and reports that one message may bring about.
const KEPT: usize = 100;

/// Hears a node.
pub(crate) struct PoseListener {
    counters: Counters,
    heard_poses: Subscription<PoseStamped>,
    heard_reports: Subscription<StageReport>,
    poses: Vec<PoseStamped>,
    reports: Vec<StageReport>,
}

impl PoseListener {
    /// Hears `node`, whose name is `name`, at `beside`.
    pub(crate) fn new(node: &Node, name: &str, beside: &Node) -> Result<Self, NodeFailure> {
        let qos = Qos::reliable(KEPT);
        Ok(Self {
            counters: node.counters(),
            heard_poses: beside.subscription("pose", &qos)?,
            heard_reports: beside.subscription(&format!("{name}/report"), &qos)?,
            poses: Vec::new(),
            reports: Vec::new(),
        })
    }

    /// Hears what has been said since; gives that.
    pub(crate) fn hear(&mut self) -> (&[PoseStamped], &[StageReport]) {
        let (poses, reports) = (self.poses.len(), self.reports.len());
        while let Some(received) = self.heard_poses.try_next() {
            self.poses.push((*received.message).clone());
        }
        while let Some(received) = self.heard_reports.try_next() {
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

    /// What the node said of each of its steps.
    pub(crate) fn reports(&self) -> &[StageReport] {
        &self.reports
    }

    /// What was of no use, by cause.
    pub(crate) fn drops(&self) -> BTreeMap<String, u64> {
        self.counters.drops()
    }
}
