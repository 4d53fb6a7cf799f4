//! The content of poses: the motion of the platform.

use geometry::{Stamp, UnusablePose, check_pose};
use msgs::convert::stamp_from_time;
use msgs::geometry_msgs::{Point, PoseStamped};
use msgs::nav_msgs::Odometry;

use super::{Check, Finding, Subject, Typical};

/// No platform on the ground goes so fast for half of the time: 290 km/h.
const FASTEST_M_PER_S: f64 = 80.0;
/// A fast step is one of at least so much, ...
const LEAST_JUMP_M: f64 = 1.0;
/// ... and faster than this: beyond what a robot's brakes and motors can do between two poses.
const JUMP_M_PER_S: f64 = 20.0;
/// It is a jump at more than so many times the usual speed.
const JUMP_SPEEDS: f64 = 10.0;
/// After a longer time between two poses, messages are missing, and the step is not judged.
const LONGEST_STEP_S: f64 = 1.0;

/// What is known of poses.
#[derive(Clone, PartialEq, Debug, Default)]
pub(in crate::doctor) struct PoseFacts {
    last: Option<(Stamp, nalgebra::Vector3<f64>)>,
    /// Of those too far from their origin to be taken the first reason, and how many they are.
    unusable: Option<(UnusablePose, u64)>,
    /// Of all steps with motion.
    speed_m_per_s: Typical,
    /// Of those of them that are not fast.
    slow_m_per_s: Typical,
    /// Steps that may be jumps.
    fast: Vec<FastStep>,
    /// How many of them follow another one.
    fast_in_a_row: usize,
    was_fast: bool,
}

/// A step at a high speed.
#[derive(Clone, Copy, PartialEq, Debug)]
struct FastStep {
    stamp: Stamp,
    step_m: f64,
    speed_m_per_s: f64,
}

/// Fast steps that are kept at most.
const MOST_FAST: usize = 4096;

/// A message with a pose.
pub(super) trait Positioned {
    fn position(&self) -> (Stamp, &Point);
}

impl Positioned for PoseStamped {
    fn position(&self) -> (Stamp, &Point) {
        (stamp_from_time(self.header.stamp), &self.pose.position)
    }
}

impl Positioned for Odometry {
    fn position(&self) -> (Stamp, &Point) {
        (stamp_from_time(self.header.stamp), &self.pose.pose.position)
    }
}

impl PoseFacts {
    pub(super) fn take(&mut self, message: &impl Positioned) {
        let (stamp, position) = message.position();
        let here = nalgebra::Vector3::new(position.x, position.y, position.z);
        // Those that are no numbers are among the messages that cannot be used.
        if let Err(why @ UnusablePose::TooFar { .. }) = check_pose(&nalgebra::Isometry3::from(here))
        {
            self.unusable.get_or_insert((why, 0)).1 += 1;
        }
        let Some((before, there)) = self.last.replace((stamp, here)) else { return };
        let (step_s, step_m) = (stamp.seconds_since(before), (here - there).norm());
        if step_s <= 0.0 || step_s > LONGEST_STEP_S || !step_m.is_finite() {
            return;
        }
        let speed_m_per_s = step_m / step_s;
        let is_fast = step_m > LEAST_JUMP_M && speed_m_per_s > JUMP_M_PER_S;
        if step_m > 0.0 {
            self.speed_m_per_s.add(speed_m_per_s);
        }
        if step_m > 0.0 && !is_fast {
            self.slow_m_per_s.add(speed_m_per_s);
        }
        if is_fast && self.fast.len() < MOST_FAST {
            self.fast.push(FastStep { stamp, step_m, speed_m_per_s });
            self.fast_in_a_row += usize::from(self.was_fast);
        }
        self.was_fast = is_fast;
    }

    /// The usual speed while there is motion. A platform that goes fast does so for several steps; single ones are jumps.
    fn usual_m_per_s(&self) -> f64 {
        let goes_fast = 2 * self.fast_in_a_row > self.fast.len();
        let speeds = if goes_fast { &self.speed_m_per_s } else { &self.slow_m_per_s };
        speeds.median().unwrap_or_default()
    }

    pub(super) fn findings(&self, subject: &Subject<'_>) -> Vec<Finding> {
        let topic = subject.topic;
        if let Some((why, count)) = &self.unusable {
            return vec![subject.grave(
                Check::Units,
                format!("{topic}: {count} messages cannot be used: {why}"),
                "publish poses in a frame whose origin is near, such as odom (REP-105), or relative to the first one",
            )];
        }
        let usual = self.usual_m_per_s();
        if usual > FASTEST_M_PER_S {
            return vec![subject.grave(
                Check::Units,
                format!(
                    "{topic}: the median speed is {usual:.0} m/s, which is {:.2} m/s if positions are millimetres",
                    usual * 1e-3
                ),
                "poses have metres (REP-103): divide by 1000 in the odometry",
            )];
        }
        let jumps: Vec<&FastStep> =
            self.fast.iter().filter(|jump| jump.speed_m_per_s > JUMP_SPEEDS * usual).collect();
        let largest = jumps.iter().max_by(|one, other| one.step_m.total_cmp(&other.step_m));
        let Some(largest) = largest else { return Vec::new() };
        vec![Finding::warn(
            Check::Motion,
            format!(
                "{topic}: {} jumps among its poses; the largest is {:.2} m at once, at {:.3} s (usual are \
                 {usual:.2} m/s)",
                jumps.len(),
                largest.step_m,
                largest.stamp.seconds_since(Stamp::from_nanos(0))
            ),
            "give the suite the smooth pose (odom, REP-105), not one that closes loops or is reset meanwhile; see that \
             one source alone publishes it",
        )]
    }
}

#[cfg(test)]
mod tests {
    use msgs::convert::time_from_stamp;
    use msgs::geometry_msgs::Pose;
    use msgs::std_msgs::Header;

    use super::*;

    /// What is said of positions along x, at 30 Hz.
    fn said_of(positions_m: impl IntoIterator<Item = f64>) -> Vec<String> {
        let mut facts = PoseFacts::default();
        for (index, x) in positions_m.into_iter().enumerate() {
            let stamp = Stamp::from_nanos(1).plus_seconds(index as f64 / 30.0);
            let header = Header { stamp: time_from_stamp(stamp), ..Header::default() };
            let pose = Pose { position: Point { x, y: 0.0, z: 0.0 }, ..Pose::default() };
            facts.take(&PoseStamped { header, pose });
        }
        let subject = Subject { topic: "/pose", is_read: true, period_s: None };
        facts.findings(&subject).into_iter().map(|finding| finding.what).collect()
    }

    /// Regression: the one jump of a robot at rest was its only motion, and so its usual speed: it was told that its positions were
    /// millimetres, or nothing.
    #[test]
    fn a_jump_of_a_robot_at_rest_is_a_jump() {
        for jump_m in [2.0, 5.0] {
            let said = said_of((0..90).map(|index| if index < 45 { 1.0 } else { 1.0 + jump_m }));
            assert!(said.len() == 1 && said[0].contains("1 jumps"), "{said:?}");
        }
    }

    /// Regression: poses of NaN were told to be too large by a factor, and to be published in a frame whose origin is near.
    #[test]
    fn poses_that_are_no_numbers_are_not_told_to_be_far_away() {
        let lost =
            |index: usize| if index.is_multiple_of(5) { f64::NAN } else { 0.01 * index as f64 };
        assert_eq!(said_of((0..90).map(lost)), Vec::<String>::new());
    }

    /// Regression: poses in coordinates of the earth, which no node takes, were in order for `doctor`.
    #[test]
    fn poses_too_far_from_their_origin_are_told() {
        let said = said_of((0..90).map(|index| 4.5e5 + f64::from(index)));
        assert!(said.len() == 1 && said[0].contains("90 messages cannot be used"), "{said:?}");
    }

    #[test]
    fn who_goes_fast_does_not_jump_and_millimetres_are_told() {
        let at = |speed: f64| (0..90).map(move |index| speed * f64::from(index) / 30.0);
        assert_eq!(said_of(at(0.5)), Vec::<String>::new());
        // A car on a motorway, after it has waited.
        let waits = std::iter::repeat_n(0.0, 120);
        assert_eq!(said_of(waits.chain(at(40.0))), Vec::<String>::new());
        let millimetres = said_of(at(500.0));
        assert!(
            millimetres.len() == 1 && millimetres[0].contains("millimetres"),
            "{millimetres:?}"
        );
    }
}
