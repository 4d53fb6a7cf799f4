//! The matched cycles that wait: for their transforms or colours, or, live, for the node to have done the ones before.

use geometry::{Scan, Stamp};

use super::Stage;
use crate::Matched;
use crate::shell::backlog::Backlog;
use crate::shell::inputs::ViewMessage;
use crate::shell::mounts::SensorFrames;
use crate::shell::transforms::WAITING_FOR_TRANSFORM;

impl Stage {
    /// Whether a matched cycle waits, and something has come since it lacked something.
    pub(in crate::shell) fn may_go_on(&self) -> bool {
        self.backlog.is_some() && self.may_go_on && !self.unlocated.is_empty()
    }

    /// Processes the oldest matched cycle of those that have not been dropped for what is here by now, unless it lacks something.
    pub(in crate::shell) fn process_next(&mut self) {
        self.take_waiting();
        self.may_go_on = self.process_first();
    }

    /// The matched cycles that wait; none does any more.
    pub(super) fn start_anew(&mut self) -> Vec<Matched<Scan, ViewMessage>> {
        if let Some(backlog) = &mut self.backlog {
            backlog.clear();
        }
        self.unlocated.start_anew()
    }

    /// A transform or a colour image has come, which a cycle may wait for.
    pub(super) fn something_came(&mut self) {
        match self.backlog {
            None => self.process_matched(),
            Some(_) => self.drop_superseded(),
        }
    }

    /// Where the newest cycles count: drops the oldest of those that lack nothing, where there are too many.
    pub(super) fn drop_superseded(&mut self) {
        let Some(backlog) = &mut self.backlog else { return };
        let transforms = self.transforms.as_ref();
        let is_located = |matched: &&Matched<Scan, ViewMessage>| {
            transforms.is_none_or(|known| known.has_all(frames_of(matched)))
        };
        let others = self.unlocated.iter().skip(backlog.complete());
        let more = others.take_while(is_located).count();
        for _ in 0..backlog.completed(more) {
            let Some((stamp, _)) = self.unlocated.pop() else { return };
            self.output.superseded(stamp, &self.inputs);
        }
    }

    /// The matched cycle that came first of those that wait.
    pub(super) fn pop(&mut self) -> Option<(Stamp, Matched<Scan, ViewMessage>)> {
        if let Some(backlog) = &mut self.backlog {
            backlog.taken();
        }
        self.unlocated.pop()
    }

    /// Processes the matched cycles that have their transforms and their colours, in order.
    pub(super) fn process_matched(&mut self) {
        while self.process_first() {}
    }

    /// Processes the matched cycle that came first, or drops it. Returns false where there is none, or it waits for its transform or
    /// its colours, which may be late.
    fn process_first(&mut self) -> bool {
        let complete = self.backlog.as_ref().map_or(0, Backlog::complete);
        let Some((stamp, matched)) = self.pop() else { return false };
        let is_last = self.unlocated.is_empty();
        match self.locate(&matched) {
            Ok(pose) if self.awaits_colour(&matched, is_last) => {
                match self.unlocated.wait_on(stamp, matched) {
                    Ok(()) => return self.waits_on(complete),
                    Err(matched) => self.cycle(&matched, &pose),
                }
            }
            Ok(pose) => self.cycle(&matched, &pose),
            Err(error) => match self.unlocated.wait_on(stamp, matched) {
                Ok(()) => return self.waits_on(complete),
                Err(matched) => self.drop_unlocated(&matched, error.as_ref()),
            },
        }
        true
    }

    /// The cycle that was taken waits again, beside others as before.
    fn waits_on(&mut self, complete: usize) -> bool {
        if let Some(backlog) = &mut self.backlog {
            backlog.put_back(complete);
        }
        false
    }

    fn awaits_colour(&mut self, matched: &Matched<Scan, ViewMessage>, is_last: bool) -> bool {
        let colours = self.colours.as_mut();
        colours.is_some_and(|colours| colours.is_awaited(matched.cloud_stamp, is_last))
    }

    pub(super) fn drop_unlocated(
        &self,
        matched: &Matched<Scan, ViewMessage>,
        error: &dyn std::error::Error,
    ) {
        self.drop_scan(matched.scan_stamp, WAITING_FOR_TRANSFORM, &error.to_string());
    }
}

/// The frames and the stamp by which tf is asked for what a cycle needs.
pub(super) fn frames_of(matched: &Matched<Scan, ViewMessage>) -> SensorFrames<'_> {
    SensorFrames {
        lidar: &matched.scan.frame_id,
        camera: matched.cloud.frame_id(),
        stamp: matched.cloud_stamp,
    }
}
