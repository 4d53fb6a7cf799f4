//! What is wrong with a run that was completed nevertheless.

use std::fmt;

use bag_player::Loss;
use node_shell::RAISE_RECEIVE_BUFFER;
use reconstruction::BoundReached;
use report::RunRecord;

use super::inputs::{Inputs, ViewTopics};
use super::recorder::UNUSABLE;
use crate::failure::Failure;

/// The share of scans that have an image and a pose in a sound recording: the first and the last may not.
pub(crate) const SOUND_SHARE: f64 = 0.9;
/// So many may be those of the start and the end, also of a short recording: of half a second, at 10 Hz.
const AT_THE_ENDS: u64 = 5;

/// Input that a run lost or could not use, beside its record.
pub(crate) struct InputLosses {
    /// Parts of the bag that could not be read.
    pub(crate) bag: Vec<Loss>,
    /// Scans without enough returns to find motion in.
    pub(crate) blind_scans: usize,
    /// Messages that were sent and not received.
    pub(crate) lost: Vec<LostMessages>,
    /// What did not fit into the map.
    pub(crate) bounds_reached: Vec<BoundReached>,
}

/// Messages of one topic that the player sent and that their node did not receive.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct LostMessages {
    /// Its name in the bag.
    pub(crate) topic: String,
    pub(crate) node: &'static str,
    pub(crate) messages: u64,
}

impl fmt::Display for LostMessages {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} of {} to {}", self.messages, self.topic, self.node)
    }
}

/// Whether more scans became no cycle than in a sound recording.
pub(crate) fn are_many(dropped: u64, cycles: usize) -> bool {
    dropped > AT_THE_ENDS && dropped as f64 > (1.0 - SOUND_SHARE) * (dropped + cycles as u64) as f64
}

/// What the user should know of a run, each with its fix; empty if there is nothing.
pub(crate) fn findings(losses: &InputLosses, record: &RunRecord, inputs: &Inputs) -> Vec<Failure> {
    let mut findings = Vec::new();
    for loss in &losses.bag {
        if loss.topic_left_out().is_none_or(|topic| inputs.is_of(topic)) {
            findings.push(Failure::new(loss.to_string()));
        }
    }
    if !losses.lost.is_empty() {
        let lost: Vec<String> = losses.lost.iter().map(ToString::to_string).collect();
        findings.push(
            Failure::new(format!(
                "messages were lost between the processes: {}",
                lost.join(", ")
            ))
            .fix(format!(
                "play slower (--rate 0.5), or raise the receive buffer: `{RAISE_RECEIVE_BUFFER}`"
            )),
        );
    }
    let cycles = record.cycles.len();
    let by_detection = record.drops.iter().filter(|drop| drop.topic_or_stage == "detection");
    let dropped: u64 = by_detection.map(|drop| drop.count).sum();
    if are_many(dropped, cycles) {
        findings.push(
            Failure::new(format!("{dropped} scans were dropped, {cycles} became cycles"))
                .fix("summary.json and report.html list the reasons under drops; `stillmap doctor BAG` compares topics and stamps"),
        );
    }
    let unusable = record.drops.iter().filter(|drop| drop.reason.starts_with(UNUSABLE));
    findings.extend(unusable.map(|drop| {
        let (topic, count) = (&drop.topic_or_stage, drop.count);
        let reason = drop.reason.trim_start_matches(UNUSABLE);
        let reason = reason.trim_start_matches([';', ':', ' ']);
        let why = if reason.is_empty() { String::new() } else { format!(" ({reason})") };
        Failure::new(format!("{topic}: {count} messages cannot be used{why}"))
            .fix("`stillmap doctor BAG` says more of them")
    }));
    if losses.blind_scans > 0 {
        findings.push(
            Failure::new(format!(
                "{} of {cycles} scans on {} have too few returns to find motion in",
                losses.blind_scans, inputs.scan
            ))
            .fix("objects that moved meanwhile are in the map; check the scanner's range_min and range_max, and its mounting"),
        );
    }
    for BoundReached { what, fix } in &losses.bounds_reached {
        findings.push(Failure::new(what.clone()).fix(fix.clone()));
    }
    let empty = record.cycles.iter().filter(|cycle| cycle.points_in == 0).count();
    if empty > 0 {
        let topic = match &inputs.view {
            ViewTopics::Depth { image, .. } => image,
            ViewTopics::Points(points) => points,
        };
        findings
            .push(Failure::new(format!("{empty} of {cycles} clouds on {topic} have no point")).fix(
            "a cloud of NaN or a depth image of zeros adds nothing to the map: check the camera",
        ));
    }
    findings
}

/// Why a run has no result, if it has none: no cycle, or no point in its map.
pub(crate) fn no_result(record: &RunRecord) -> Option<Failure> {
    no_cycle(record)
        .or_else(|| record.static_map.is_empty().then(|| Failure::new("the map has no point")))
}

/// Why no scan became a cycle, if none did.
pub(crate) fn no_cycle(record: &RunRecord) -> Option<Failure> {
    if record.cycles.is_empty() {
        let reasons: Vec<String> = record
            .drops
            .iter()
            .map(|drop| format!("{}: {} ({} times)", drop.topic_or_stage, drop.reason, drop.count))
            .collect();
        let failure = Failure::new("no scan became a cycle, so there is no result");
        let helps = "`stillmap doctor BAG` compares topics and stamps".to_owned();
        let lines: Vec<String> = reasons.into_iter().chain([helps]).collect();
        return Some(failure.fix(lines.join("\n  ")));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Up to half of a recording could be missing from the map without a word.
    #[test]
    fn more_than_a_tenth_without_a_cycle_are_many() {
        for (dropped, cycles, are) in [
            (0, 0, false),
            (5, 3, false),
            (6, 3, true),
            (20, 36, true),
            (10, 100, false),
            (12, 100, true),
        ] {
            assert_eq!(are_many(dropped, cycles), are, "{dropped} {cycles}");
        }
    }
}
