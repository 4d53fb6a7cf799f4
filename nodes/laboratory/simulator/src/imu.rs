//! An IMU: angular velocity and specific force, with noise and bias random walks.

use geometry::{Stamp, pose_from_vector};
use nalgebra::{Isometry3, Vector3};
use serde::{Deserialize, Serialize};

use crate::Path;
use crate::noise::{FrameNoise, Stream};

/// The model of an IMU.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Imu {
    /// The pose of its frame in the rig: `[x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad]`.
    pub rig_from_imu: [f64; 6],
    /// The frame that readings are stamped with.
    pub frame_id: String,
    /// Readings a second; the first at the start.
    pub rate_hz: f64,
    /// Noise density of the angular velocity, in rad/s/sqrt(Hz).
    pub gyro_noise: f64,
    /// Noise density of the acceleration, in m/s^2/sqrt(Hz).
    pub accelerometer_noise: f64,
    /// Random walk of the gyroscope's bias, in rad/s^2/sqrt(Hz).
    pub gyro_bias_walk: f64,
    /// Random walk of the accelerometer's bias, in m/s^3/sqrt(Hz).
    pub accelerometer_bias_walk: f64,
    /// Standard deviation of the gyroscope's bias at the start, in rad/s.
    pub gyro_bias: f64,
    /// Standard deviation of the accelerometer's bias at the start, in m/s^2.
    pub accelerometer_bias: f64,
    /// The window of the low-pass filter: a reading is the mean over this time around its stamp.
    pub response_s: f64,
}

/// Standard gravity, in m/s^2.
pub(crate) const GRAVITY_M_PER_S2: f64 = 9.806_65;

impl Default for Imu {
    /// An ADIS16448 at 200 Hz in the rig's origin, with the noise that is stated for the one of the EuRoC data set
    /// (Burri et al. 2016), and turn-on biases of that size.
    fn default() -> Self {
        Self {
            rig_from_imu: [0.0; 6],
            frame_id: "imu".to_owned(),
            rate_hz: 200.0,
            gyro_noise: 1.7e-4,
            accelerometer_noise: 2.0e-3,
            gyro_bias_walk: 1.9e-5,
            accelerometer_bias_walk: 3.0e-3,
            gyro_bias: 2e-3,
            accelerometer_bias: 0.03,
            response_s: 0.02,
        }
    }
}

/// A reading of an IMU.
#[derive(Clone, PartialEq, Debug)]
pub struct ImuReading {
    /// The time of the measurement.
    pub stamp: Stamp,
    /// The frame of the IMU.
    pub frame_id: String,
    /// In the IMU's frame.
    pub angular_velocity_rad_per_s: Vector3<f64>,
    /// The variance of the white noise on each axis of it, in rad^2/s^2.
    pub angular_velocity_variance: f64,
    /// The specific force in the IMU's frame: acceleration minus gravity, so that an IMU at rest reads +g upwards.
    pub linear_acceleration_m_per_s2: Vector3<f64>,
    /// The variance of the white noise on each axis of it, in m^2/s^4.
    pub linear_acceleration_variance: f64,
}

impl Imu {
    /// The reading of an ideal IMU at a time: angular velocity and specific force.
    pub(crate) fn truth(&self, path: &Path, time_s: f64) -> (Vector3<f64>, Vector3<f64>) {
        let rig_from_imu = pose_from_vector(&self.rig_from_imu);
        let room_from_imu = |time_s: f64| -> Isometry3<f64> { path.pose_at(time_s) * rig_from_imu };
        let window_s = self.response_s;
        let (before, now, after) = (
            room_from_imu(time_s - window_s),
            room_from_imu(time_s),
            room_from_imu(time_s + window_s),
        );
        // The second difference is the exact acceleration of the path smoothed twice over the window.
        let acceleration = (after.translation.vector - 2.0 * now.translation.vector
            + before.translation.vector)
            / (window_s * window_s);
        let upwards = Vector3::z() * GRAVITY_M_PER_S2;
        let specific_force = now.rotation.inverse() * (acceleration + upwards);
        let turn = room_from_imu(time_s - window_s / 2.0).rotation.inverse()
            * room_from_imu(time_s + window_s / 2.0).rotation;
        (turn.scaled_axis() / window_s, specific_force)
    }
}

/// Generates the readings in order, since the biases are random walks.
#[derive(Clone, Debug)]
pub(crate) struct ImuReader {
    config: Imu,
    seed: u64,
    next: u64,
    gyro_bias: Vector3<f64>,
    accelerometer_bias: Vector3<f64>,
}

impl ImuReader {
    pub(crate) fn new(config: &Imu, seed: u64) -> Self {
        let first = normals(seed, Stream::ImuBias, 0);
        Self {
            config: config.clone(),
            seed,
            next: 0,
            gyro_bias: first.0 * config.gyro_bias,
            accelerometer_bias: first.1 * config.accelerometer_bias,
        }
    }

    /// When the next reading is due, in seconds since the start.
    pub(crate) fn next_s(&self) -> f64 {
        self.next as f64 / self.config.rate_hz
    }

    pub(crate) fn read(&mut self, path: &Path, start: Stamp) -> ImuReading {
        let config = &self.config;
        let time_s = self.next_s();
        let (angular_velocity, specific_force) = config.truth(path, time_s);
        // A noise density covers half the sampling rate on both sides of 0.
        let root_rate = config.rate_hz.sqrt();
        let gyro_std_dev = config.gyro_noise * root_rate;
        let accelerometer_std_dev = config.accelerometer_noise * root_rate;
        let (gyro, accelerometer) = normals(self.seed, Stream::ImuReading, self.next);
        let reading = ImuReading {
            stamp: start.plus_seconds(time_s),
            frame_id: config.frame_id.clone(),
            angular_velocity_rad_per_s: angular_velocity + self.gyro_bias + gyro * gyro_std_dev,
            angular_velocity_variance: gyro_std_dev * gyro_std_dev,
            linear_acceleration_m_per_s2: specific_force
                + self.accelerometer_bias
                + accelerometer * accelerometer_std_dev,
            linear_acceleration_variance: accelerometer_std_dev * accelerometer_std_dev,
        };
        self.next += 1;
        let (gyro, accelerometer) = normals(self.seed, Stream::ImuBias, self.next);
        self.gyro_bias += gyro * (config.gyro_bias_walk / root_rate);
        self.accelerometer_bias += accelerometer * (config.accelerometer_bias_walk / root_rate);
        reading
    }
}

/// Three normal numbers for the gyroscope and three for the accelerometer.
fn normals(seed: u64, stream: Stream, frame: u64) -> (Vector3<f64>, Vector3<f64>) {
    let noise = FrameNoise::new(seed, stream, frame);
    let axes =
        |first: usize| Vector3::from_fn(|axis, _| f64::from(noise.draw(first + axis).normal()));
    (axes(0), axes(3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Handheld, Waypoint};

    fn quiet() -> Imu {
        Imu {
            gyro_noise: 0.0,
            accelerometer_noise: 0.0,
            gyro_bias_walk: 0.0,
            accelerometer_bias_walk: 0.0,
            gyro_bias: 0.0,
            accelerometer_bias: 0.0,
            ..Imu::default()
        }
    }

    fn readings(config: &Imu, path: &Path, seed: u64, count: usize) -> Vec<ImuReading> {
        let mut reader = ImuReader::new(config, seed);
        (0..count).map(|_| reader.read(path, Stamp::default())).collect()
    }

    #[test]
    fn a_unit_at_rest_reads_gravity_upwards_however_it_is_turned() {
        let path = Path::still([1.0, 2.0, 1.0, 0.7, 0.3, -0.4]);
        let reading = readings(&quiet(), &path, 1, 1).remove(0);
        assert!(reading.angular_velocity_rad_per_s.norm() < 1e-12);
        let upwards = path.pose_at(0.0) * reading.linear_acceleration_m_per_s2;
        assert!((upwards - Vector3::z() * GRAVITY_M_PER_S2).norm() < 1e-9);
    }

    /// Strapdown integration of the readings follows the path.
    #[test]
    fn readings_integrate_to_the_path() {
        let near = vec![
            [0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
            [0.6, 0.2, 1.2, 0.5, 0.2, 0.1],
            [1.0, 0.9, 1.1, 1.5, -0.1, 0.2],
            [0.3, 1.2, 1.0, 2.5, 0.1, -0.2],
            [0.0, 1.0, 1.0, 3.0, 0.0, 0.0],
        ];
        let path = Handheld { start_s: 0.2, step_s: 1.0, near, tremor: 1.0, seed: 2 }.path();
        for rig_from_imu in [[0.0; 6], [0.1, -0.05, 0.08, 0.4, -0.3, 0.2]] {
            let config = Imu { rig_from_imu, rate_hz: 1000.0, ..quiet() };
            let step_s = 1.0 / config.rate_hz;
            let mut pose = path.pose_at(0.0) * pose_from_vector(&rig_from_imu);
            let mut velocity = Vector3::zeros();
            for reading in readings(&config, &path, 1, 5_000) {
                let half_turn = nalgebra::UnitQuaternion::from_scaled_axis(
                    reading.angular_velocity_rad_per_s * (step_s / 2.0),
                );
                let acceleration = pose.rotation * reading.linear_acceleration_m_per_s2
                    - Vector3::z() * GRAVITY_M_PER_S2;
                velocity += acceleration * step_s;
                pose.translation.vector += velocity * step_s;
                pose.rotation *= half_turn * half_turn;
            }
            let truth = path.pose_at(5.0) * pose_from_vector(&rig_from_imu);
            let off_m = (pose.translation.vector - truth.translation.vector).norm();
            let off_rad = pose.rotation.angle_to(&truth.rotation);
            assert!(off_m < 0.02 && off_rad < 2e-3, "{off_m} m, {off_rad} rad");
        }
    }

    #[test]
    fn noise_and_bias_are_as_stated() {
        let config = Imu { gyro_bias: 0.01, gyro_bias_walk: 0.0, ..Imu::default() };
        let still = Path::still([0.0; 6]);
        let readings = readings(&config, &still, 7, 20_000);
        let values: Vec<f64> = readings.iter().map(|r| r.angular_velocity_rad_per_s.y).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
        assert!((variance / readings[0].angular_velocity_variance - 1.0).abs() < 0.05);
        assert!((variance.sqrt() / (1.7e-4 * 200.0_f64.sqrt()) - 1.0).abs() < 0.03);
        assert!(mean.abs() > 1e-4 && mean.abs() < 0.035, "bias {mean}");
    }

    /// Over many seeds, the bias after 100 s deviates from that at the start by the walk times 10.
    #[test]
    fn biases_wander_as_far_as_stated() {
        let config = Imu { accelerometer_bias_walk: 0.003, ..quiet() };
        let still = Path { waypoints: vec![Waypoint { time_s: 0.0, pose: [0.0; 6] }] };
        let mut sum = 0.0;
        for seed in 0..30 {
            let last = readings(&config, &still, seed, 20_001).pop().unwrap();
            sum += (last.linear_acceleration_m_per_s2 - Vector3::z() * GRAVITY_M_PER_S2)
                .norm_squared();
        }
        let std_dev = (sum / 90.0).sqrt();
        assert!((std_dev / 0.03 - 1.0).abs() < 0.2, "{std_dev}");
    }
}
