//! The report of a stage about each cycle, on `~/report`.

use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use geometry::Stamp;
use msgs::convert;
use msgs::std_msgs::Header;
use msgs::stillmap_msgs::StageReport;

use crate::endpoints::counters::Counters;
use crate::endpoints::publisher::Publisher;
use crate::node::Node;
use crate::node::clock::NodeClock;
use crate::process::throttle::Throttle;
use crate::services::pace::{Behind, Pace};
use crate::services::steps::StepTimer;
use crate::settings::qos::Qos;
use crate::wire::error::ShellError;

/// The topic of the reports.
const TOPIC: &str = "~/report";
/// The condition in the diagnostics that says whether the stage is too slow for its input ...
const PACE: &str = "pace";
/// ... and what it says where it is not.
const KEEPS_UP: &str = "keeps up";
/// The cause of the drop of a cycle that is older than those that wait.
const SUPERSEDED: &str = "newer cycles wait";
/// Reports that a late reader may still get.
const DEPTH: usize = 100;

/// Reports each cycle of a stage, processed or dropped, and counts it for `/diagnostics`.
pub struct StageReporter {
    stage: &'static str,
    publisher: Publisher<StageReport>,
    counters: Counters,
    clock: NodeClock,
    dropped: Throttle,
    pace: Mutex<Pace>,
    behind: Throttle,
}

impl StageReporter {
    /// A reporter for the stage that `node` is.
    ///
    /// # Errors
    /// When its publisher cannot be created.
    pub fn new(node: &Node, stage: &'static str) -> Result<Self, ShellError> {
        Ok(Self {
            stage,
            publisher: node.publisher(TOPIC, &Qos::reliable(DEPTH))?,
            counters: node.counters(),
            clock: node.clock(),
            dropped: Throttle::for_warnings(),
            pace: Mutex::default(),
            behind: Throttle::for_warnings(),
        })
    }

    /// Reports a cycle that was processed; `header` has the stamp of its cloud.
    pub fn processed(
        &self,
        header: Header,
        cycle: u32,
        counts: &[(&'static str, u64)],
        timer: &StepTimer,
    ) {
        self.counters.count_cycle();
        self.counters.note_counts(counts);
        let now = convert::stamp_from_time(self.clock.now());
        let taken: Stamp = convert::stamp_from_time(header.stamp);
        self.counters.note_age(now.seconds_since(taken));
        for (step, duration) in timer.steps() {
            self.counters.note_step(step, *duration);
        }
        let mut report = self.report(header, cycle, counts);
        report.processed = true;
        report.step_names = timer.steps().iter().map(|(step, _)| (*step).to_owned()).collect();
        report.step_durations_s =
            timer.steps().iter().map(|(_, duration)| duration.as_secs_f64()).collect();
        self.publisher.publish_or_warn(report);
    }

    /// Notes, after a cycle, how many were dropped for newer ones so far before this stage took them. While there are more, the stage
    /// cannot keep up: the log and `/diagnostics` say which step takes longest and what helps, `remedy`.
    pub fn keeps_pace(&self, dropped: u64, timer: &StepTimer, remedy: &str) {
        let mut pace = self.pace.lock().unwrap_or_else(PoisonError::into_inner);
        let is_news = dropped > pace.dropped();
        let Some(Behind { text, until }) =
            pace.note(Instant::now(), dropped, timer.steps(), remedy)
        else {
            return self.counters.note_condition(PACE, KEEPS_UP, false);
        };
        self.counters.note_warning_until(PACE, &text, (until, KEEPS_UP));
        if is_news && let Some(held_back) = self.behind.pass() {
            tracing::warn!("{text} ({held_back} more since the last warning)");
        }
    }

    /// Reports a cycle that was dropped, and warns of it once in a while. `cause` is one of a few, by
    /// which drops are counted; `reason` has the particulars. `header` has the stamp of what was
    /// dropped, `cycle` the number that the next cycle will take.
    pub fn dropped(
        &self,
        header: Header,
        cycle: u32,
        (cause, reason): (&str, &str),
        counts: &[(&'static str, u64)],
    ) {
        if let Some(held_back) = self.dropped.pass() {
            tracing::warn!(
                "a cycle was dropped ({held_back} more since the last warning): {reason}"
            );
        }
        self.report_drop(header, cycle, (cause, reason), counts);
    }

    /// Reports a cycle that was dropped for newer ones. [`Self::keeps_pace`] warns of it after the next cycle, with what helps.
    pub fn superseded(&self, header: Header, cycle: u32, counts: &[(&'static str, u64)]) {
        self.report_drop(header, cycle, (SUPERSEDED, SUPERSEDED), counts);
    }

    fn report_drop(
        &self,
        header: Header,
        cycle: u32,
        (cause, reason): (&str, &str),
        counts: &[(&'static str, u64)],
    ) {
        self.counters.count_drop(cause);
        let mut report = self.report(header, cycle, counts);
        report.drop_reason = reason.to_owned();
        self.publisher.publish_or_warn(report);
    }

    fn report(&self, header: Header, cycle: u32, counts: &[(&'static str, u64)]) -> StageReport {
        StageReport {
            header,
            stage: self.stage.to_owned(),
            cycle,
            count_names: counts.iter().map(|(name, _)| (*name).to_owned()).collect(),
            counts: counts.iter().map(|(_, count)| *count).collect(),
            ..StageReport::default()
        }
    }
}
