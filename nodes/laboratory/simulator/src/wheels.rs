//! Wheel odometry: the path along the floor, with errors that grow with the distance.

use geometry::Stamp;
use nalgebra::{Isometry3, Matrix3, Matrix5, SMatrix, UnitQuaternion, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::Path;
use crate::noise::{FrameNoise, Stream};

/// The model of the wheel odometry. The wheels are omnidirectional: the platform does not move like a car.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Wheels {
    /// Readings per second; the first at the start.
    pub rate_hz: f64,
    /// The frame of the poses: that of the platform at the start.
    pub odom_frame_id: String,
    /// The frame of the platform: on the floor below the rig.
    pub base_frame_id: String,
    /// Standard deviation of the scale error of distances, from the error of the wheel radius.
    pub scale_error: f64,
    /// Standard deviation of the scale error of rotations, from the error of the track width.
    pub turn_scale_error: f64,
    /// Standard deviation of the position after a metre, along and across, in metres; it grows with the square root of the
    /// distance.
    pub noise_m_per_root_m: f64,
    /// Standard deviation of the heading after a metre.
    pub turn_noise_rad_per_root_m: f64,
    /// Standard deviation of the heading after a turn of a radian.
    pub turn_noise_rad_per_root_rad: f64,
}

impl Default for Wheels {
    /// A calibrated indoor platform: 1 % of the distance and 2 % of rotations (Borenstein and Feng 1996 measure
    /// systematic errors of that size before their calibration), and slip of a centimetre and half a degree a metre.
    fn default() -> Self {
        Self {
            rate_hz: 50.0,
            odom_frame_id: "odom".to_owned(),
            base_frame_id: "base_link".to_owned(),
            scale_error: 0.01,
            turn_scale_error: 0.02,
            noise_m_per_root_m: 0.01,
            turn_noise_rad_per_root_m: 0.009,
            turn_noise_rad_per_root_rad: 0.01,
        }
    }
}

/// A reading of the wheel odometry.
#[derive(Clone, PartialEq, Debug)]
pub struct WheelReading {
    /// The time of the measurement.
    pub stamp: Stamp,
    /// The frame of the pose.
    pub frame_id: String,
    /// The platform's frame.
    pub child_frame_id: String,
    /// The pose on the floor: x, y and yaw only.
    pub odom_from_base: Isometry3<f64>,
    /// The covariance of x, y and yaw in the frame of the pose, in m and rad.
    pub pose_covariance: Matrix3<f64>,
    /// The velocity along x and y of the platform, in m/s, and about z, in rad/s.
    pub velocity: Vector3<f64>,
    /// The covariance of the velocity.
    pub velocity_covariance: Matrix3<f64>,
}

/// x, y and yaw.
type Planar = Vector3<f64>;

/// Generates the readings in order, since errors accumulate.
#[derive(Clone, Debug)]
pub(crate) struct WheelReader {
    config: Wheels,
    seed: u64,
    next: u64,
    /// The pose estimated from the wheels.
    pose: Planar,
    /// The covariance of x, y, yaw, and the two unknown scales, which are constant.
    covariance: Matrix5<f64>,
    scale: f64,
    turn_scale: f64,
}

impl WheelReader {
    pub(crate) fn new(config: &Wheels, seed: u64) -> Self {
        let noise = FrameNoise::new(seed, Stream::WheelScale, 0);
        let drawn = |index: usize, std_dev: f64| std_dev * f64::from(noise.draw(index).normal());
        let variances =
            [0.0, 0.0, 0.0, config.scale_error.powi(2), config.turn_scale_error.powi(2)];
        Self {
            config: config.clone(),
            seed,
            next: 0,
            pose: Planar::zeros(),
            covariance: Matrix5::from_diagonal(&variances.into()),
            scale: drawn(0, config.scale_error),
            turn_scale: drawn(1, config.turn_scale_error),
        }
    }

    /// The time of the next reading, in seconds since the start.
    pub(crate) fn next_s(&self) -> f64 {
        self.next as f64 / self.config.rate_hz
    }

    pub(crate) fn read(&mut self, path: &Path, start: Stamp) -> WheelReading {
        let period_s = 1.0 / self.config.rate_hz;
        let time_s = self.next_s();
        let truth = if self.next == 0 {
            Planar::zeros()
        } else {
            between(&on_floor(path, time_s - period_s), &on_floor(path, time_s))
        };
        let (step, step_covariance) = self.measured(&truth);
        self.advance(&step, &step_covariance);
        self.next += 1;
        WheelReading {
            stamp: start.plus_seconds(time_s),
            frame_id: self.config.odom_frame_id.clone(),
            child_frame_id: self.config.base_frame_id.clone(),
            odom_from_base: Isometry3::from_parts(
                Vector3::new(self.pose.x, self.pose.y, 0.0).into(),
                UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.pose.z),
            ),
            pose_covariance: self.covariance.fixed_view::<3, 3>(0, 0).into_owned(),
            velocity: step / period_s,
            velocity_covariance: (step_covariance + self.scale_covariance(&step))
                / (period_s * period_s),
        }
    }

    /// The measurement of a step, and the covariance of its noise.
    fn measured(&self, truth: &Planar) -> (Planar, Matrix3<f64>) {
        let config = &self.config;
        let (way_m, turn_rad) = (truth.xy().norm(), truth.z.abs());
        let way_variance = config.noise_m_per_root_m.powi(2) * way_m;
        let turn_variance = config.turn_noise_rad_per_root_m.powi(2) * way_m
            + config.turn_noise_rad_per_root_rad.powi(2) * turn_rad;
        let variances = Vector3::new(way_variance, way_variance, turn_variance);
        let noise = FrameNoise::new(self.seed, Stream::WheelStep, self.next);
        let scales = Vector3::new(self.scale, self.scale, self.turn_scale).add_scalar(1.0);
        let step = Planar::from_fn(|axis, _| {
            truth[axis] * scales[axis]
                + variances[axis].sqrt() * f64::from(noise.draw(axis).normal())
        });
        (step, Matrix3::from_diagonal(&variances))
    }

    /// The part of the unknown scales in the covariance of a step.
    fn scale_covariance(&self, step: &Planar) -> Matrix3<f64> {
        let by_scale = step_by_scale(step);
        by_scale * self.covariance.fixed_view::<2, 2>(3, 3) * by_scale.transpose()
    }

    /// Adds a step; the covariance is propagated to first order.
    fn advance(&mut self, step: &Planar, step_covariance: &Matrix3<f64>) {
        let (sin, cos) = self.pose.z.sin_cos();
        let odom_from_base = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        let moved = odom_from_base * step;
        let mut by_state = Matrix5::identity();
        // The step rotates about its start with the error of the heading there.
        by_state[(0, 2)] = -moved.y;
        by_state[(1, 2)] = moved.x;
        by_state.fixed_view_mut::<3, 2>(0, 3).copy_from(&(odom_from_base * step_by_scale(step)));
        self.covariance = by_state * self.covariance * by_state.transpose();
        let added = odom_from_base * step_covariance * odom_from_base.transpose();
        let mut of_pose = self.covariance.fixed_view_mut::<3, 3>(0, 0);
        of_pose += added;
        self.pose += moved;
    }
}

/// The derivative of a step by the two scales.
fn step_by_scale(step: &Planar) -> SMatrix<f64, 3, 2> {
    SMatrix::<f64, 3, 2>::new(step.x, 0.0, step.y, 0.0, 0.0, step.z)
}

/// The position of the platform on the floor of the room, and the heading of its x axis.
fn on_floor(path: &Path, time_s: f64) -> Planar {
    let pose = path.pose_at(time_s);
    let ahead = pose.rotation * Vector3::x();
    Planar::new(pose.translation.x, pose.translation.y, ahead.y.atan2(ahead.x))
}

/// The second pose in the frame of the first.
fn between(from: &Planar, to: &Planar) -> Planar {
    let (sin, cos) = from.z.sin_cos();
    let way = Vector2::new(to.x - from.x, to.y - from.y);
    let turn_rad = to.z - from.z;
    Planar::new(
        cos * way.x + sin * way.y,
        cos * way.y - sin * way.x,
        turn_rad.sin().atan2(turn_rad.cos()),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Spline;

    fn curve() -> Path {
        Spline::new(0.3, &[[1.0, 0.0], [3.0, 1.0], [4.0, 4.0], [1.0, 5.0], [0.0, 2.0]], 0.7).path()
    }

    /// The last reading, and the true pose then in the frame of the start.
    fn last(config: &Wheels, path: &Path, seed: u64) -> (WheelReading, Planar) {
        let mut reader = WheelReader::new(config, seed);
        let steps = (path.end_s() * config.rate_hz) as usize;
        let mut reading = reader.read(path, Stamp::default());
        for _ in 0..steps {
            reading = reader.read(path, Stamp::default());
        }
        let truth = between(&on_floor(path, 0.0), &on_floor(path, steps as f64 / config.rate_hz));
        (reading, truth)
    }

    fn planar(reading: &WheelReading) -> Planar {
        let pose = &reading.odom_from_base;
        let (_, _, yaw_rad) = pose.rotation.euler_angles();
        Planar::new(pose.translation.x, pose.translation.y, yaw_rad)
    }

    fn error(reading: &WheelReading, truth: &Planar) -> Planar {
        let mut error = planar(reading) - truth;
        error.z = error.z.sin().atan2(error.z.cos());
        error
    }

    #[test]
    fn wheels_without_errors_tell_the_way() {
        let exact = Wheels {
            scale_error: 0.0,
            turn_scale_error: 0.0,
            noise_m_per_root_m: 0.0,
            turn_noise_rad_per_root_m: 0.0,
            turn_noise_rad_per_root_rad: 0.0,
            ..Wheels::default()
        };
        let (reading, truth) = last(&exact, &curve(), 1);
        assert!(error(&reading, &truth).norm() < 1e-9);
        assert!((reading.velocity.xy().norm() - 0.7).abs() < 0.02);
        assert!(reading.pose_covariance.norm() == 0.0);
    }

    /// Over many seeds the error, normalised by the reported covariance, is that of three normal numbers.
    #[test]
    fn the_covariance_is_honest() {
        const SEEDS: u64 = 400;
        let weighed: Vec<f64> = (0..SEEDS)
            .map(|seed| {
                let (reading, truth) = last(&Wheels::default(), &curve(), seed);
                let error = error(&reading, &truth);
                let inverse = reading.pose_covariance.try_inverse().unwrap();
                (error.transpose() * inverse * error).x
            })
            .collect();
        let mean = weighed.iter().sum::<f64>() / SEEDS as f64;
        // Of chi squared with 3 degrees of freedom the mean of 400 deviates by 0.12.
        assert!((mean - 3.0).abs() < 0.45, "{mean}");
        let beyond = weighed.iter().filter(|&&value| value > 7.815).count();
        assert!((8..=36).contains(&beyond), "{beyond} of 400 beyond the 95 % bound");
    }

    #[test]
    fn errors_grow_with_the_way_and_not_with_time() {
        let deviation_m2 =
            |path: &Path| last(&Wheels::default(), path, 3).0.pose_covariance.trace();
        let near = Path::straight(0.0, [0.0, 0.0], [1.0, 0.0], 0.5);
        let far = Path::straight(0.0, [0.0, 0.0], [4.0, 0.0], 0.5);
        let resting = near.pausing(1.0, 6.0);
        assert!(deviation_m2(&far) > 2.0 * deviation_m2(&near));
        assert!((deviation_m2(&resting) / deviation_m2(&near) - 1.0).abs() < 0.05);
    }
}
