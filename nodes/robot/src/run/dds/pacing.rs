//! Lets the player go on no faster than the nodes: of a recording each message counts, however slow the machine is.
//!
//! The player waits for the publisher of this, and afterwards for a report on it for every image or cloud. Each is passed on from
//! detection, which reports what it has taken, as long as the later nodes are not far behind.

use msgs::stillmap_msgs::StageReport;
use node_shell::{Node, Publisher, Qos, ShellError, Subscription};

/// The topic that the player is paced by, in the namespace of the run.
pub(super) const TOPIC: &str = "pace";
/// The topic on which detection reports the images or clouds that it has taken.
pub(super) const VIEWS: &str = "detection/views";

/// Cycles that may be on their way through the nodes: half of those that wait before one of them.
const MOST_CYCLES_AHEAD: usize = 25;
/// Reports that may wait: the player has a few images on their way.
const REPORTS_KEPT: usize = 100;

/// Paces the player.
pub(super) struct Pacing {
    views: Subscription<StageReport>,
    /// None before the nodes hear the player.
    go: Option<Publisher<StageReport>>,
    /// Reports that are not passed on yet.
    waiting: Vec<StageReport>,
}

impl Pacing {
    pub(super) fn listen(node: &Node) -> Result<Self, ShellError> {
        let views = node.subscription(VIEWS, &Qos::reliable(REPORTS_KEPT))?;
        Ok(Self { views, go: None, waiting: Vec::new() })
    }

    pub(super) fn has_started(&self) -> bool {
        self.go.is_some()
    }

    /// Lets the player begin.
    pub(super) fn start(&mut self, node: &Node) -> Result<(), ShellError> {
        self.go = Some(node.publisher(TOPIC, &Qos::reliable(REPORTS_KEPT))?);
        Ok(())
    }

    /// Waits for a report. May be dropped while it waits.
    pub(super) async fn next(&self) -> StageReport {
        (*self.views.next().await.message).clone()
    }

    pub(super) fn take(&mut self, report: StageReport) {
        self.waiting.push(report);
    }

    /// Passes the reports on, unless this many cycles on their way through the nodes are too many.
    pub(super) fn pass_on(&mut self, cycles_ahead: usize) {
        // A report to no subscriber would be lost.
        let player = self.go.as_ref().filter(|go| go.subscriber_count() > 0);
        if let Some(player) = player.filter(|_| cycles_ahead <= MOST_CYCLES_AHEAD) {
            for report in self.waiting.drain(..) {
                player.publish_or_warn(report);
            }
        }
    }
}
