//! Whether the nodes of a run have discovered each other, and this process.

use std::time::{Duration, Instant};

use super::{POLL_PERIOD, Run, pacing};
use crate::failure::Failure;
use crate::run::recorder::Stage;
use crate::visual;

/// The nodes must have discovered each other after this time, and then, after as long again, the player; on one host it takes a
/// fraction of a second, and on one that is out of CPU time half a minute.
pub(super) const LONGEST_DISCOVERY: Duration = Duration::from_secs(90);

impl Run {
    /// Waits until every node has discovered its publishers and subscribers, this process included; or until it is
    /// interrupted.
    pub(super) async fn wait_for_discovery(&mut self) -> Result<(), Failure> {
        let deadline = Instant::now() + LONGEST_DISCOVERY;
        loop {
            let missing = self.undiscovered();
            if missing.is_empty() || self.interrupt.has_come() {
                return Ok(());
            }
            self.check()?;
            if Instant::now() >= deadline {
                return Err(Failure::new(format!(
                    "the nodes have not discovered each other within {} s; missing: {}",
                    LONGEST_DISCOVERY.as_secs(),
                    missing.join(", ")
                ))
                .fix("multicast on the loopback interface may be off or filtered; `--transport local` needs no network"));
            }
            self.receive_for(POLL_PERIOD).await;
        }
    }

    /// Whether the nodes have discovered the player: what it sent before would be lost.
    pub(super) fn hear_the_player(&self) -> bool {
        let mut topics = self.feed.topics.iter();
        topics.all(|topic| self.diagnostic(topic.node, "publishers", &topic.received_name()) > 0)
    }

    /// Connections of the pipeline that no node reports yet.
    fn undiscovered(&self) -> Vec<String> {
        // Node, its own diagnostic, and the peers that it must have: the next node and this process.
        let [detection, segmentation, reconstruction] =
            [Stage::Detection, Stage::Segmentation, Stage::Reconstruction].map(Stage::name);
        let connections = [
            (detection, "subscribers", "reduced_cloud", 2),
            (detection, "subscribers", "detection/report", 1),
            (detection, "subscribers", pacing::VIEWS, 1),
            (segmentation, "publishers", "reduced_cloud", 1),
            (segmentation, "subscribers", "segmented_cloud", 1),
            (segmentation, "subscribers", "dynamic_cloud", 1),
            (segmentation, "subscribers", "tracks", 1),
            (segmentation, "subscribers", "segmentation/report", 1),
            (reconstruction, "publishers", "segmented_cloud", 1),
            (reconstruction, "subscribers", "static_map", 1),
            (reconstruction, "subscribers", "reconstruction/report", 1),
        ];
        let of_pose =
            [(visual::NODE, "subscribers", "pose", 2), (detection, "publishers", "pose", 1)];
        let of_pose = of_pose.into_iter().filter(|_| self.poses.is_some());
        connections
            .into_iter()
            .chain(of_pose)
            .filter(|(node, peers, topic, least)| self.diagnostic(node, peers, topic) < *least)
            .map(|(node, peers, topic, _)| format!("{peers} of {topic} at {node}"))
            .collect()
    }
}
