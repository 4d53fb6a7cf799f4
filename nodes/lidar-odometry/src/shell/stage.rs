//! The core with its topics: every scan ends in a pose, or in a reason why there is none.

use geometry::{LidarCloud, Revolution, Stamp};
use msgs::convert::{self, LidarCloudReading, PointTimes, TimeUnit};
use msgs::std_msgs::Header;
use msgs::velodyne_msgs::VelodyneScan;
use nalgebra::Isometry3;
use node_shell::{Counters, Node, NodeFailure, StageReporter, StepTimer, Throttle};

use super::PROGRAM;
use super::hints::Hints;
use super::inputs::{Arrival, Inputs};
use super::network::told;
use super::output::Output;
use super::parameters::LidarOdometryParameters;
use super::pictures::{Pictures, Seen};
use crate::live::LiveCounts;
use crate::odometry::{Follower, FollowerError, LidarPose, Outcome, Refusal, deskewed_cloud};
use crate::revolution::{BuiltRevolution, RevolutionAssembly};

/// The conditions in the diagnostics.
const TRACKING: &str = "tracking";
const TIMES: &str = "times of points";
const PACKETS: &str = "packets";
const PANORAMA: &str = "panorama";
/// A scan that comes so much too early belongs to another time: a recording begins anew. A scan that is a little late does not.
const BACK_IN_TIME_S: f64 = 0.5;
/// So many late ones in a row are another time, too.
const MOST_LATE_SCANS: u32 = 3;

/// The core with its topics.
pub struct Stage {
    inputs: Inputs,
    unit: Option<TimeUnit>,
    assembly: RevolutionAssembly,
    hints: Hints,
    follower: Follower,
    output: Output,
    pictures: Pictures,
    reporter: StageReporter,
    counters: Counters,
    max_map_voxels: usize,
    next_scan: u32,
    late_scans: u32,
    times: Option<PointTimes>,
    /// Where the scanner was last, and when.
    last: Option<(Stamp, Isometry3<f64>)>,
    in_trouble: bool,
    bad_input: Throttle,
    troubles: Throttle,
}

impl Stage {
    /// The stage that `node` is.
    ///
    /// # Errors
    /// When a parameter is out of its range, a topic cannot be had, or nobody can listen on the scanner's port.
    pub fn new(node: &Node, parameters: &LidarOdometryParameters) -> Result<Self, NodeFailure> {
        use node_shell::parameters::NodeParameters;
        parameters.validate()?;
        let counters = node.counters();
        let inputs = Inputs::subscribe(node, parameters)?;
        let waits = format!("initialising: waits for scans of {}", inputs.source());
        counters.note_condition(TRACKING, &waits, true);
        Ok(Self {
            inputs,
            unit: parameters.unit(),
            assembly: RevolutionAssembly::new(parameters.decoder()?, parameters.revolution())?,
            hints: Hints::new(parameters),
            follower: Follower::new(parameters.follower(), parameters.thread_count())?,
            output: Output::new(node, parameters)?,
            pictures: Pictures::new(node, parameters)?,
            reporter: StageReporter::new(node, PROGRAM.name)?,
            counters,
            max_map_voxels: parameters.max_map_voxels,
            next_scan: 0,
            late_scans: 0,
            times: None,
            last: None,
            in_trouble: true,
            bad_input: Throttle::for_warnings(),
            troubles: Throttle::for_warnings(),
        })
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
                    self.tell_times(times);
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

    fn bad_input(&self, topic: &str, error: &NodeFailure) {
        self.counters.count_drop(&format!("unusable message on {topic}"));
        if let Some(held_back) = self.bad_input.pass() {
            tracing::warn!("{topic}: {error} ({held_back} more since the last warning)");
        }
    }

    /// Says how the times of points were understood, when that changes.
    fn tell_times(&mut self, times: PointTimes) {
        let is_same = match (&self.times, &times) {
            // The span is another one each time.
            (Some(PointTimes::NoRevolution { .. }), PointTimes::NoRevolution { .. }) => true,
            (before, now) => *before == Some(*now),
        };
        if is_same {
            return;
        }
        let is_warning = !matches!(times, PointTimes::Told { .. } | PointTimes::AllTheSame { .. });
        self.counters.note_condition(TIMES, &times.to_string(), is_warning);
        if is_warning {
            tracing::warn!("{times}");
        } else {
            tracing::info!("{times}");
        }
        self.times = Some(times);
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
        let (text, is_warning) = told(&LiveCounts::default(), &counts, 0);
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

    fn scan(&mut self, cloud: &LidarCloud, revolution: Option<&Revolution>, mut timer: StepTimer) {
        timer.end_of("decode");
        let hint = self.hints.between(self.follower.interval(cloud));
        let mut stepped = self.follower.step(cloud, &hint);
        if let Err(FollowerError::Scan(Refusal::NotLater { since_s })) = stepped {
            self.late_scans += 1;
            if since_s < -BACK_IN_TIME_S || self.late_scans >= MOST_LATE_SCANS {
                tracing::warn!("time has gone back by {:.3} s: everything begins anew", -since_s);
                self.forget();
                stepped = self.follower.step(cloud, &hint);
            }
        }
        timer.end_of("odometry");
        let pose = match stepped {
            Ok(pose) => pose,
            Err(error) => {
                self.note_trouble(&format!("degraded: {error}"));
                let reason = error.to_string();
                let header = self.output.frames().header(cloud.stamp);
                let counts = [("received_scans", self.inputs.received())];
                let cycle = self.next_scan;
                return self.reporter.dropped(header, cycle, ("unusable scan", &reason), &counts);
            }
        };
        self.late_scans = 0;
        self.tell(&pose);
        let odom_from_base = self.output.publish(&pose);
        self.show(cloud, revolution, &pose, odom_from_base);
        timer.end_of("publish");
        self.report(cloud, &pose, &timer);
        self.last = Some((pose.stamp, pose.odom_from_lidar));
    }

    /// Drops all that is held, and begins anew.
    pub(super) fn reset(&mut self) {
        self.forget();
        self.hints.forget();
        drop(self.assembly.finish());
    }

    fn forget(&mut self) {
        self.follower.forget();
        self.output.forget();
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
        let last = self.last;
        let points_m = || match last {
            Some((stamp, last)) => {
                let passed_s = pose.stamp.seconds_since(stamp);
                deskewed_cloud(cloud, &last.inv_mul(&pose.odom_from_lidar), passed_s)
            }
            None => cloud.points_m.clone(),
        };
        let seen =
            Seen { cloud, revolution, points_m: &points_m, stamp: pose.stamp, odom_from_base };
        let lacks_rings = self.pictures.publish(&seen, &self.follower, self.output.frames());
        if lacks_rings {
            self.counters.note_condition(
                PANORAMA,
                "the clouds tell no rings (a field `ring`, or a row for each laser): no panorama can be drawn",
                true,
            );
        }
    }

    /// Says how it goes, in the diagnostics and, where it changes, in the log.
    fn tell(&mut self, pose: &LidarPose) {
        if let Some(trouble) = pose.quality.trouble() {
            return self.note_trouble(&format!("degraded: {trouble}"));
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

    fn note_trouble(&mut self, text: &str) {
        self.counters.note_condition(TRACKING, text, true);
        if !self.in_trouble {
            tracing::warn!("{text}");
        } else if let Some(held_back) = self.troubles.pass() {
            tracing::warn!("{text} ({held_back} more since the last warning)");
        }
        self.in_trouble = true;
    }

    fn report(&mut self, cloud: &LidarCloud, pose: &LidarPose, timer: &StepTimer) {
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
        ];
        self.counters.note_fill("map voxels", quality.map_voxels, self.max_map_voxels);
        let (path_poses, most) = self.output.path_fill();
        self.counters.note_fill("path poses", path_poses, most);
        let header: Header = self.output.frames().header(pose.stamp);
        self.reporter.processed(header, number, &counts, timer);
    }
}
