//! The platform with its sensors.

use serde::{Deserialize, Serialize};

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
}

impl Default for PoseSource {
    /// The ground truth at the rate of a Kinect's colour camera, as from visual odometry.
    fn default() -> Self {
        Self {
            map_frame_id: "map".to_owned(),
            rate_hz: 30.0,
            position_noise_m: 0.0,
            rotation_noise_rad: 0.0,
        }
    }
}
