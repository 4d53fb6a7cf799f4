//! The cycles of a bag that are used: in one pass the times of scans and the poses, in a second one the scans and
//! images that were chosen.

use bag_player::{Bag, BagInfo, BagMessage, Loss, Selection};
use calibration::Cycle;
use geometry::BeamOrder;
use geometry::{CameraModel, Scan, Stamp};
use msgs::convert;
use msgs::sensor_msgs::LaserScan;

use super::choice::{Candidate, Chosen, choose};
use super::gathering::Gathering;
use super::poses::Poses;
use super::rig_poses::{PoseReader, RigPoses};
use crate::failure::Failure;
use crate::progress::Progress;

/// Poses that are kept at most: nine hours at 30 Hz, 150 MB.
const MOST_POSES: usize = 1 << 20;
/// Returns that move farther within a scan, without correction, are reported: two standard deviations of a range at 4 m.
const FAST_M: f64 = 0.04;
/// If the order of the beams is known, motion within a scan is corrected except for about this share.
const UNCORRECTED_SHARE: f64 = 0.1;

/// The topics that are read.
pub(crate) struct Topics {
    pub(crate) scan: String,
    pub(crate) image: String,
    pub(crate) camera_info: String,
    pub(crate) poses: RigPoses,
}

/// How cycles are made of messages.
pub(crate) struct Choosing {
    pub(crate) most_cycles: usize,
    /// Scans in which the platform moves the returns farther are left out; what poses scatter is no motion.
    pub(crate) most_motion_m: f64,
    pub(crate) max_pose_gap_s: f64,
    pub(crate) max_image_offset_s: f64,
    pub(crate) beam_order: BeamOrder,
}

/// What was read.
pub(crate) struct Read {
    pub(crate) cycles: ReadCycles,
    /// The first calibration of the camera.
    pub(crate) camera: Option<CameraModel>,
    /// Parts of the bag that could not be read.
    pub(crate) losses: Vec<Failure>,
}

/// The cycles, and what should be known of them.
pub(crate) struct ReadCycles {
    pub(crate) cycles: Vec<Cycle>,
    pub(crate) findings: Vec<Failure>,
}

/// A scan's time.
#[derive(Clone, Copy)]
pub(super) struct Turn {
    pub(super) stamp: Stamp,
    pub(super) turn_s: f64,
}

pub(crate) fn read(
    bag: &Bag,
    info: &BagInfo,
    topics: &Topics,
    choosing: &Choosing,
) -> Result<Read, Failure> {
    let count = |topic: &str| -> u64 {
        let of_topic = info.topics.iter().filter(|known| known.topic == topic);
        of_topic.map(|known| known.message_count).sum()
    };
    let pose_topics = topics.poses.topics();
    let (scans, poses) =
        (count(&topics.scan), pose_topics.iter().map(|topic| count(topic)).sum::<u64>());
    let progress = Progress::new(
        "reading",
        2 * scans + poses + count(&topics.image) + count(&topics.camera_info),
    );

    // First the times.
    let mut turns = Turns::default();
    let capacity = usize::try_from(poses).unwrap_or(MOST_POSES).min(MOST_POSES);
    let mut poses = Poses::new(capacity, choosing.max_pose_gap_s);
    let mut pose_reader = PoseReader::new(&topics.poses);
    let of_times = [&[topics.scan.as_str()], pose_topics.as_slice()].concat();
    let mut losses = for_each(bag, &of_times, &progress, |message| {
        if *message.topic == *topics.scan {
            turns.take(message);
        } else {
            pose_reader.take(message, &mut poses);
        }
    })?;
    pose_reader.finish(&mut poses);
    turns.complete();
    let chosen = choose(&candidates(&turns, &poses, choosing), choosing.most_cycles);
    if chosen.scans.is_empty() {
        return Err(Failure::new(format!(
            "of {} scans on {} none has poses around it",
            turns.turns.len(),
            topics.scan
        ))
        .fix(format!(
            "is {} published while the scanner turns, with the same clock?",
            topics.poses.name()
        )));
    }

    // Then what was chosen.
    let mut gathering = Gathering::new(&turns, &chosen, choosing.max_image_offset_s);
    let of_cycles = [topics.scan.as_str(), topics.image.as_str(), topics.camera_info.as_str()];
    let again = for_each(bag, &of_cycles, &progress, |message| gathering.take(message, topics))?;
    progress.finish();
    for loss in again {
        // Both passes find the same damage.
        if !losses.contains(&loss) {
            losses.push(loss);
        }
    }

    let unusable = turns.unusable + poses.unusable() + gathering.unusable;
    let mut findings = findings(&chosen, choosing);
    if unusable > 0 {
        findings.push(
            Failure::new(format!("{unusable} scans, images or poses could not be used"))
                .fix("`stillmap doctor BAG` says what is wrong with them"),
        );
    }
    let camera = gathering.camera;
    let cycles = gathering.cycles(&poses, choosing.beam_order);
    if cycles.is_empty() {
        return Err(Failure::new(format!(
            "none of {} scans has a depth image within {} s",
            chosen.scans.len(),
            choosing.max_image_offset_s
        ))
        .fix("are the clocks of both sensors the same? `stillmap doctor BAG` compares them"));
    }
    let losses = losses.iter().map(|loss| Failure::new(loss.to_string())).collect();
    Ok(Read { cycles: ReadCycles { cycles, findings }, camera, losses })
}

/// Calls `take` with the messages on some topics; returns the parts of the bag that could not be read.
fn for_each(
    bag: &Bag,
    topics: &[&str],
    progress: &Progress,
    mut take: impl FnMut(&BagMessage),
) -> Result<Vec<Loss>, Failure> {
    let topics = topics.iter().map(|topic| (*topic).to_owned()).collect();
    let selection = Selection { topics: Some(topics), ..Selection::default() };
    let failed = |error: bag_player::BagError| Failure::new(error.to_string());
    let mut messages = bag.messages(&selection).map_err(failed)?;
    for message in &mut messages {
        take(&message.map_err(failed)?);
        progress.advance();
    }
    Ok(messages.losses().to_vec())
}

/// The times of all scans.
#[derive(Default)]
pub(super) struct Turns {
    pub(super) turns: Vec<Turn>,
    unusable: usize,
}

impl Turns {
    fn take(&mut self, message: &BagMessage) {
        match read_scan(message) {
            Some(scan) => {
                self.turns.push(Turn { stamp: scan.stamp, turn_s: f64::from(scan.scan_time_s) })
            }
            None => {
                // A placeholder, so that the numbers agree with those of the second pass.
                self.turns.push(Turn { stamp: Stamp::default(), turn_s: f64::NAN });
                self.unusable += 1;
            }
        }
    }

    /// Sets the missing times of turns: some drivers leave them 0, and the turn lasts until the next scan.
    fn complete(&mut self) {
        let stamps: Vec<Stamp> = self.turns.iter().map(|turn| turn.stamp).collect();
        for (index, turn) in self.turns.iter_mut().enumerate() {
            let known = turn.turn_s.is_finite() && turn.turn_s > 0.0;
            if !known && !turn.turn_s.is_nan() {
                turn.turn_s = match stamps.get(index + 1) {
                    Some(next) => next.seconds_since(turn.stamp).max(0.0),
                    None => 0.0,
                };
            }
        }
    }
}

pub(super) fn read_scan(message: &BagMessage) -> Option<Scan> {
    let message = message.decode::<LaserScan>().ok()?;
    convert::scan_from_message(&message).ok()
}

/// The scans whose poses are known.
fn candidates(turns: &Turns, poses: &Poses, choosing: &Choosing) -> Vec<Candidate> {
    let left = match choosing.beam_order {
        BeamOrder::Unknown => 1.0,
        BeamOrder::FirstToLast | BeamOrder::LastToFirst => UNCORRECTED_SHARE,
    };
    turns
        .turns
        .iter()
        .enumerate()
        .filter(|(_, turn)| turn.turn_s.is_finite())
        .filter_map(|(scan, turn)| {
            let end = turn.stamp.plus_seconds(turn.turn_s);
            let motion_m = left * poses.motion_m(turn.stamp, end)?;
            let most_m = choosing.most_motion_m;
            let moves = |averaged_m: f64| left * averaged_m > most_m;
            if motion_m > most_m && poses.averaged_motion_m(turn.stamp, end).is_none_or(moves) {
                return None;
            }
            Some(Candidate { scan, motion_m, map_from_rig: poses.at(turn.stamp)? })
        })
        .collect()
}

/// What should be known of the choice.
fn findings(chosen: &Chosen, choosing: &Choosing) -> Vec<Failure> {
    if chosen.most_motion_m <= FAST_M {
        return Vec::new();
    }
    let moved = format!(
        "the platform moves returns by up to {:.2} m while the scanner turns once",
        chosen.most_motion_m
    );
    vec![match choosing.beam_order {
        BeamOrder::Unknown => Failure::new(moved).fix(
            "stop for each scan, turn more slowly, or set detection's beam_order in a file for --params-file",
        ),
        BeamOrder::FirstToLast | BeamOrder::LastToFirst => {
            Failure::new(moved).fix("stop for each scan, or turn more slowly")
        }
    }]
}
