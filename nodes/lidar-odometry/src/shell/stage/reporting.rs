//! The node's own state: in its log, its diagnostics and its reports.

use geometry::LidarCloud;
use msgs::convert::PointTimes;
use msgs::std_msgs::Header;
use node_shell::{NodeFailure, StepTimer};

use super::{Stage, TIMES, TRACKING, TURNS};
use crate::odometry::{LidarPose, Outcome};

impl Stage {
    pub(super) fn bad_input(&self, topic: &str, error: &NodeFailure) {
        self.counters.count_drop(&format!("unusable message on {topic}"));
        if let Some(held_back) = self.bad_input.pass() {
            tracing::warn!("{topic}: {error} ({held_back} more since the last warning)");
        }
    }

    /// Says how the times of points were understood, when that changes.
    pub(super) fn report_times(&mut self, times: PointTimes) {
        let is_same = match (&self.times, &times) {
            // The span is another one each time.
            (Some(PointTimes::NoRevolution { .. }), PointTimes::NoRevolution { .. }) => true,
            (before, now) => *before == Some(*now),
        };
        if is_same {
            return;
        }
        let is_warning = !matches!(times, PointTimes::Known { .. } | PointTimes::AllTheSame { .. });
        self.counters.note_condition(TIMES, &times.to_string(), is_warning);
        if is_warning {
            tracing::warn!("{times}");
        } else {
            tracing::info!("{times}");
        }
        self.times = Some(times);
    }

    /// Whether a cloud sees another sector than the one before; says so where that goes on.
    pub(super) fn report_sector(&mut self, cloud: &LidarCloud) -> bool {
        let were_parts = self.sectors.are_parts_of_turns();
        let is_another = self.sectors.is_another(&cloud.points_m);
        match (were_parts, self.sectors.are_parts_of_turns()) {
            (false, true) => {
                let text = "degraded: clouds are parts of turns, each of another sector, and the odometry needs whole ones: set the driver to \
                            publish a cloud for each turn";
                self.counters.note_condition(TURNS, text, true);
                tracing::warn!("{text}");
            }
            (true, false) => self.counters.note_condition(TURNS, "clouds are whole turns", false),
            _ => {}
        }
        is_another
    }

    /// Reports the state, in the diagnostics and, where it changes, in the log. So many scans were left out before this one.
    pub(super) fn report_state(&mut self, pose: &LidarPose, left_out: u64) {
        if let Some(mut trouble) = pose.quality.trouble() {
            // The scanner is not to blame for this gap.
            if pose.quality.unknown_s > 0.0 && left_out > 0 {
                let scans = if left_out == 1 { "scan was" } else { "scans were" };
                trouble = format!(
                    "{left_out} {scans} left out, since the node is too slow for its input: {trouble}"
                );
            }
            self.note_trouble(&format!("degraded: {trouble}"));
            self.last_trouble = Some(trouble);
            return;
        }
        if pose.quality.outcome == Outcome::Started {
            let text = format!("initialising: one scan of {} points", pose.quality.points);
            self.counters.note_condition(TRACKING, &text, false);
            return;
        }
        self.counters.note_condition(TRACKING, "tracking", false);
        if self.in_trouble {
            tracing::info!("tracking");
        }
        self.in_trouble = false;
    }

    pub(super) fn note_trouble(&mut self, text: &str) {
        self.counters.note_condition(TRACKING, text, true);
        if !self.in_trouble {
            tracing::warn!("{text}");
        } else if let Some(held_back) = self.troubles.pass() {
            tracing::warn!("{text} ({held_back} more since the last warning)");
        }
        self.in_trouble = true;
    }

    pub(super) fn report(
        &mut self,
        cloud: &LidarCloud,
        (pose, is_another_sector): (&LidarPose, bool),
        timer: &StepTimer,
    ) {
        let number = self.next_scan;
        self.next_scan = self.next_scan.wrapping_add(1);
        let count = |count: usize| count as u64;
        let quality = &pose.quality;
        let is_held = matches!(quality.outcome, Outcome::Held(_) | Outcome::BegunAnew(_));
        let counts = [
            ("received_scans", self.inputs.received()),
            ("measured_points", count(cloud.points_m.len())),
            ("thinned_points", count(quality.points)),
            ("map_voxels", count(quality.map_voxels)),
            ("iterations", count(quality.iterations)),
            ("overlap_percent", (100.0 * quality.overlap) as u64),
            ("predicted_directions", count(quality.degenerate.len())),
            ("held", u64::from(is_held)),
            ("doubtful", u64::from(quality.trouble().is_some())),
            ("without_times", u64::from(cloud.times_s.is_none())),
            ("other_sector", u64::from(is_another_sector)),
            ("after_a_gap", u64::from(quality.unknown_s > 0.0)),
            ("closed_loops", count(self.loops().map_or(0, |known| known.closed))),
        ];
        self.counters.note_fill("map voxels", quality.map_voxels, self.max_map_voxels);
        let (path_poses, most) = self.output.path_fill();
        self.counters.note_fill("path poses", path_poses, most);
        let header: Header = self.output.frames().header(pose.stamp);
        self.reporter.processed(header, number, &counts, timer);
    }
}
