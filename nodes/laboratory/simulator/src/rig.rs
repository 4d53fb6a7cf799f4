//! The platform with its sensors.

use nalgebra::{Isometry3, Vector3};
use serde::{Deserialize, Serialize};

use crate::noise::{FrameNoise, Stream};
use crate::scenes::RIG_POSE;
use crate::{ColourCamera, DepthCamera, Imu, Lidar, Path, Velodyne, Wheels};

/// The sensors and their path. The rig's origin is the camera's optical centre, x forward.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Rig {
    /// The pose of the rig in the room, over time.
    pub path: Path,
    /// The 2D scanner.
    pub lidar: Lidar,
    /// The depth camera.
    pub depth_camera: DepthCamera,
    /// The colour camera, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub colour_camera: Option<ColourCamera>,
    /// The 3D scanner, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velodyne: Option<Velodyne>,
    /// The IMU, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub imu: Option<Imu>,
    /// The wheel odometry, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wheels: Option<Wheels>,
    /// The source of the pose.
    pub pose_source: PoseSource,
}

impl Default for Rig {
    /// A Kinect v1 over an RPLIDAR A1 at rest in the middle of the room, half a metre before the rear wall: the camera at
    /// 120 cm and the scanner at 115 cm, the third mounting of Rec-HV 3.4.2. The floor is in view from 2.8 m on.
    fn default() -> Self {
        Self {
            path: Path::still(RIG_POSE),
            lidar: Lidar::rplidar_a1(),
            depth_camera: DepthCamera::kinect_v1(),
            colour_camera: None,
            velodyne: None,
            imu: None,
            wheels: None,
            pose_source: PoseSource::default(),
        }
    }
}

/// The source of the published pose: the ground truth with noise.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PoseSource {
    /// The parent frame of the pose: the rig's frame at the start.
    pub map_frame_id: String,
    /// Poses per second; the first at the start.
    pub rate_hz: f64,
    /// Standard deviation of each coordinate.
    pub position_noise_m: f64,
    /// Standard deviation of the rotation about each axis.
    pub rotation_noise_rad: f64,
    /// For so long an error lasts, as that of a localisation does: a Gauss-Markov process of this time constant. At 0 the errors of
    /// all poses are independent.
    pub noise_time_s: f64,
}

impl Default for PoseSource {
    /// The ground truth at the rate of a Kinect's colour camera, as from visual odometry.
    fn default() -> Self {
        Self {
            map_frame_id: "map".to_owned(),
            rate_hz: 30.0,
            position_noise_m: 0.0,
            rotation_noise_rad: 0.0,
            noise_time_s: 0.0,
        }
    }
}

impl PoseSource {
    /// Of an error from so long ago that less than this share of it is left nothing is seen.
    const FORGOTTEN_SHARE: f64 = 1e-3;

    /// The error of a pose: the rig's frame from that of the published pose.
    pub(crate) fn rig_from_published_rig(&self, seed: u64, frame: u64) -> Isometry3<f64> {
        // The share of an error that is left at the next pose.
        let left = match self.noise_time_s {
            0.0 => 0.0,
            noise_time_s => (-1.0 / (self.rate_hz * noise_time_s)).exp(),
        };
        let fresh = (1.0 - left * left).sqrt();
        let mut errors = [0.0; 6];
        let mut share = 1.0;
        for age in 0_u64.. {
            let noise = FrameNoise::new(seed, Stream::Pose, frame.wrapping_sub(age));
            for (index, error) in errors.iter_mut().enumerate() {
                *error += share * fresh * f64::from(noise.draw(index).normal());
            }
            share *= left;
            if share < Self::FORGOTTEN_SHARE {
                break;
            }
        }
        let [x, y, z, about_x, about_y, about_z] = errors;
        Isometry3::new(
            self.position_noise_m * Vector3::new(x, y, z),
            self.rotation_noise_rad * Vector3::new(about_x, about_y, about_z),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The errors of the x coordinate of many poses, half a second apart.
    fn errors_m(noise_time_s: f64) -> Vec<f64> {
        let source = PoseSource {
            rate_hz: 2.0,
            position_noise_m: 0.1,
            noise_time_s,
            ..PoseSource::default()
        };
        (0..20_000).map(|frame| source.rig_from_published_rig(1, frame).translation.x).collect()
    }

    fn correlation(errors_m: &[f64], poses_apart: usize) -> f64 {
        let product =
            |apart: usize| errors_m.iter().zip(&errors_m[apart..]).map(|(a, b)| a * b).sum::<f64>();
        product(poses_apart) / product(0)
    }

    #[test]
    fn an_error_lasts_for_its_time_and_is_as_large_as_one_that_does_not() {
        for noise_time_s in [0.0, 2.0] {
            let errors_m = errors_m(noise_time_s);
            let mean_square = errors_m.iter().map(|m| m * m).sum::<f64>() / errors_m.len() as f64;
            assert!((mean_square.sqrt() - 0.1).abs() < 0.005, "{}", mean_square.sqrt());
            for poses_apart in [1, 4, 8] {
                let age_s = 0.5 * poses_apart as f64;
                let expected = if noise_time_s > 0.0 { (-age_s / noise_time_s).exp() } else { 0.0 };
                let found = correlation(&errors_m, poses_apart);
                assert!((found - expected).abs() < 0.05, "{noise_time_s}: {found} at {age_s} s");
            }
        }
    }
}
