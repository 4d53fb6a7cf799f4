//! The node's own state: in its log, its diagnostics and its reports.

use geometry::Stamp;
use msgs::convert;
use msgs::sensor_msgs::Image;
use msgs::std_msgs::Header;
use node_shell::StepTimer;

use super::Stage;
use crate::frame::Frame;
use crate::shell::follower::InMap;
use crate::tracking::{FeatureStatus, Tracked};

/// The condition in the diagnostics.
const REGISTRATION: &str = "depth registration";

impl Stage {
    /// Reports, once, that the depth images may be another camera's.
    pub(super) fn check_registration(&mut self, color: &Image, depth: &Image) {
        let doubt = self.cameras.registration_doubt(color, depth);
        if doubt == self.registration_doubt {
            return;
        }
        match &doubt {
            Some(doubt) => {
                tracing::warn!("{doubt}");
                self.counters.note_condition(REGISTRATION, doubt, true);
            }
            None => self.counters.note_condition(REGISTRATION, "ok", false),
        }
        self.registration_doubt = doubt;
    }

    pub(super) fn report(
        &mut self,
        stamp: Stamp,
        frame: &Frame,
        (tracked, in_map): (&Tracked, Option<&InMap>),
        timer: &StepTimer,
    ) {
        let number = self.next_frame;
        let Some(_) = tracked.pose else {
            let reason = tracked
                .trouble
                .map_or_else(|| "no pose was found".to_owned(), |trouble| trouble.to_string());
            return self.drop_frame(stamp, "no pose", &reason);
        };
        self.next_frame = self.next_frame.wrapping_add(1);
        let count = |count: usize| count as u64;
        let map = self.follower.tracker().map();
        let mut counts = self.inputs.counts().to_vec();
        counts.extend([
            ("corners", count(frame.corners.len())),
            ("segments", count(frame.lines.len())),
            ("inliers", count(tracked.count(FeatureStatus::Inlier))),
            ("outliers", count(tracked.count(FeatureStatus::Outlier))),
            ("left_out", count(tracked.count(FeatureStatus::LeftOut))),
            ("landmarks", count(map.points().len() + map.lines().len())),
        ]);
        counts.extend(in_map.map(|in_map| ("keyframes", count(in_map.keyframes))));
        counts.extend(
            in_map.map(|in_map| (Self::CLOSED_LOOPS, in_map.closed_m.iter().count() as u64)),
        );
        self.reporter.processed(self.header(stamp), number, &counts, timer);
    }

    pub(super) fn drop_frame(&self, stamp: Stamp, cause: &str, reason: &str) {
        let counts = self.inputs.counts();
        self.reporter.dropped(self.header(stamp), self.next_frame, (cause, reason), &counts);
    }

    pub(super) fn header(&self, stamp: Stamp) -> Header {
        let frame_id = self.output.frames().odom_frame_id.clone();
        Header { stamp: convert::time_from_stamp(stamp), frame_id }
    }
}
