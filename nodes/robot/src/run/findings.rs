//! What is wrong with a run that was completed nevertheless.

use std::fmt;

use bag_player::Loss;
use detection::shell::IMAGE_WITHOUT_CALIBRATION;
use geometry::Method;
use node_shell::RAISE_RECEIVE_BUFFER;
use reconstruction::BoundReached;
use report::{CycleRecord, RunRecord};

use super::Stage;
use super::inputs::{Inputs, ViewTopics};
use super::recorder::UNUSABLE;
use crate::doctor::{CalibrationFault, FARTHEST_M};
use crate::failure::Failure;

/// The share of scans that have an image and a pose in a sound recording: the first and the last may not.
pub(crate) const SOUND_SHARE: f64 = 0.9;
/// So many may be those of the start and the end, also of a short recording: of half a second, at 10 Hz.
const AT_THE_ENDS: u64 = 5;

/// A larger share of all points does not move in a whole recording: 0.04 in a flat with three people, 0.18 in a hall full of them.
const MOST_REMOVED: f64 = 0.25;

/// Input that a run lost or could not use, beside its record.
pub(crate) struct InputLosses {
    /// Parts of the bag that could not be read.
    pub(crate) bag: Vec<Loss>,
    pub(crate) doubtful: DoubtfulInput,
    /// Messages that were sent and not received.
    pub(crate) lost: Vec<LostMessages>,
    /// What did not fit into the map.
    pub(crate) bounds_reached: Vec<BoundReached>,
}

/// How often the input of a cycle was used and is doubtful.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct DoubtfulInput {
    /// Scans without enough returns to find motion in.
    pub(crate) blind_scans: usize,
    /// Scans whose median range is beyond what any 2D scanner reaches.
    pub(crate) scans_out_of_reach: usize,
    /// Poses that no platform reaches from the ones before.
    pub(crate) pose_jumps: usize,
    /// The first fault of the depth camera's calibrations.
    pub(crate) calibration: Option<CalibrationFault>,
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

/// Whether so many of all cycles are more than in a sound recording. All of a short one are.
fn are_many_of(count: usize, cycles: usize) -> bool {
    let others = cycles.saturating_sub(count);
    count > 0 && (others == 0 || are_many(count as u64, others))
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
    // Images are more than scans: those before the first calibration are no scans.
    let by_detection = record.drops.iter().filter(|drop| {
        drop.topic_or_stage == Stage::Detection.name() && drop.reason != IMAGE_WITHOUT_CALIBRATION
    });
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
    for BoundReached { what, fix } in &losses.bounds_reached {
        findings.push(Failure::new(what.clone()).fix(fix.clone()));
    }
    findings.extend(of_sensors(&losses.doubtful, record, inputs));
    findings
}

/// What the user should know of the readings that became cycles.
pub(crate) fn of_sensors(
    doubtful: &DoubtfulInput,
    record: &RunRecord,
    inputs: &Inputs,
) -> Vec<Failure> {
    let mut findings = Vec::new();
    let (cycles, scan) = (record.cycles.len(), &inputs.scan);
    let DoubtfulInput { blind_scans, scans_out_of_reach, pose_jumps, calibration } = doubtful;
    if are_many_of(*blind_scans, cycles) {
        findings.push(
            Failure::new(format!(
                "{blind_scans} of {cycles} scans on {scan} have too few returns to find motion in"
            ))
            .fix("objects that moved meanwhile are not removed; check the scanner's range_min and range_max, and its mounting"),
        );
    }
    if are_many_of(*scans_out_of_reach, cycles) {
        findings.push(
            Failure::new(format!(
                "{scans_out_of_reach} scans on {scan} have a median range beyond {FARTHEST_M:.0} m, which no 2D scanner reaches: nothing \
                 that moves is found in them"
            ))
            .fix("LaserScan has metres (REP-103): divide by 1000 in the driver, range_min and range_max too"),
        );
    }
    if let (Some(fault), ViewTopics::Depth { camera_info, .. }) = (calibration, &inputs.view) {
        let CalibrationFault { what, fix, .. } = fault;
        findings.push(Failure::new(format!("{camera_info}: {what}")).fix(*fix));
    }
    // The node of the visual odometry says itself where it was lost.
    if *pose_jumps > 0 && inputs.has_poses_of_bag() {
        findings.push(
            Failure::new(format!(
                "{}: the poses jump before {pose_jumps} of {cycles} cycles: the map is torn there",
                inputs.pose.name()
            ))
            .fix(
                "give the smooth pose (odom, REP-105), not one that closes loops or is reset meanwhile; of a platform that is as fast raise \
                 max_platform_speed_m_per_s and max_platform_turn_rad_per_s",
            ),
        );
    }
    findings.extend(much_removed(record, inputs));
    let empty = record.cycles.iter().filter(|cycle| cycle.points_in == 0).count();
    if are_many_of(empty, cycles) {
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

/// That more was removed than moves: with poses of something else than the rig most of what stands still seems to move.
fn much_removed(record: &RunRecord, inputs: &Inputs) -> Option<Failure> {
    // Rec-HV removes so much from a platform that moves, whose poses are right: 27 % of a flat with three people.
    if record.method != Method::FreeSpace.name() {
        return None;
    }
    let sum = |count: fn(&CycleRecord) -> usize| record.cycles.iter().map(count).sum::<usize>();
    let (points, removed) = (sum(|cycle| cycle.counts.reduced), sum(|cycle| cycle.counts.dynamic));
    if removed as f64 <= MOST_REMOVED * points as f64 {
        return None;
    }
    let share = 100.0 * removed as f64 / points as f64;
    let pose = inputs.pose.name();
    Some(
        Failure::new(format!(
            "{share:.0} % of all points were removed as moving: unless people fill the view, the poses ({pose}) are not those of the rig"
        ))
        .fix(format!(
            "check that {pose} is the right topic, that its poses are of the rig (x ahead, z up; not of the camera's optical frame) in a fixed \
             frame, that they are not inverted, and that they follow the motion with the stamps of the images"
        )),
    )
}

/// Why a run has no result, if it has none: no cycle, or no point in its map.
pub(crate) fn no_result(record: &RunRecord) -> Option<Failure> {
    no_cycle(record).or_else(|| no_map(record))
}

/// That nothing of the view is in the map, if that is so.
pub(crate) fn no_map(record: &RunRecord) -> Option<Failure> {
    record.static_map.is_empty().then(|| {
        Failure::new("the map has no point").fix(
            "`stillmap doctor BAG` compares depths and ranges with what sensors reach (metres or millimetres), and topics and stamps",
        )
    })
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
mod tests;
