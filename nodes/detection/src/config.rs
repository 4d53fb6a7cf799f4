//! The parameters of detection, their defaults, and where these come from.

mod stillmap;

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use geometry::{ParameterError, PoseBuffer, VoxelEdgeError, VoxelGrid, parameter};
use serde::{Deserialize, Serialize};

pub use stillmap::StillmapConfig;

/// How dynamic zones are found.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The method as Rec-HV publishes it: one zone a cycle, a filled beam counts as measured.
    RecHv,
    /// What ends where free space was seen is moving: several zones a cycle, on a platform that may move,
    /// and a filled beam is no evidence.
    #[default]
    Stillmap,
}

/// Which beam of a run of high variability bounds the zone.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunBound {
    /// The beam of the largest deviation, as published (Rec-HV 3.3.2.2).
    #[default]
    Peak,
    /// The beam at the run's outer end. The leading edge of the object lies anywhere within the
    /// leading run, so that the peak may cut a slice off the object; the outer end never does.
    OuterEnd,
}

/// The parameters of [`crate::Detector`] and [`crate::Matcher`].
///
/// Every default stands in [`DetectionConfig::default`] and nowhere else.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct DetectionConfig {
    /// How dynamic zones are found.
    pub method: Method,
    /// Width of the forward aperture whose beams are looked at, in `(0, 2 pi]`.
    pub aperture_rad: f64,
    /// n, the scans of the moving window, at least 2.
    pub window_scans: usize,
    /// The largest deviation of a scan must exceed this one for anything to be moving.
    pub min_std_dev_m: f64,
    /// A beam is of high variability above this share of the scan's largest deviation, in `[0, 1)`.
    pub high_variability_share: f64,
    /// Which beam of a run of high variability bounds the zone.
    pub run_bound: RunBound,
    /// Added to the zone at each side.
    pub zone_tolerance_rad: f64,
    /// For so many cycles a zone outlives its last measurement; 0 turns holding off. With the method `stillmap`, from
    /// a platform that moves, for no more cycles than it was measured in.
    pub max_held_cycles: u32,
    /// t_vg, the edge of the voxels of the reduction.
    pub voxel_edge_m: f64,
    /// The rig's frame, which the reduced cloud is published in.
    pub rig_frame_id: String,
    /// Pose of the camera's optical frame in the rig: `[x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad]`.
    pub rig_from_camera: [f64; 6],
    /// Pose of the scanner in the rig: `[x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad]`.
    pub rig_from_lidar: [f64; 6],
    /// A cloud belongs to a scan only within this offset of their stamps.
    pub max_cloud_offset_s: f64,
    /// The pose is interpolated only between poses at most this far apart.
    pub max_pose_gap_s: f64,
    /// A scan waits until the newest stamp seen is this much later than its own.
    pub max_wait_s: f64,
    /// So many scans may wait for their cloud and pose.
    pub max_waiting_scans: usize,
    /// So many clouds (or depth images) are kept for scans to come.
    pub max_waiting_clouds: usize,
    /// So many poses are kept.
    pub max_waiting_poses: usize,
    /// What only the method `stillmap` reads.
    #[serde(flatten)]
    pub stillmap: StillmapConfig,
}

impl Default for DetectionConfig {
    fn default() -> Self {
        Self {
            // All improvements; the published method is there to be compared with.
            method: Method::Stillmap,
            // Rec-HV 3.2.1: of the 360 degrees only 90 are analysed.
            aperture_rad: FRAC_PI_2,
            // Rec-HV experiment 2: of 2 .. 7, the value that keeps the object's shape.
            window_scans: 3,
            // Rec-HV conclusions: moving edges exceed 0.6 m, static clutter stays at or below 0.4 m.
            min_std_dev_m: 0.4,
            // Rec-HV 3.3.2.2: half of the largest deviation of the cycle.
            high_variability_share: 0.5,
            run_bound: RunBound::Peak,
            // Rec-HV 3.4.1: 1 degree, 2 to 6 cm at the depths in question.
            zone_tolerance_rad: PI / 180.0,
            // Rec-HV is silent. One second at the RPLIDAR A1's 7 Hz: longer than a walker's pause
            // between two steps; what rests longer is furniture to this method anyway.
            max_held_cycles: 7,
            // Rec-HV experiment 4 and section 5: the edge chosen out of 0.05 .. 0.16 m.
            voxel_edge_m: 0.08,
            rig_frame_id: "rig".to_owned(),
            // The optical frame of REP-103: x right, y down, z forward.
            rig_from_camera: [0.0, 0.0, 0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2],
            // Rec-HV 3.2.4: the LiDAR's origin lies 5 cm below the camera's.
            rig_from_lidar: [0.0, 0.0, -0.05, 0.0, 0.0, 0.0],
            // One and a half periods of a 30 Hz camera: one lost image costs no cycle.
            max_cloud_offset_s: 0.05,
            max_pose_gap_s: PoseBuffer::DEFAULT_MAX_GAP_S,
            // Three periods of the LiDAR: odometry a few frames late still makes it.
            max_wait_s: 0.5,
            // Scanners of up to 100 Hz within `max_wait_s`.
            max_waiting_scans: 64,
            // A 30 Hz camera sends 17 images in `max_wait_s` + `max_cloud_offset_s`.
            max_waiting_clouds: 32,
            // One second of poses at 1 kHz.
            max_waiting_poses: 1024,
            stillmap: StillmapConfig::default(),
        }
    }
}

/// A parameter of detection has a value that means nothing.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum ConfigError {
    /// A number out of its range.
    #[error(transparent)]
    OutOfRange(#[from] ParameterError),
    /// The voxel edge is no length.
    #[error("parameter voxel_edge_m: {0}")]
    VoxelEdge(#[from] VoxelEdgeError),
    /// A mount holds a number that is not finite.
    #[error(
        "parameter {name} must be six finite numbers [x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad], \
         not {value:?}"
    )]
    Mount {
        /// The parameter.
        name: &'static str,
        /// What it is.
        value: [f64; 6],
    },
}

impl DetectionConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let aperture = self.aperture_rad;
        parameter::check(
            "aperture_rad",
            "in (0, 2 pi]",
            aperture,
            aperture > 0.0 && aperture <= TAU,
        )?;
        let window = self.window_scans;
        parameter::check(
            "window_scans",
            "in 2 .. 1000",
            window as f64,
            (2..=1000).contains(&window),
        )?;
        parameter::not_negative("min_std_dev_m", self.min_std_dev_m)?;
        parameter::below_one("high_variability_share", self.high_variability_share)?;
        let tolerance = self.zone_tolerance_rad;
        parameter::check(
            "zone_tolerance_rad",
            "in [0, pi]",
            tolerance,
            (0.0..=PI).contains(&tolerance),
        )?;
        VoxelGrid::new(self.voxel_edge_m)?;
        for (name, value) in
            [("rig_from_camera", self.rig_from_camera), ("rig_from_lidar", self.rig_from_lidar)]
        {
            if !value.iter().all(|number| number.is_finite()) {
                return Err(ConfigError::Mount { name, value });
            }
        }
        parameter::positive("max_cloud_offset_s", self.max_cloud_offset_s)?;
        parameter::positive("max_pose_gap_s", self.max_pose_gap_s)?;
        parameter::positive("max_wait_s", self.max_wait_s)?;
        parameter::at_least("max_waiting_scans", self.max_waiting_scans, 1)?;
        parameter::at_least("max_waiting_clouds", self.max_waiting_clouds, 1)?;
        parameter::at_least("max_waiting_poses", self.max_waiting_poses, 2)?;
        Ok(self.stillmap.validate()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_are_the_published_constants() {
        let config = DetectionConfig::default();
        assert_eq!(config.validate(), Ok(()));
        assert_eq!(
            (config.window_scans, config.min_std_dev_m, config.voxel_edge_m),
            (3, 0.4, 0.08)
        );
        assert!((config.zone_tolerance_rad.to_degrees() - 1.0).abs() < 1e-12);
        assert!((config.aperture_rad.to_degrees() - 90.0).abs() < 1e-12);
    }

    #[test]
    fn each_bad_parameter_is_named() {
        type Spoil = fn(&mut DetectionConfig);
        let cases: [(&str, Spoil); 13] = [
            ("aperture_rad", |c| c.aperture_rad = 7.0),
            ("window_scans", |c| c.window_scans = 1),
            ("min_std_dev_m", |c| c.min_std_dev_m = f64::NAN),
            ("high_variability_share", |c| c.high_variability_share = 1.0),
            ("zone_tolerance_rad", |c| c.zone_tolerance_rad = -0.1),
            ("voxel_edge_m", |c| c.voxel_edge_m = 0.0),
            ("rig_from_camera", |c| c.rig_from_camera[3] = f64::INFINITY),
            ("rig_from_lidar", |c| c.rig_from_lidar[0] = f64::NAN),
            ("max_cloud_offset_s", |c| c.max_cloud_offset_s = 0.0),
            ("max_pose_gap_s", |c| c.max_pose_gap_s = -1.0),
            ("max_wait_s", |c| c.max_wait_s = f64::INFINITY),
            ("max_waiting_scans", |c| c.max_waiting_scans = 0),
            ("max_waiting_poses", |c| c.max_waiting_poses = 1),
        ];
        for (name, spoil) in cases {
            let mut config = DetectionConfig::default();
            spoil(&mut config);
            let message = config.validate().unwrap_err().to_string();
            assert!(message.contains(name), "{message} does not name {name}");
        }
    }
}
