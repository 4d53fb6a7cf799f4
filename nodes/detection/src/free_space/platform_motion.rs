//! The motion of the platform, and the noise of its poses.

use std::collections::VecDeque;

use geometry::Stamp;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::config::FreeSpaceConfig;

/// The velocity is not computed from poses farther apart in time.
const LONGEST_TWIST_S: f64 = 1.0;
/// A step that is never a jump, whatever the time: noise of the pose source, or a small correction.
const JUMP_SLACK_M: f64 = 0.3;
/// The same of the rotation.
const JUMP_SLACK_RAD: f64 = 0.3;
/// The platform counts as moving if it has moved within this time: scans of that time have the errors of its poses.
const LOOK_BACK_S: f64 = 1.5;
/// Positions of that time at most: more than any scanner yields.
const MOST_PLACES: usize = 256;
/// A platform that has not moved farther is static: the noise of its poses.
const STANDS_M: f64 = 0.05;
/// The same of the rotation: five standard deviations of half a degree.
const STANDS_RAD: f64 = 0.045;
/// Steps of the pose from which its noise is estimated: a second and a half at 7 Hz.
const STEPS_KEPT: usize = 10;

/// The velocity of the rig in its own frame; where a joint moves the scanner on the rig, of a rig that the scanner stays fixed to.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Twist {
    /// Of the rig's origin.
    pub(super) linear_m_per_s: Vector3<f64>,
    /// The rotation's axis times its rate.
    pub(super) angular_rad_per_s: Vector3<f64>,
}

impl Twist {
    const ZERO: Self = Self {
        linear_m_per_s: Vector3::new(0.0, 0.0, 0.0),
        angular_rad_per_s: Vector3::new(0.0, 0.0, 0.0),
    };

    pub(super) fn is_zero(&self) -> bool {
        *self == Self::ZERO
    }

    /// The velocity of a body as another frame of it has it, which is `moved_from_own` in the own frame of this one.
    fn seen_from(&self, moved_from_own: &Isometry3<f64>) -> Self {
        let origin = moved_from_own.inverse().translation.vector;
        let of_origin = self.linear_m_per_s + self.angular_rad_per_s.cross(&origin);
        Self {
            linear_m_per_s: moved_from_own.rotation * of_origin,
            angular_rad_per_s: moved_from_own.rotation * self.angular_rad_per_s,
        }
    }

    /// The pose of the rig `after_s` later, in its present frame.
    pub(super) fn after(&self, after_s: f64) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::from(self.linear_m_per_s * after_s),
            UnitQuaternion::from_scaled_axis(self.angular_rad_per_s * after_s),
        )
    }
}

/// A step of the pose from a cycle to the next that no platform makes: its source has corrected itself, or was lost.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PoseJump {
    /// Length of the step, in metres.
    pub step_m: f64,
    /// Angle of the step, in radians.
    pub step_rad: f64,
    /// The time between the two poses, in seconds.
    pub passed_s: f64,
}

/// The platform's motion in one cycle.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Motion {
    /// The pose does not continue the former ones, as it has jumped, or is of another frame or time: earlier observations are of
    /// no use.
    pub(super) jumped: bool,
    /// The step, if it is that which no platform makes.
    pub(super) jump: Option<PoseJump>,
    /// The velocity between the last two cycles.
    pub(super) twist: Twist,
    /// How much the velocity differs from the one before: the error of a constant twist.
    pub(super) twist_change: Twist,
    /// Whether the platform has moved or turned recently.
    pub(super) moves: bool,
    /// Standard deviation of the position.
    pub(super) pose_noise_m: f64,
    /// Standard deviation of the heading.
    pub(super) pose_noise_rad: f64,
}

/// Follows the poses of the cycles.
///
/// What matters is how the scanner moves. Where a joint moves it on the rig, the former poses are those that the rig would have had,
/// were the scanner where it is on it now.
#[derive(Clone, Debug)]
pub(super) struct PlatformMotion {
    max_speed_m_per_s: f64,
    max_turn_rad_per_s: f64,
    longest_gap_s: f64,
    noise_m: f64,
    noise_rad: f64,
    /// Where the scanner is on the rig.
    rig_from_lidar: Option<Isometry3<f64>>,
    previous: Option<Previous>,
    /// Length and angle of the last steps.
    steps: VecDeque<(f64, f64)>,
    /// Its recent positions.
    places: VecDeque<(Stamp, Isometry3<f64>)>,
}

#[derive(Clone, Debug)]
struct Previous {
    stamp: Stamp,
    map_from_rig: Isometry3<f64>,
    map_frame_id: String,
    motion: Motion,
}

impl Previous {
    fn is_at(&self, stamp: Stamp, map_from_rig: &Isometry3<f64>, map_frame_id: &str) -> bool {
        self.stamp == stamp
            && self.map_from_rig == *map_from_rig
            && self.map_frame_id == map_frame_id
    }
}

impl PlatformMotion {
    pub(super) fn new(config: &FreeSpaceConfig) -> Self {
        Self {
            max_speed_m_per_s: config.max_platform_speed_m_per_s,
            max_turn_rad_per_s: config.max_platform_turn_rad_per_s,
            longest_gap_s: config.evidence_memory_s,
            noise_m: config.pose_noise_m,
            noise_rad: config.pose_noise_rad,
            rig_from_lidar: None,
            previous: None,
            steps: VecDeque::new(),
            places: VecDeque::new(),
        }
    }

    pub(super) fn clear(&mut self) {
        self.rig_from_lidar = None;
        self.previous = None;
        self.steps.clear();
        self.places.clear();
    }

    /// Takes where the scanner is on the rig, before the pose of the cycle.
    pub(super) fn mount(&mut self, rig_from_lidar: &Isometry3<f64>) {
        let Some(before) = self.rig_from_lidar.replace(*rig_from_lidar) else { return };
        if before == *rig_from_lidar {
            return;
        }
        let moved_from_before = rig_from_lidar * before.inverse();
        let before_from_moved = moved_from_before.inverse();
        for (_, place) in &mut self.places {
            *place *= before_from_moved;
        }
        if let Some(previous) = &mut self.previous {
            previous.map_from_rig *= before_from_moved;
            let twist = &mut previous.motion.twist;
            *twist = twist.seen_from(&moved_from_before);
        }
    }

    /// Adds the pose of the next cycle. One with the stamp of the last cycle's is of the same image, for the next scan: it is the
    /// same pose, and the motion is what it was.
    ///
    /// The noise of the poses cannot be larger than their steps: a pose that does not change is exact
    /// from cycle to cycle, so the noise of a moving platform does not affect a static one.
    pub(super) fn advance(
        &mut self,
        stamp: Stamp,
        map_from_rig: &Isometry3<f64>,
        map_frame_id: &str,
    ) -> Motion {
        let mut motion = Motion {
            jumped: false,
            jump: None,
            twist: Twist::ZERO,
            twist_change: Twist::ZERO,
            moves: false,
            pose_noise_m: 0.0,
            pose_noise_rad: 0.0,
        };
        if let Some(previous) = &self.previous {
            if previous.is_at(stamp, map_from_rig, map_frame_id) {
                return Motion { jumped: false, jump: None, ..previous.motion };
            }
            let passed_s = stamp.seconds_since(previous.stamp);
            // The product of a pose with its own inverse is not the identity to the bit.
            let step = if previous.map_from_rig == *map_from_rig {
                Isometry3::identity()
            } else {
                previous.map_from_rig.inv_mul(map_from_rig)
            };
            let (step_m, step_rad) = (step.translation.vector.norm(), step.rotation.angle());
            let most_m = JUMP_SLACK_M + self.max_speed_m_per_s * passed_s;
            let most_rad = JUMP_SLACK_RAD + self.max_turn_rad_per_s * passed_s;
            let continues = (0.0..=self.longest_gap_s).contains(&passed_s)
                && previous.map_frame_id == map_frame_id;
            let is_too_far = step_m > most_m || step_rad > most_rad;
            motion.jump =
                (continues && is_too_far).then_some(PoseJump { step_m, step_rad, passed_s });
            motion.jumped = !continues || is_too_far;
            if motion.jumped {
                self.steps.clear();
                self.places.clear();
            } else {
                if self.steps.len() == STEPS_KEPT {
                    self.steps.pop_front();
                }
                self.steps.push_back((step_m, step_rad));
                if passed_s > 0.0 && passed_s <= LONGEST_TWIST_S {
                    motion.twist = Twist {
                        linear_m_per_s: step.translation.vector / passed_s,
                        angular_rad_per_s: step.rotation.scaled_axis() / passed_s,
                    };
                    let before = &previous.motion.twist;
                    motion.twist_change = Twist {
                        linear_m_per_s: motion.twist.linear_m_per_s - before.linear_m_per_s,
                        angular_rad_per_s: motion.twist.angular_rad_per_s
                            - before.angular_rad_per_s,
                    };
                }
            }
        }
        let largest = |of: fn(&(f64, f64)) -> f64| self.steps.iter().map(of).fold(0.0, f64::max);
        motion.pose_noise_m = self.noise_m.min(largest(|step| step.0));
        motion.pose_noise_rad = self.noise_rad.min(largest(|step| step.1));
        let is_old =
            |(then, _): &(Stamp, _)| !(0.0..=LOOK_BACK_S).contains(&stamp.seconds_since(*then));
        while self.places.front().is_some_and(is_old) || self.places.len() >= MOST_PLACES {
            self.places.pop_front();
        }
        self.places.push_back((stamp, *map_from_rig));
        motion.moves = self.places.iter().any(|(_, place)| {
            let displacement = place.inv_mul(map_from_rig);
            displacement.translation.vector.norm() > STANDS_M
                || displacement.rotation.angle() > STANDS_RAD
        });
        self.previous = Some(Previous {
            stamp,
            map_from_rig: *map_from_rig,
            map_frame_id: map_frame_id.to_owned(),
            motion,
        });
        motion
    }
}

#[cfg(test)]
mod tests {
    use geometry::pose_from_vector;

    use super::*;

    fn at(cycle: u32) -> Stamp {
        Stamp::default().plus_seconds(f64::from(cycle) * 0.1)
    }

    #[test]
    fn a_pose_that_does_not_change_is_static_and_exact() {
        let mut motion = PlatformMotion::new(&FreeSpaceConfig::default());
        let pose = pose_from_vector(&[1.1, -2.7, 0.3, 0.777, 0.01, -0.02]);
        for cycle in 0..4 {
            let reported = motion.advance(at(cycle), &pose, "map");
            assert!(!reported.jumped && reported.twist.is_zero());
            assert_eq!((reported.pose_noise_m, reported.pose_noise_rad), (0.0, 0.0));
        }
    }

    #[test]
    fn the_twist_leads_from_pose_to_pose() {
        let mut motion = PlatformMotion::new(&FreeSpaceConfig::default());
        let poses = [0.0, 0.05].map(|yaw| pose_from_vector(&[yaw, 0.0, 0.0, yaw, 0.0, 0.0]));
        motion.advance(at(0), &poses[0], "map");
        let reported = motion.advance(at(1), &poses[1], "map");
        assert!((reported.twist.angular_rad_per_s.z - 0.5).abs() < 1e-9);
        assert!((reported.twist.linear_m_per_s.x - 0.5).abs() < 1e-9);
        let forward = poses[0] * reported.twist.after(0.1);
        assert!((forward.translation.vector - poses[1].translation.vector).norm() < 1e-9);
        assert_eq!(reported.pose_noise_m, 0.01);
    }

    /// Regression: a scanner on a joint was taken to move with the rig alone, so that its scans were not deskewed.
    #[test]
    fn a_scanner_on_a_joint_moves_as_if_the_rig_turned_with_it() {
        let aside = pose_from_vector(&[0.2, 0.1, 0.3, 0.0, 0.0, 0.0]);
        let pose_at = |cycle: u32| {
            let cycle = f64::from(cycle);
            pose_from_vector(&[0.02 * cycle, 0.0, 0.0, 0.05 * cycle, 0.0, 0.0])
        };
        let joint_at = |cycle: u32| {
            pose_from_vector(&[0.0, 0.0, 0.5, 0.08 * f64::from(cycle), 0.0, 0.0]) * aside
        };
        let mut on_joint = PlatformMotion::new(&FreeSpaceConfig::default());
        for cycle in 0..6 {
            on_joint.mount(&joint_at(cycle));
            let reported = on_joint.advance(at(cycle), &pose_at(cycle), "map");
            if cycle < 2 {
                continue;
            }
            let after = reported.twist.after(-0.1);
            let told = pose_at(cycle) * after * joint_at(cycle);
            let before = pose_at(cycle - 1) * joint_at(cycle - 1);
            // A twist turns about a fixed axis, and its translation is straight.
            let error = before.inverse() * told;
            assert!(error.translation.vector.norm() < 0.005 && error.rotation.angle() < 1e-9);
            assert!(reported.moves && !reported.jumped);
            assert!(reported.twist_change.angular_rad_per_s.norm() < 1e-6, "{reported:?}");
            assert!(reported.twist_change.linear_m_per_s.norm() < 0.05, "{reported:?}");
        }
    }

    /// Regression: of two scans of one image the second had no velocity, and the next image's differed from that by the whole of
    /// it: on a turning platform no scan was deskewed, and the error of each was as large as its motion.
    #[test]
    fn scans_that_share_an_image_have_its_motion() {
        let mut motion = PlatformMotion::new(&FreeSpaceConfig::default());
        let mut reported = Vec::new();
        for image in 0..4 {
            let yaw_rad = 0.1 * f64::from(image);
            let pose = pose_from_vector(&[0.0, 0.0, 0.0, yaw_rad, 0.0, 0.0]);
            let of_image = [(); 3].map(|()| motion.advance(at(image), &pose, "map"));
            assert!(of_image.iter().all(|of_scan| *of_scan == of_image[0]), "{of_image:?}");
            reported.push(of_image[0]);
        }
        for later in &reported[2..] {
            assert!((later.twist.angular_rad_per_s.z - 1.0).abs() < 1e-9, "{later:?}");
            assert!(later.twist_change.angular_rad_per_s.norm() < 1e-9, "{later:?}");
        }
    }

    #[test]
    fn jumps_of_position_heading_frame_and_time_are_reported() {
        let same = pose_from_vector(&[0.0; 6]);
        let aside = pose_from_vector(&[0.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
        let turned = pose_from_vector(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
        for (stamp, pose, frame, is_step) in [
            (at(1), aside, "map", true),
            (at(1), turned, "map", true),
            (at(1), same, "odom", false),
            (Stamp::from_nanos(-1), same, "map", false),
            (at(10_000), same, "map", false),
        ] {
            let mut motion = PlatformMotion::new(&FreeSpaceConfig::default());
            assert!(!motion.advance(at(0), &same, "map").jumped);
            let reported = motion.advance(stamp, &pose, frame);
            assert_eq!((reported.jumped, reported.jump.is_some()), (true, is_step));
        }
    }

    /// Regression: the last ten poses were used, a quarter of a second of a scanner of 40 Hz.
    #[test]
    fn motion_is_recognised_at_any_rate_of_the_poses() {
        for rate_hz in [7.0, 40.0] {
            let mut motion = PlatformMotion::new(&FreeSpaceConfig::default());
            let moves: Vec<bool> = (0..(6.0 * rate_hz) as u32)
                .map(|cycle| {
                    let time_s = f64::from(cycle) / rate_hz;
                    let x_m = 0.15 * time_s.min(3.0);
                    let stamp = Stamp::default().plus_seconds(time_s);
                    let pose = pose_from_vector(&[x_m, 0.0, 0.0, 0.0, 0.0, 0.0]);
                    motion.advance(stamp, &pose, "map").moves
                })
                .collect();
            let at = |time_s: f64| moves[(time_s * rate_hz) as usize];
            assert!(!at(0.1) && at(1.0) && at(3.5) && !at(5.5), "{rate_hz} Hz: {moves:?}");
        }
    }
}
