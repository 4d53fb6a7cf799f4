//! The core with its topics: every scan ends in a pose, or in a reason why there is none.

mod reporting;
mod sectors;

use std::sync::Arc;

use geometry::{LidarCloud, Revolution, Stamp};
use msgs::convert::{self, LidarCloudReading, PointTimes, TimeUnit};
use msgs::velodyne_msgs::VelodyneScan;
use nalgebra::{Isometry3, Point3};
use node_shell::parameters::NodeParameters;
use node_shell::{
    Counters, Node, NodeFailure, Panicked, StageReporter, StampCheck, StampOrder, StepTimer,
    Throttle,
};

use super::PROGRAM;
use super::hints::Hints;
use super::inputs::{Arrival, Inputs};
use super::loops::Loops;
use super::network::summary;
use super::output::Output;
use super::parameters::LidarOdometryParameters;
use super::pictures::{Pictures, Seen};
use crate::live::LiveCounts;
use crate::loop_closing::KnownLoops;
use crate::odometry::{Follower, FollowerError, LidarPose, Outcome, Refusal, deskewed_cloud};
use crate::revolution::{BuiltRevolution, RevolutionAssembly};
use sectors::Sectors;

/// The conditions in the diagnostics.
const TRACKING: &str = "tracking";
const TIMES: &str = "times of points";
const TURNS: &str = "turns";
const PACKETS: &str = "packets";
const PANORAMA: &str = "panorama";
/// What makes a scan take less time.
const REMEDY: &str =
    "raise scan_voxel_edge_m and map_voxel_edge_m, or let the scanner send fewer points or scans";
/// This many scans in a row that are a little late are another time.
const MOST_LATE_SCANS: u32 = 3;

/// The core with its topics.
pub struct Stage {
    inputs: Inputs,
    unit: Option<TimeUnit>,
    assembly: RevolutionAssembly,
    hints: Hints,
    follower: Follower,
    output: Output,
    loops: Option<Loops>,
    pictures: Pictures,
    reporter: StageReporter,
    counters: Counters,
    max_map_voxels: usize,
    next_scan: u32,
    late_scans: u32,
    /// How many were left out by the last pose.
    left_out: u64,
    stamp_check: StampCheck,
    times: Option<PointTimes>,
    sectors: Sectors,
    /// Where the scanner was last, and when.
    last: Option<(Stamp, Isometry3<f64>)>,
    in_trouble: bool,
    last_trouble: Option<String>,
    bad_input: Throttle,
    troubles: Throttle,
}

impl Stage {
    /// The cause in the diagnostics of scans after the end of a recording.
    pub const AFTER_THE_END: &str = "after time went back";

    /// The stage that `node` is.
    ///
    /// # Errors
    /// When a parameter is out of its range, a topic cannot be created, or listening on the scanner's port fails.
    pub fn new(node: &Node, parameters: &LidarOdometryParameters) -> Result<Self, NodeFailure> {
        parameters.validate_node()?;
        let counters = node.counters();
        let inputs = Inputs::subscribe(node, parameters)?;
        let waits = format!("initialising: waits for scans of {}", inputs.source());
        counters.note_condition(TRACKING, &waits, true);
        Ok(Self {
            inputs,
            unit: parameters.unit(),
            assembly: RevolutionAssembly::new(parameters.decoder()?, parameters.revolution())?,
            hints: Hints::new(parameters),
            follower: Follower::new(parameters.follower(), parameters.executor())?,
            output: Output::new(node, parameters)?,
            loops: Loops::new(node, parameters)?,
            pictures: Pictures::new(node, parameters)?,
            reporter: StageReporter::new(node, PROGRAM.name)?,
            counters,
            max_map_voxels: parameters.max_map_voxels,
            next_scan: 0,
            late_scans: 0,
            left_out: 0,
            stamp_check: StampCheck::default(),
            times: None,
            sectors: Sectors::default(),
            last: None,
            in_trouble: true,
            last_trouble: None,
            bad_input: Throttle::for_warnings(),
            troubles: Throttle::for_warnings(),
        })
    }

    /// For a recording: where its time goes back it ends, in place of beginning anew at another place.
    #[must_use]
    pub fn of_a_recording(self) -> Self {
        Self { stamp_check: StampCheck::of_a_recording(), ..self }
    }

    /// The next message. May be dropped while it waits.
    pub(super) async fn next(&mut self) -> Arrival {
        self.inputs.next().await
    }

    /// Takes every message that is here already.
    pub fn take_waiting(&mut self) {
        while let Some(arrival) = self.inputs.try_next() {
            self.take(arrival);
        }
    }

    /// Nothing more will come: what was collected of a revolution is taken, if it is a whole one.
    pub fn end_of_input(&mut self) {
        if let Some(built) = self.assembly.finish() {
            self.built(&built, StepTimer::start());
        }
    }

    #[cfg(test)]
    pub(super) fn inputs(&self) -> &Inputs {
        &self.inputs
    }

    pub(super) fn take(&mut self, arrival: Arrival) {
        let timer = StepTimer::start();
        let taken = match arrival {
            Arrival::Cloud(message) => match convert::lidar_cloud_from_message(&message, self.unit)
            {
                Ok(LidarCloudReading { cloud, times }) => {
                    // An empty cloud says nothing of them.
                    if !cloud.points_m.is_empty() {
                        self.report_times(times);
                    }
                    self.scan(&cloud, None, timer);
                    Ok(())
                }
                Err(error) => Err((self.inputs.source(), error.into())),
            },
            Arrival::Packets(message) => {
                self.packets(&message);
                Ok(())
            }
            Arrival::Turn(built) => {
                self.built(&built, timer);
                Ok(())
            }
            Arrival::Imu(message) => {
                self.hints.take_imu(&message).map_err(|error| ("imu".to_owned(), error))
            }
            Arrival::Wheels(message) => {
                self.hints.take_wheels(&message).map_err(|error| ("wheels".to_owned(), error))
            }
        };
        if let Err((topic, error)) = taken {
            self.bad_input(&topic, &error);
        }
    }

    fn packets(&mut self, message: &VelodyneScan) {
        let before = self.assembly.counts();
        for packet in &message.packets {
            let arrival = convert::stamp_from_time(packet.stamp);
            let timer = StepTimer::start();
            if let Some(mut built) = self.assembly.push(&packet.data, arrival) {
                built.revolution.frame_id.clone_from(&message.header.frame_id);
                self.built(&built, timer);
            }
        }
        let counts = self.assembly.counts();
        let (text, is_warning) = summary(&LiveCounts::default(), &counts, 0);
        let scanner = self.assembly.scanner().map(|(model, mode)| format!("{model}, {mode:?}: "));
        self.counters.note_condition(PACKETS, &(scanner.unwrap_or_default() + &text), is_warning);
        if counts.refused > before.refused
            && let Some(error) = counts.last_refusal
        {
            self.bad_input(&self.inputs.source(), &error.into());
        }
    }

    /// Parts of a turn are none: the first one of a recording, and the last.
    fn built(&mut self, built: &BuiltRevolution, timer: StepTimer) {
        if built.is_whole() {
            let revolution = &built.revolution;
            self.scan(&LidarCloud::from(revolution), Some(revolution), timer);
        }
    }

    fn scan(&mut self, cloud: &LidarCloud, revolution: Option<&Revolution>, timer: StepTimer) {
        // The local map stays after a panic: without it the pose would begin at another place.
        if let Err(panicked) = node_shell::caught(|| self.follow(cloud, revolution, timer)) {
            self.drop_scan(cloud.stamp, Panicked::CAUSE, &panicked.to_string());
        }
    }

    fn drop_scan(&self, stamp: Stamp, cause: &str, reason: &str) {
        let header = self.output.frames().header(stamp);
        let counts = [("received_scans", self.inputs.received())];
        self.reporter.dropped(header, self.next_scan, (cause, reason), &counts);
    }

    fn follow(
        &mut self,
        cloud: &LidarCloud,
        revolution: Option<&Revolution>,
        mut timer: StepTimer,
    ) {
        timer.end_of("decode");
        let left_out = self.inputs.left_out();
        match self.stamp_check.judge(cloud.stamp, self.last.map(|(stamp, _)| stamp)) {
            StampOrder::Follows => {}
            StampOrder::Doubtful { later_s } => {
                let reason = format!(
                    "its stamp is {:.3} s {} that of the last scan, and no other scan's agrees",
                    later_s.abs(),
                    if later_s < 0.0 { "before" } else { "after" }
                );
                self.note_trouble(&format!("degraded: a scan is left out: {reason}"));
                return self.drop_scan(cloud.stamp, "doubtful stamp", &reason);
            }
            StampOrder::BeginsAnew { later_s } => self.begin_anew(later_s),
            StampOrder::Ended => return self.drop_after_the_end(cloud.stamp),
        }
        let hint = self.hints.between(self.follower.interval(cloud));
        let mut stepped = self.follower.step(cloud, &hint);
        if let Err(FollowerError::Scan(Refusal::NotLater { since_s })) = stepped {
            self.late_scans += 1;
            if self.late_scans >= MOST_LATE_SCANS {
                let StampOrder::BeginsAnew { later_s } = self.stamp_check.go_back(since_s) else {
                    return self.drop_after_the_end(cloud.stamp);
                };
                self.begin_anew(later_s);
                stepped = self.follower.step(cloud, &hint);
            }
        }
        timer.end_of("odometry");
        let pose = match stepped {
            Ok(pose) => pose,
            Err(error) => {
                self.note_trouble(&format!("degraded: {error}"));
                return self.drop_scan(cloud.stamp, "unusable scan", &error.to_string());
            }
        };
        self.late_scans = 0;
        let is_another_sector = self.report_sector(cloud);
        let before_this = left_out.saturating_sub(std::mem::replace(&mut self.left_out, left_out));
        self.report_state(&pose, before_this);
        let odom_from_base = self.output.publish(&pose);
        self.show(cloud, revolution, &pose, odom_from_base);
        timer.end_of("publish");
        self.look_for_a_loop(cloud, &pose, &odom_from_base);
        timer.end_of("loops");
        self.report(cloud, (&pose, is_another_sector), &timer);
        self.reporter.keeps_pace(self.inputs.left_out(), &timer, REMEDY);
        self.last = Some((pose.stamp, pose.odom_from_lidar));
    }

    fn drop_after_the_end(&self, stamp: Stamp) {
        let reason = "the recording ended where its time goes back";
        self.drop_scan(stamp, Self::AFTER_THE_END, reason);
    }

    fn begin_anew(&mut self, later_s: f64) {
        tracing::warn!("time has gone back by {:.3} s: everything begins anew", -later_s);
        self.forget();
    }

    /// Drops all state, and begins anew.
    pub(super) fn reset(&mut self) {
        self.forget();
        self.hints.forget();
        drop(self.assembly.finish());
    }

    fn forget(&mut self) {
        self.follower.forget();
        self.output.forget();
        self.loops.iter_mut().for_each(Loops::forget);
        self.pictures.forget();
        self.last = None;
        self.late_scans = 0;
        self.in_trouble = true;
    }

    fn show(
        &mut self,
        cloud: &LidarCloud,
        revolution: Option<&Revolution>,
        pose: &LidarPose,
        odom_from_base: Isometry3<f64>,
    ) {
        let points_m = || at_once(cloud, pose, self.last.as_ref());
        let seen =
            Seen { cloud, revolution, points_m: &points_m, stamp: pose.stamp, odom_from_base };
        let lacks_rings = self.pictures.publish(&seen, &self.follower, self.output.frames());
        if lacks_rings {
            self.counters.note_condition(
                PANORAMA,
                "the clouds have no rings (a field `ring`, or a row for each laser): no panorama can be drawn",
                true,
            );
        }
    }

    /// A predicted pose is no place to come back to.
    fn look_for_a_loop(
        &mut self,
        cloud: &LidarCloud,
        pose: &LidarPose,
        odom_from_base: &Isometry3<f64>,
    ) {
        let is_measured = matches!(pose.quality.outcome, Outcome::Started | Outcome::Matched);
        if let Some(loops) = self.loops.as_mut().filter(|_| is_measured) {
            let last = self.last.as_ref();
            loops.take(pose.stamp, odom_from_base, &|| at_once(cloud, pose, last));
        }
    }

    /// By how much time has gone back where the recording ended; `None` while it has not.
    #[must_use]
    pub fn gone_back_s(&self) -> Option<f64> {
        self.stamp_check.gone_back_s()
    }

    /// The known loops as of the last scan; `None` without loop closing.
    #[must_use]
    pub fn loops(&self) -> Option<Arc<KnownLoops>> {
        self.loops.as_ref().map(Loops::known)
    }

    /// The problem of the last degraded scan; `None` while there was none.
    #[must_use]
    pub fn last_trouble(&self) -> Option<&str> {
        self.last_trouble.as_deref()
    }

    /// How the times of the points of the last cloud were understood; `None` before it, and of packets, which have times.
    #[must_use]
    pub fn point_times(&self) -> Option<PointTimes> {
        self.times
    }

    #[cfg(test)]
    pub(super) fn warnings(&self) -> Vec<String> {
        self.counters.warnings()
    }

    #[cfg(test)]
    pub(super) fn have_loops_looked_for(&mut self, by: Loops) {
        self.loops = Some(by);
    }
}

/// The points of a cloud as if all had been measured at the pose, by the motion since the last one.
fn at_once(
    cloud: &LidarCloud,
    pose: &LidarPose,
    last: Option<&(Stamp, Isometry3<f64>)>,
) -> Vec<Point3<f32>> {
    let Some((stamp, last)) = last else { return cloud.points_m.clone() };
    let motion = last.inv_mul(&pose.odom_from_lidar);
    deskewed_cloud(cloud, &motion, pose.stamp.seconds_since(*stamp))
}
