//! Ties a scan, a cloud and a pose into one cycle by their stamps (Rec-HV 3.3.1: the scan is the clock).

mod event;

use std::collections::VecDeque;

use geometry::{PoseBuffer, PosePushError, Stamp, StampedPose};

pub use event::{DropCause, Dropped, Input, MatchEvent, Matched};

use crate::config::DetectionConfig;

/// How long and how many.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Limits {
    cloud_offset_s: f64,
    wait_s: f64,
    waiting_scans: usize,
    waiting_clouds: usize,
}

/// Matches scans of payload `S`, clouds (or depth images) of payload `C`, and poses.
///
/// The payloads are not read, so that a node can keep messages undecoded until they are
/// needed. A cloud serves every scan that it is nearest to; hence `C: Clone`, which is meant for an
/// `Arc`.
///
/// # The rule
/// - A scan gets the cloud nearest in stamp within `max_cloud_offset_s`, the earlier one of two at equal
///   distance. This is decided once a cloud with the scan's stamp or a later one has been seen, and so
///   does not depend on the order of arrival.
/// - It gets the pose at the cloud's stamp, interpolated between the poses around it, once a pose with
///   the cloud's stamp or a later one has been seen.
///   A matcher [without poses](Self::without_poses) leaves that to its caller.
/// - It waits for these until the newest stamp seen on any input is `max_wait_s` later than its own, or
///   `max_waiting_scans` are waiting; then it is dropped, with what was missing.
/// - Scans leave in the order of their stamps, matched or dropped.
/// - On each input the stamps must grow. A message that does not is ignored, and reported; a stamp more
///   than `max_wait_s` before the last one means that the clock has jumped (a bag that starts again): all waiting scans are
///   dropped, and matching is reset.
///
/// As long as nothing is dropped or ignored, the cycles are the same however the inputs interleave.
#[derive(Clone, Debug)]
pub struct Matcher<S, C> {
    limits: Limits,
    scans: VecDeque<(Stamp, S)>,
    clouds: VecDeque<(Stamp, C)>,
    /// None where the caller has the poses.
    poses: Option<PoseBuffer>,
    newest: Option<Stamp>,
    latest_scan: Option<Stamp>,
    latest_cloud: Option<Stamp>,
    latest_pose: Option<Stamp>,
}

impl<S, C: Clone> Matcher<S, C> {
    /// A matcher within the bounds of `config`, which has been validated.
    #[must_use]
    pub fn new(config: &DetectionConfig) -> Self {
        let limits = Limits {
            cloud_offset_s: config.max_cloud_offset_s,
            wait_s: config.max_wait_s,
            waiting_scans: config.max_waiting_scans,
            waiting_clouds: config.max_waiting_clouds,
        };
        Self {
            limits,
            scans: VecDeque::new(),
            clouds: VecDeque::new(),
            poses: Some(
                PoseBuffer::new(config.max_waiting_poses).with_max_gap_s(config.max_pose_gap_s),
            ),
            newest: None,
            latest_scan: None,
            latest_cloud: None,
            latest_pose: None,
        }
    }

    /// A matcher of scans and clouds alone, for a caller who finds the pose of each match by itself, as from tf.
    #[must_use]
    pub fn without_poses(config: &DetectionConfig) -> Self {
        Self { poses: None, ..Self::new(config) }
    }

    /// Adds a scan, and returns what this decides, in the order of the scans.
    pub fn push_scan(&mut self, stamp: Stamp, scan: S) -> Vec<MatchEvent<S, C>> {
        let mut events = Vec::new();
        if self.admits(Input::Scan, stamp, &mut events) {
            let late_s = self.newest.map_or(0.0, |newest| newest.seconds_since(stamp));
            if late_s > self.limits.wait_s {
                let cause = DropCause::CameLate { late_s };
                let missing = vec![Input::Scan];
                events.push(MatchEvent::Dropped(Dropped { stamp, missing, cause }));
            } else {
                self.scans.push_back((stamp, scan));
            }
            self.settle(&mut events);
        }
        events
    }

    /// Adds a cloud or a depth image, and returns what this decides, in the order of the scans.
    pub fn push_cloud(&mut self, stamp: Stamp, cloud: C) -> Vec<MatchEvent<S, C>> {
        let mut events = Vec::new();
        if self.admits(Input::Cloud, stamp, &mut events) {
            self.clouds.push_back((stamp, cloud));
            self.settle(&mut events);
        }
        events
    }

    /// Adds a pose, and returns what this decides, in the order of the scans.
    pub fn push_pose(&mut self, pose: StampedPose) -> Vec<MatchEvent<S, C>> {
        let mut events = Vec::new();
        if self.admits(Input::Pose, pose.stamp, &mut events) {
            self.take_pose(pose, &mut events);
            self.settle(&mut events);
        }
        events
    }

    /// The end of the input: every waiting scan is dropped, and the matcher is reset.
    pub fn flush(&mut self) -> Vec<MatchEvent<S, C>> {
        let mut events = Vec::new();
        self.restart(DropCause::EndOfInput, &mut events);
        events
    }

    /// The clock of all inputs was set back to `now`: if stamps are later than `now` by more than the transport may explain,
    /// every waiting scan is dropped and the matcher is reset. Returns `None` if it is not reset.
    pub fn set_back(&mut self, now: Stamp) -> Option<Vec<MatchEvent<S, C>>> {
        let ahead_s = self.newest?.seconds_since(now);
        if ahead_s <= self.limits.wait_s {
            return None;
        }
        let mut events = Vec::new();
        self.restart(DropCause::ClockJumpedBack, &mut events);
        Some(events)
    }

    /// How many scans wait for their cloud or pose.
    #[must_use]
    pub fn waiting_scans(&self) -> usize {
        self.scans.len()
    }

    /// How many clouds are kept for scans that wait or are still to come.
    #[must_use]
    pub fn waiting_clouds(&self) -> usize {
        self.clouds.len()
    }

    /// Whether a message of `stamp` is accepted. Updates the latest stamp of its input, and drops the scans that have waited
    /// too long by it.
    fn admits(&mut self, input: Input, stamp: Stamp, events: &mut Vec<MatchEvent<S, C>>) -> bool {
        if let Some(latest) = *self.latest_mut(input)
            && stamp <= latest
        {
            if latest.seconds_since(stamp) <= self.limits.wait_s {
                events.push(MatchEvent::Ignored { input, stamp, latest });
                return false;
            }
            self.restart(DropCause::ClockJumpedBack, events);
            events.push(MatchEvent::ClockJumpedBack { input, from: latest, to: stamp });
        }
        self.newest = self.newest.max(Some(stamp));
        // Before the message is added: whether a scan is dropped must not depend on which input first shows that the
        // time is over.
        while let Some(&(scan_stamp, _)) = self.scans.front() {
            let waited_s = self.newest.map_or(0.0, |newest| newest.seconds_since(scan_stamp));
            if waited_s <= self.limits.wait_s {
                break;
            }
            self.drop_first(DropCause::WaitedTooLong { waited_s }, events);
        }
        *self.latest_mut(input) = Some(stamp);
        true
    }

    fn latest_mut(&mut self, input: Input) -> &mut Option<Stamp> {
        match input {
            Input::Scan => &mut self.latest_scan,
            Input::Cloud => &mut self.latest_cloud,
            Input::Pose => &mut self.latest_pose,
        }
    }

    fn take_pose(&mut self, pose: StampedPose, events: &mut Vec<MatchEvent<S, C>>) {
        let Some(poses) = &mut self.poses else { return };
        match poses.push(pose.clone()) {
            Ok(()) => {}
            Err(PosePushError::OtherFrame { expected, found }) => {
                // Poses of two frames cannot be interpolated; the newer frame is used.
                poses.clear();
                events.push(MatchEvent::PoseFrameChanged { from: expected, to: found });
                if let Err(error) = poses.push(pose) {
                    events.push(MatchEvent::PoseRefused(error));
                }
            }
            Err(error) => events.push(MatchEvent::PoseRefused(error)),
        }
    }

    /// Whether the pose at `stamp` can be decided: a pose of that stamp or a later one has been taken, or the caller has it.
    fn has_pose_from(&self, stamp: Stamp) -> bool {
        let Some(poses) = &self.poses else { return true };
        poses.newest().is_some_and(|newest| newest.stamp >= stamp)
    }

    /// Drops all waiting scans and forgets every stamp.
    fn restart(&mut self, cause: DropCause, events: &mut Vec<MatchEvent<S, C>>) {
        while !self.scans.is_empty() {
            self.drop_first(cause, events);
        }
        self.clouds.clear();
        if let Some(poses) = &mut self.poses {
            poses.clear();
        }
        self.newest = None;
        self.latest_scan = None;
        self.latest_cloud = None;
        self.latest_pose = None;
    }

    /// Drops the scan that has waited longest.
    fn drop_first(&mut self, cause: DropCause, events: &mut Vec<MatchEvent<S, C>>) {
        if let Some((stamp, _)) = self.scans.pop_front() {
            let missing = self.missing(stamp);
            events.push(MatchEvent::Dropped(Dropped { stamp, missing, cause }));
        }
    }

    /// Decides the scans at the head of the queue, as far as possible now.
    fn settle(&mut self, events: &mut Vec<MatchEvent<S, C>>) {
        while let Some(&(stamp, _)) = self.scans.front() {
            let decision = self.decide(stamp);
            if matches!(decision, Decision::Wait) {
                break;
            }
            let Some((scan_stamp, scan)) = self.scans.pop_front() else { break };
            events.push(match decision {
                Decision::Match { cloud_stamp, cloud, pose } => {
                    MatchEvent::Matched(Matched { scan_stamp, scan, cloud_stamp, cloud, pose })
                }
                Decision::Drop(dropped) => MatchEvent::Dropped(dropped),
                Decision::Wait => break,
            });
        }
        while self.scans.len() > self.limits.waiting_scans {
            self.drop_first(DropCause::TooManyWaiting { waiting: self.scans.len() }, events);
        }
        self.discard_clouds(events);
    }

    fn decide(&self, scan_stamp: Stamp) -> Decision<C> {
        let drop = |missing, cause| {
            Decision::Drop(Dropped { stamp: scan_stamp, missing: vec![missing], cause })
        };
        let (cloud_stamp, cloud) = match nearest(&self.clouds, scan_stamp) {
            Nearest::Undecided => return Decision::Wait,
            Nearest::At(stamp, cloud) => (stamp, cloud),
        };
        let offset_s = cloud_stamp.seconds_since(scan_stamp).abs();
        if offset_s > self.limits.cloud_offset_s {
            return drop(Input::Cloud, DropCause::NoCloudNear { offset_s });
        }
        if !self.has_pose_from(cloud_stamp) {
            return Decision::Wait;
        }
        match self.poses.as_ref().map(|poses| poses.at(cloud_stamp)).transpose() {
            Ok(pose) => Decision::Match { cloud_stamp, cloud: cloud.clone(), pose },
            Err(error) => drop(Input::Pose, DropCause::NoPose(error)),
        }
    }

    /// The inputs that a waiting scan lacks.
    fn missing(&self, scan_stamp: Stamp) -> Vec<Input> {
        let (cloud, pose_needed_at) = match nearest(&self.clouds, scan_stamp) {
            Nearest::Undecided => (Some(Input::Cloud), scan_stamp),
            Nearest::At(stamp, _) => (None, stamp),
        };
        let pose = (!self.has_pose_from(pose_needed_at)).then_some(Input::Pose);
        cloud.into_iter().chain(pose).collect()
    }

    /// Drops the clouds that neither a waiting scan nor one to come can match; where too many are left, the oldest that no waiting
    /// scan matches, and then the scan that has waited longest with its cloud.
    fn discard_clouds(&mut self, events: &mut Vec<MatchEvent<S, C>>) {
        loop {
            let of_waiting = self.clouds_of_waiting_scans();
            let is_of_waiting = |stamp: &Stamp| of_waiting.binary_search(stamp).is_ok();
            // A scan to come is later than the last one, and will not have waited too long.
            let not_late = self.newest.map(|newest| newest.plus_seconds(-self.limits.wait_s));
            let to_come = self.latest_scan.max(not_late);
            let of_those = to_come.map(|scan| scan.plus_seconds(-self.limits.cloud_offset_s));
            // The newest one decides which cloud is the nearest to the scans before it.
            let newest = self.latest_cloud;
            self.clouds.retain(|(stamp, _)| {
                Some(*stamp) >= of_those || Some(*stamp) == newest || is_of_waiting(stamp)
            });
            if self.clouds.len() <= self.limits.waiting_clouds {
                return;
            }
            match self.clouds.iter().position(|(stamp, _)| !is_of_waiting(stamp)) {
                Some(unneeded) => {
                    self.clouds.remove(unneeded);
                }
                None => {
                    let waiting = self.scans.len();
                    self.drop_first(DropCause::TooManyWaiting { waiting }, events);
                }
            }
        }
    }

    /// The stamps of the clouds that waiting scans match, in their order.
    fn clouds_of_waiting_scans(&self) -> Vec<Stamp> {
        let of_scan = |(scan, _): &(Stamp, S)| match nearest(&self.clouds, *scan) {
            Nearest::At(stamp, _) => Some(stamp),
            Nearest::Undecided => None,
        };
        self.scans.iter().filter_map(of_scan).collect()
    }
}

enum Decision<C> {
    Wait,
    Match { cloud_stamp: Stamp, cloud: C, pose: Option<StampedPose> },
    Drop(Dropped),
}

pub(crate) enum Nearest<'a, C> {
    /// A nearer one may still come.
    Undecided,
    At(Stamp, &'a C),
}

/// The entry nearest to `stamp` among entries in the order of their stamps; of two equally near ones the
/// earlier.
pub(crate) fn nearest<C>(entries: &VecDeque<(Stamp, C)>, stamp: Stamp) -> Nearest<'_, C> {
    let next = entries.partition_point(|(entry, _)| *entry < stamp);
    let Some((after, entry_after)) = entries.get(next) else { return Nearest::Undecided };
    match next.checked_sub(1).and_then(|before| entries.get(before)) {
        Some((before, entry_before))
            if stamp.as_nanos().abs_diff(before.as_nanos())
                <= stamp.as_nanos().abs_diff(after.as_nanos()) =>
        {
            Nearest::At(*before, entry_before)
        }
        _ => Nearest::At(*after, entry_after),
    }
}

#[cfg(test)]
mod tests;
