//! The content of poses: the motion of the platform.

use geometry::Stamp;
use msgs::convert::stamp_from_time;
use msgs::geometry_msgs::{Point, PoseStamped};
use msgs::nav_msgs::Odometry;

use super::{Check, Finding, Subject, Typical};

/// No platform on the ground goes so fast for half of the time: 290 km/h.
const FASTEST_M_PER_S: f64 = 80.0;
/// A jump is a step of at least so much, ...
const LEAST_JUMP_M: f64 = 1.0;
/// ... at so many times the usual speed, ...
const JUMP_SPEEDS: f64 = 10.0;
/// ... and faster than this: beyond what a robot's brakes and motors can do between two poses.
const JUMP_M_PER_S: f64 = 20.0;
/// After a longer time between two poses, messages are missing, and the step is not judged.
const LONGEST_STEP_S: f64 = 1.0;

/// What is known of poses.
#[derive(Clone, PartialEq, Debug, Default)]
pub(in crate::doctor) struct PoseFacts {
    last: Option<(Stamp, nalgebra::Vector3<f64>)>,
    /// Of all steps with motion.
    speed_m_per_s: Typical,
    /// Steps at a speed that no platform has.
    jumps: Vec<Jump>,
}

/// A step at a high speed.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Jump {
    stamp: Stamp,
    step_m: f64,
    speed_m_per_s: f64,
}

/// Jumps that are kept at most.
const MOST_JUMPS: usize = 4096;

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
        let Some((before, there)) = self.last.replace((stamp, here)) else { return };
        let (step_s, step_m) = (stamp.seconds_since(before), (here - there).norm());
        if step_s <= 0.0 || step_s > LONGEST_STEP_S || !step_m.is_finite() {
            return;
        }
        let speed_m_per_s = step_m / step_s;
        if step_m > 0.0 {
            self.speed_m_per_s.add(speed_m_per_s);
        }
        if step_m > LEAST_JUMP_M && speed_m_per_s > JUMP_M_PER_S && self.jumps.len() < MOST_JUMPS {
            self.jumps.push(Jump { stamp, step_m, speed_m_per_s });
        }
    }

    pub(super) fn findings(&self, subject: &Subject<'_>) -> Vec<Finding> {
        let topic = subject.topic;
        let Some(usual) = self.speed_m_per_s.median() else { return Vec::new() };
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
        let jumps: Vec<&Jump> =
            self.jumps.iter().filter(|jump| jump.speed_m_per_s > JUMP_SPEEDS * usual).collect();
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
