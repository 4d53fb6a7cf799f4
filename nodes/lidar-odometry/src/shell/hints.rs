//! The motion between two scans by wheels and a gyroscope.

use std::cmp::Ordering;
use std::collections::VecDeque;

use geometry::{PoseBuffer, Stamp, pose_from_vector};
use msgs::convert;
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::Imu;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use node_shell::NodeFailure;

use super::parameters::LidarOdometryParameters;
use crate::odometry::MotionHint;

/// Samples that are kept of a gyroscope: a second of a fast one.
const SAMPLES_KEPT: usize = 1_000;
/// Poses that are kept of wheels.
const WHEEL_POSES_KEPT: usize = 200;
/// Between messages farther apart than this the motion is unknown: two revolutions of a scanner.
const LONGEST_GAP_S: f64 = 0.2;

/// The messages so far.
pub(super) struct Hints {
    lidar_from_imu: UnitQuaternion<f64>,
    base_from_lidar: Isometry3<f64>,
    rates: VecDeque<(Stamp, Vector3<f64>)>,
    wheels: PoseBuffer,
}

impl Hints {
    pub(super) fn new(parameters: &LidarOdometryParameters) -> Self {
        let base_from_lidar = parameters.base_from_lidar();
        Self {
            lidar_from_imu: base_from_lidar.rotation.inverse()
                * pose_from_vector(&parameters.base_from_imu).rotation,
            base_from_lidar,
            rates: VecDeque::new(),
            wheels: PoseBuffer::new(WHEEL_POSES_KEPT).with_max_gap_s(LONGEST_GAP_S),
        }
    }

    /// Forgets what has come.
    pub(super) fn forget(&mut self) {
        self.rates.clear();
        self.wheels.clear();
    }

    pub(super) fn take_imu(&mut self, message: &Imu) -> Result<(), NodeFailure> {
        let rate = self.lidar_from_imu * convert::angular_velocity_from_message(message)?;
        let stamp = convert::stamp_from_time(message.header.stamp);
        match self.rates.back().map(|(last, _)| stamp.cmp(last)) {
            // A driver may send a reading twice.
            Some(Ordering::Equal) => return Ok(()),
            Some(Ordering::Less) => self.rates.clear(),
            Some(Ordering::Greater) | None => {}
        }
        self.rates.push_back((stamp, rate));
        while self.rates.len() > SAMPLES_KEPT {
            self.rates.pop_front();
        }
        Ok(())
    }

    pub(super) fn take_wheels(&mut self, message: &Odometry) -> Result<(), NodeFailure> {
        let pose = convert::pose_from_odometry(message)?;
        if self.wheels.newest().is_some_and(|newest| newest.stamp > pose.stamp) {
            self.wheels.clear();
        }
        Ok(self.wheels.push(pose)?)
    }

    /// How the scanner has moved from one moment to another, as far as it is known.
    pub(super) fn between(&self, interval: Option<(Stamp, Stamp)>) -> MotionHint {
        let Some((from, to)) = interval else { return MotionHint::default() };
        MotionHint { motion: self.by_wheels(from, to), turn: self.by_gyroscope(from, to) }
    }

    fn by_wheels(&self, from: Stamp, to: Stamp) -> Option<Isometry3<f64>> {
        let before = self.wheels.at(from).ok()?.map_from_rig;
        let now = self.wheels.at(to).ok()?.map_from_rig;
        Some(self.base_from_lidar.inverse() * before.inv_mul(&now) * self.base_from_lidar)
    }

    /// Each rate holds from the midpoint to the one before until the midpoint to the one after. Where the samples end a little before
    /// the scan does, the last one is extended.
    fn by_gyroscope(&self, from: Stamp, to: Stamp) -> Option<UnitQuaternion<f64>> {
        let (first, last) = (self.rates.front()?.0, self.rates.back()?.0);
        if from.seconds_since(first) < -LONGEST_GAP_S || to.seconds_since(last) > LONGEST_GAP_S {
            return None;
        }
        let midpoint = |a: Stamp, b: Stamp| a.plus_seconds(0.5 * b.seconds_since(a));
        let mut turn = UnitQuaternion::identity();
        for (index, (stamp, rate)) in self.rates.iter().enumerate() {
            let before = index.checked_sub(1).and_then(|index| self.rates.get(index));
            let since = before.map_or(from, |(before, _)| midpoint(*before, *stamp)).max(from);
            let after = self.rates.get(index + 1);
            let until = after.map_or(to, |(after, _)| midpoint(*stamp, *after)).min(to);
            if let Some((after, _)) = after
                && since < until
                && after.seconds_since(*stamp) > LONGEST_GAP_S
            {
                return None;
            }
            let passed_s = until.seconds_since(since);
            if passed_s > 0.0 {
                turn *= UnitQuaternion::from_scaled_axis(passed_s * rate);
            }
        }
        Some(turn)
    }
}

#[cfg(test)]
mod tests {
    use msgs::geometry_msgs::Vector3 as VectorMessage;
    use msgs::std_msgs::Header;

    use super::*;

    fn at(seconds: f64) -> Stamp {
        Stamp::from_nanos(1_000_000_000).plus_seconds(seconds)
    }

    fn imu(seconds: f64, yaw_rate: f64) -> Imu {
        Imu {
            header: Header { stamp: convert::time_from_stamp(at(seconds)), ..Header::default() },
            angular_velocity: VectorMessage { x: 0.0, y: 0.0, z: yaw_rate },
            ..Imu::default()
        }
    }

    #[test]
    fn a_rate_that_grows_evenly_turns_by_its_mean() {
        let mut hints = Hints::new(&LidarOdometryParameters::default());
        for sample in 0..100 {
            let seconds = 0.01 * f64::from(sample);
            hints.take_imu(&imu(seconds, seconds)).unwrap();
        }
        let turn = hints.by_gyroscope(at(0.203), at(0.3)).unwrap().scaled_axis();
        assert!((turn.z - 0.5 * (0.3_f64.powi(2) - 0.203_f64.powi(2))).abs() < 1e-5, "{turn}");
        assert_eq!(hints.by_gyroscope(at(0.9), at(1.3)), None);
        assert_eq!(hints.by_gyroscope(at(-0.5), at(0.3)), None);
        assert!(hints.take_imu(&imu(2.0, f64::NAN)).is_err());
        // A hole of a second.
        hints.take_imu(&imu(2.0, 0.0)).unwrap();
        assert_eq!(hints.by_gyroscope(at(1.4), at(1.5)), None);
        // Time goes back.
        hints.take_imu(&imu(0.0, 1.0)).unwrap();
        assert_eq!(hints.rates.len(), 1);
    }

    /// Regression: the zeros of a unit without a gyroscope were taken for no rotation, and a reading that came twice
    /// dropped all those before.
    #[test]
    fn a_unit_without_a_gyroscope_gives_no_turn_and_a_repeated_reading_changes_none() {
        let mut hints = Hints::new(&LidarOdometryParameters::default());
        let mut blind = imu(0.0, 0.0);
        blind.angular_velocity_covariance[0] = -1.0;
        let refused = hints.take_imu(&blind).unwrap_err().to_string();
        assert!(refused.contains("does not measure its angular velocity"), "{refused}");
        assert_eq!(hints.by_gyroscope(at(0.0), at(0.1)), None);
        for sample in 0..40 {
            hints.take_imu(&imu(0.01 * f64::from(sample / 2), 0.5)).unwrap();
        }
        let turn = hints.by_gyroscope(at(0.0), at(0.1)).unwrap().scaled_axis();
        assert!((turn.z - 0.05).abs() < 1e-9 && hints.rates.len() == 20, "{turn}");
    }

    #[test]
    fn the_axes_are_those_of_the_scanner() {
        let quarter = std::f64::consts::FRAC_PI_2;
        // The scanner looks left; the unit lies on its side.
        let parameters = LidarOdometryParameters {
            base_from_lidar: [0.0, 1.0, 0.0, quarter, 0.0, 0.0],
            base_from_imu: [0.0, 0.0, 0.0, 0.0, 0.0, quarter],
            ..LidarOdometryParameters::default()
        };
        let mut hints = Hints::new(&parameters);
        let mut message = imu(0.0, 0.0);
        // About the unit's y: the base's z, and the scanner's.
        message.angular_velocity.y = 2.0;
        hints.take_imu(&message).unwrap();
        let turn = hints.by_gyroscope(at(0.0), at(0.1)).unwrap().scaled_axis();
        assert!((turn - Vector3::z() * 0.2).norm() < 1e-9, "{turn}");
        for (seconds, x_m) in [(0.0, 0.0), (0.1, 1.0)] {
            let mut message = Odometry::default();
            message.header.stamp = convert::time_from_stamp(at(seconds));
            message.header.frame_id = "odom".to_owned();
            message.pose.pose.position.x = x_m;
            message.pose.pose.orientation.w = 1.0;
            hints.take_wheels(&message).unwrap();
        }
        let motion = hints.by_wheels(at(0.0), at(0.1)).unwrap();
        // Ahead is to the scanner's right.
        assert!((motion.translation.vector + Vector3::y()).norm() < 1e-9, "{motion}");
    }
}
