//! What the suite reports of its cycles, and what its process holds meanwhile, minute by minute.

use std::time::Duration;

use msgs::convert;
use msgs::stillmap_msgs::StageReport;
use node_shell::{Node, NodeClock, Qos, Subscription};
use robot::{Failure, Progress};
use tokio::time::{MissedTickBehavior, interval};

use super::super::shell_failure;
use super::minute::{LENGTH_S, Minute, Minutes};
use super::suite::Suite;

/// Reports that may wait: those of some seconds.
const REPORTS_DEPTH: usize = 50;
/// How often the process is looked at.
const LOOK_AGAIN: Duration = Duration::from_secs(5);

/// Subscriptions to the reports of the stages.
pub(super) struct Watch {
    clock: NodeClock,
    detection: Subscription<StageReport>,
    segmentation: Subscription<StageReport>,
    reconstruction: Subscription<StageReport>,
}

impl Watch {
    /// Of the suite in `namespace`.
    pub(super) fn new(node: &Node, namespace: &str) -> Result<Self, Failure> {
        let reports = |stage: &str| {
            let topic = format!("{namespace}/{stage}/report");
            node.subscription(&topic, &Qos::reliable(REPORTS_DEPTH)).map_err(shell_failure)
        };
        Ok(Self {
            clock: node.clock(),
            detection: reports("detection")?,
            segmentation: reports("segmentation")?,
            reconstruction: reports("reconstruction")?,
        })
    }

    /// Fills minute after minute; returns where the suite ends before it is stopped.
    pub(super) async fn follow(
        self,
        suite: &mut Suite,
        minutes: &mut Minutes,
        progress: &Progress,
    ) -> Failure {
        let mut looks = interval(LOOK_AGAIN);
        looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut ends = interval(Duration::from_secs_f64(LENGTH_S));
        // The first one comes at once.
        ends.tick().await;
        loop {
            tokio::select! {
                biased;
                _ = ends.tick() => progress.set(minutes.end() as u64),
                _ = looks.tick() => match suite.held() {
                    Ok(held) => minutes.current.note(held),
                    Err(failure) => return failure,
                },
                map = self.reconstruction.next() => self.take_map(&mut minutes.current, &map.message),
                report = self.segmentation.next() => take_drop(&mut minutes.current, &report.message),
                report = self.detection.next() => take_drop(&mut minutes.current, &report.message),
            }
        }
    }

    fn take_map(&self, minute: &mut Minute, report: &StageReport) {
        take_drop(minute, report);
        if report.processed {
            let now = convert::stamp_from_time(self.clock.now());
            minute.push(now.seconds_since(convert::stamp_from_time(report.header.stamp)));
        }
        let voxels = report.count_names.iter().position(|name| name == "voxels");
        if let Some(&voxels) = voxels.and_then(|at| report.counts.get(at)) {
            minute.voxels = voxels;
        }
    }
}

fn take_drop(minute: &mut Minute, report: &StageReport) {
    minute.dropped += usize::from(!report.processed);
}
