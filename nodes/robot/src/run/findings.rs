//! What is wrong with a run that came to its end all the same.

use std::fmt;

use bag_player::Loss;
use node_shell::RAISE_RECEIVE_BUFFER;
use report::RunRecord;

use super::inputs::{Inputs, ViewTopics};
use crate::failure::Failure;

/// What a run was like, beside its record.
pub(crate) struct Course {
    /// What of the bag could not be read.
    pub(crate) losses: Vec<Loss>,
    /// Scans in which nothing could be found for want of returns.
    pub(crate) blind_scans: usize,
    /// Messages that were sent and never arrived.
    pub(crate) lost: Vec<LostOnTheWay>,
}

/// Messages of one topic that the player sent and that never reached their node.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct LostOnTheWay {
    /// The bag's name of it.
    pub(crate) topic: String,
    pub(crate) node: &'static str,
    pub(crate) messages: u64,
}

impl fmt::Display for LostOnTheWay {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} of {} to {}", self.messages, self.topic, self.node)
    }
}

/// What the user should know of a run, each with the fix; nothing where all is well.
pub(crate) fn findings(course: &Course, record: &RunRecord, inputs: &Inputs) -> Vec<Failure> {
    let mut findings = Vec::new();
    for loss in &course.losses {
        findings.push(Failure::new(loss.to_string()));
    }
    if !course.lost.is_empty() {
        let lost: Vec<String> = course.lost.iter().map(ToString::to_string).collect();
        findings.push(
            Failure::new(format!(
                "messages were lost on the way between the processes: {}",
                lost.join(", ")
            ))
            .fix(format!(
                "play slower (--rate 0.5), or give sockets more room: `{RAISE_RECEIVE_BUFFER}`"
            )),
        );
    }
    let cycles = record.cycles.len();
    let by_detection = record.drops.iter().filter(|drop| drop.topic_or_stage == "detection");
    let dropped: u64 = by_detection.map(|drop| drop.count).sum();
    // At the ends of a recording a few scans always lack their cloud or pose.
    if dropped > cycles as u64 {
        findings.push(
            Failure::new(format!("{dropped} scans became no cycle, and {cycles} did"))
                .fix("the drops in summary.json and report.html say what they lacked"),
        );
    }
    if course.blind_scans > 0 {
        findings.push(
            Failure::new(format!(
                "{} of {cycles} scans on {} had no return to find motion by",
                course.blind_scans, inputs.scan
            ))
            .fix("what moved meanwhile is in the map; look at the scanner's range_min and range_max, and at its mounting"),
        );
    }
    let empty = record.cycles.iter().filter(|cycle| cycle.points_in == 0).count();
    if empty > 0 {
        let topic = match &inputs.view {
            ViewTopics::Depth { image, .. } => image,
            ViewTopics::Points(points) => points,
        };
        findings.push(
            Failure::new(format!("{empty} of {cycles} clouds on {topic} had no point"))
                .fix("a cloud of NaN or a depth image of zeros maps nothing: look at the camera"),
        );
    }
    findings
}

/// Why a run is no success at all, if it is none: it has no cycle, or no point in its map.
pub(crate) fn defeat(record: &RunRecord) -> Option<Failure> {
    if record.cycles.is_empty() {
        let reasons: Vec<String> = record
            .drops
            .iter()
            .map(|drop| format!("{}: {} ({} times)", drop.topic_or_stage, drop.reason, drop.count))
            .collect();
        let failure = Failure::new("no scan became a cycle, so there is no map");
        return Some(match reasons.is_empty() {
            true => failure,
            false => failure.fix(reasons.join("\n  ")),
        });
    }
    record.static_map.is_empty().then(|| Failure::new("the map has no point"))
}
