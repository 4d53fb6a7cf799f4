//! The content of readings of an inertial unit.

use msgs::convert::{ConvertError, angular_velocity_from_message};
use msgs::geometry_msgs::Vector3;
use msgs::sensor_msgs::Imu;

use super::{Check, Finding, Subject, Typical};

/// At rest it reads 9.78 to 9.83 m/s2; the median of a drive is near that, within what drivers and biases add.
const GRAVITY_M_PER_S2: std::ops::RangeInclusive<f64> = 7.0..=13.0;
/// The same in g.
const GRAVITY_G: std::ops::RangeInclusive<f64> = 0.7..=1.3;
/// No platform turns so fast for half of the time: nearly two turns a second.
const FASTEST_TURN_RAD_PER_S: f64 = 12.0;
/// With fewer readings the unit is not judged.
const LEAST_READINGS: usize = 10;

/// What is known of inertial readings.
#[derive(Clone, PartialEq, Debug, Default)]
pub(in crate::doctor) struct ImuFacts {
    acceleration: Typical,
    turn_rate: Typical,
    /// The first of the covariances: -1 says that there is no such reading.
    lacks_acceleration: bool,
    lacks_turn_rate: bool,
}

impl ImuFacts {
    pub(super) fn take(&mut self, imu: &Imu) {
        self.acceleration.add(length(&imu.linear_acceleration));
        self.turn_rate.add(length(&imu.angular_velocity));
        self.lacks_acceleration |= imu.linear_acceleration_covariance.first() == Some(&-1.0);
        self.lacks_turn_rate |=
            angular_velocity_from_message(imu) == Err(ConvertError::NoAngularVelocity);
    }

    pub(super) fn findings(&self, subject: &Subject<'_>) -> Vec<Finding> {
        let topic = subject.topic;
        let mut findings = Vec::new();
        if self.acceleration.count() < LEAST_READINGS {
            return findings;
        }
        let acceleration = self.acceleration.median().filter(|_| !self.lacks_acceleration);
        if let Some(median) = acceleration.filter(|median| !GRAVITY_M_PER_S2.contains(median)) {
            let fix = if GRAVITY_G.contains(&median) {
                "Imu has m/s2 (REP-103, REP-145): multiply by 9.80665 in the driver"
            } else {
                "Imu has m/s2 with gravity in it (REP-145): see which unit the driver publishes, and whether it takes \
                 gravity off"
            };
            findings.push(subject.grave(
                Check::Units,
                format!(
                    "{topic}: the median of linear_acceleration is {median:.3} m/s2, and gravity alone is 9.8"
                ),
                fix,
            ));
        }
        let turn_rate = self.turn_rate.median().filter(|_| !self.lacks_turn_rate);
        if let Some(median) = turn_rate.filter(|median| *median > FASTEST_TURN_RAD_PER_S) {
            findings.push(subject.grave(
                Check::Units,
                format!(
                    "{topic}: the median of angular_velocity is {median:.1} rad/s, which is {:.2} if they are degrees",
                    median.to_radians()
                ),
                "Imu has rad/s (REP-103): convert in the driver",
            ));
        }
        findings
    }
}

fn length(vector: &Vector3) -> f64 {
    nalgebra::Vector3::new(vector.x, vector.y, vector.z).norm()
}
