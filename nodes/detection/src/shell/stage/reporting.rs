//! What the node says of messages and scans that become no cycle, and of what is odd about the others: its log, counters and reports.

use geometry::Stamp;

use super::{Stage, UNUSABLE_MESSAGE_ON};
use crate::shell::sensor_frame::Renamed;
use crate::{Dropped, Input, PoseJump};

impl Stage {
    pub(super) fn report_renamed(&self, input: Input, renamed: Option<Renamed>) {
        if let Some(Renamed { from, to }) = renamed {
            let topic = self.inputs.topic(input);
            tracing::warn!("{topic}: the frame of the sensor changed from {from} to {to}");
        }
    }

    pub(super) fn report_jump(&self, PoseJump { step_m, step_rad, passed_s }: PoseJump) {
        if let Some(held_back) = self.jumps.pass() {
            tracing::warn!(
                "{}: the pose jumped by {step_m:.2} m and {step_rad:.2} rad within {passed_s:.2} s: what moves is searched for anew, \
                 and what was mapped before stays where it was. Take poses in a frame that does not jump (odom), or let the SLAM \
                 publish map_path ({held_back} more since the last warning)",
                self.inputs.topic(Input::Pose)
            );
        }
    }

    pub(super) fn drop_scan(&self, scan_stamp: Stamp, cause: &str, reason: &str) {
        self.output.dropped(scan_stamp, (cause, reason), &self.inputs);
    }

    /// Counts a calibration that cannot be used, with the first reason: those of a camera have all the same.
    pub(super) fn refuse_camera(&mut self, reason: String) {
        let topic = self.inputs.camera_info_topic().unwrap_or_default();
        let is_the_first = *self.camera_refused.get_or_insert_with(|| reason.clone()) == reason;
        let mut cause = format!("{UNUSABLE_MESSAGE_ON}{topic}");
        if is_the_first {
            cause += &format!(": {reason}");
        }
        self.counters.count_drop(&cause);
        self.warn_of(topic, &reason);
    }

    /// Counts an unusable message, and logs it at intervals.
    pub(super) fn refuse(&self, input: Input, reason: &str) {
        self.refuse_on(self.inputs.topic(input), reason);
    }

    pub(super) fn refuse_on(&self, topic: &str, reason: &str) {
        self.counters.count_drop(&format!("{UNUSABLE_MESSAGE_ON}{topic}"));
        self.warn_of(topic, reason);
    }

    fn warn_of(&self, topic: &str, reason: &str) {
        if let Some(held_back) = self.bad_input.pass() {
            tracing::warn!("{topic}: {reason} ({held_back} more since the last warning)");
        }
    }

    pub(super) fn missing_topics(&self, dropped: &Dropped) -> String {
        let topics: Vec<&str> = dropped
            .missing
            .iter()
            .map(|input| match (input, self.inputs.camera_info_topic()) {
                (Input::Cloud, Some(camera_info)) if self.camera.is_missing() => camera_info,
                _ => self.inputs.topic(*input),
            })
            .collect();
        topics.join(" and ")
    }
}
