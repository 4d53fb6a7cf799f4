//! The parameters of the node.

use geometry::{ParameterError, parameter, pose_from_vector};
use nalgebra::Isometry3;
use node_shell::NodeFailure;
use node_shell::parameters::{NodeParameters, Range};
use serde::{Deserialize, Serialize};

use super::ranges::RANGES;
use crate::tracking::{TrackerConfig, TrackerConfigError};

/// What the colour images come as.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ImageInput {
    /// As the camera's driver sends them.
    #[default]
    Raw,
    /// As JPEG or PNG pictures, by `compressed_image_transport`.
    Compressed,
}

/// Whose view the depth images are.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DepthSource {
    /// That of the colour camera, pixel by pixel, distortion included: the driver has registered them.
    #[default]
    Registered,
    /// That of the depth camera beside it; they are registered here.
    Raw,
}

/// The parameters of the node.
///
/// Every default stands in [`PoseParameters::default`], or in the default of its part, and nowhere else.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct PoseParameters {
    /// What the colour images come as.
    pub input: ImageInput,
    /// Whose view the depth images are.
    pub depth: DepthSource,
    /// Where the depth camera is from the colour camera, with raw depth: x, y, z in metres, yaw, pitch, roll in radians, both
    /// in optical frames.
    pub color_from_depth: [f64; 6],
    /// The colour camera in the rig, likewise: its optical frame.
    pub rig_from_camera: [f64; 6],
    /// Where the rig is at the first image, in the frame below, likewise.
    pub initial_pose: [f64; 6],
    /// The frame that poses lead to.
    pub odom_frame_id: String,
    /// The rig's frame.
    pub base_frame_id: String,
    /// Whether the pose is told on `/tf`, too.
    pub publish_tf: bool,
    /// An image and a depth image belong together when they were taken no farther apart.
    pub max_pair_gap_s: f64,
    /// Images that may wait for their partner.
    pub max_waiting_images: usize,
    /// The pose is the mean of so many; 1 for the pose itself (PL-SLAM's thesis takes 4).
    pub smoothing_poses: usize,
    /// The path holds so many poses, the latest.
    pub path_poses: usize,
    /// Whether features on tracked objects are left out.
    pub leave_out_tracks: bool,
    /// Around a tracked object so much is left out, too.
    pub track_margin_m: f64,
    /// A track is used for so long.
    pub max_track_age_s: f64,
    /// Whether a gyroscope says how the camera turns.
    pub use_imu: bool,
    /// The axes of the inertial unit in the rig: yaw, pitch, roll; as above, and the place plays no part.
    pub rig_from_imu: [f64; 6],
    /// Whether wheels say how the rig moves.
    pub use_wheels: bool,
    /// Whether a map is kept and loops are closed: `pose` and `path` are in `map_frame_id` then, and `/tf` ties it to
    /// `odom_frame_id`.
    pub slam: bool,
    /// Whether the map is worked on in a thread of its own; otherwise between two images, and the same images give the same
    /// poses.
    pub slam_in_background: bool,
    /// The frame of the map.
    pub map_frame_id: String,
    /// With `slam`: where `~/save_map` saves the map of keyframes, and `~/load_map` loads it from: a path, or nothing.
    pub map_file: String,
    /// Whether the map of `map_file` is loaded at the start; the camera must then be found in it before the map grows.
    pub load_map_on_start: bool,
    /// Where the map is saved when the node ends: a path, or nothing.
    pub save_map_on_exit: String,
    /// Whether the camera is only placed in the map of `map_file`, which is loaded at the start and stays as it is.
    pub localisation_only: bool,
    /// The parameters of the method.
    #[serde(flatten)]
    pub tracker: TrackerConfig,
}

impl Default for PoseParameters {
    fn default() -> Self {
        Self {
            input: ImageInput::default(),
            depth: DepthSource::default(),
            color_from_depth: [0.0; 6],
            // As detection has it: the optical frame looks along the rig's x.
            rig_from_camera: [
                0.0,
                0.0,
                0.0,
                -std::f64::consts::FRAC_PI_2,
                0.0,
                -std::f64::consts::FRAC_PI_2,
            ],
            initial_pose: [0.0; 6],
            // REP 105.
            odom_frame_id: "odom".to_owned(),
            base_frame_id: "base_link".to_owned(),
            publish_tf: true,
            // Two thirds of the time between two images of a Kinect.
            max_pair_gap_s: 0.02,
            // Ten raw images of a Kinect take 9 MB.
            max_waiting_images: 10,
            smoothing_poses: 1,
            // Five minutes and a half.
            path_poses: 10_000,
            leave_out_tracks: true,
            // Half a voxel's diagonal, and the pixels beside an edge.
            track_margin_m: 0.1,
            // Three cycles of the RPLIDAR A1.
            max_track_age_s: 0.5,
            use_imu: false,
            rig_from_imu: [0.0; 6],
            use_wheels: false,
            slam: false,
            slam_in_background: true,
            // REP 105.
            map_frame_id: "map".to_owned(),
            map_file: String::new(),
            load_map_on_start: false,
            save_map_on_exit: String::new(),
            localisation_only: false,
            tracker: TrackerConfig::default(),
        }
    }
}

/// A parameter has a value that means nothing.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum PoseParametersError {
    /// One of the node's.
    #[error(transparent)]
    Node(#[from] ParameterError),
    /// One of the method's.
    #[error(transparent)]
    Tracker(#[from] TrackerConfigError),
    /// It is about a map, and there is none.
    #[error("parameter {0} needs slam: without it there is no map")]
    WithoutSlam(&'static str),
    /// It is about a saved map, and none is named.
    #[error("parameter {0} needs map_file: the path of a map that ~/save_map has saved")]
    WithoutMapFile(&'static str),
}

impl NodeParameters for PoseParameters {
    const FILE: &'static str = include_str!("../../../../config/pose.yaml");
    const RANGES: &'static [(&'static str, Range)] = RANGES;

    fn validate(&self) -> Result<(), NodeFailure> {
        Ok(Self::validate(self)?)
    }
}

/// More poses in a mean would be another course.
const MOST_SMOOTHING_POSES: f64 = 100.0;

impl PoseParameters {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), PoseParametersError> {
        for (name, vector) in [
            ("color_from_depth", &self.color_from_depth),
            ("rig_from_camera", &self.rig_from_camera),
            ("initial_pose", &self.initial_pose),
            ("rig_from_imu", &self.rig_from_imu),
        ] {
            let bad = vector.iter().copied().find(|value| !value.is_finite());
            parameter::check(name, "six finite numbers", bad.unwrap_or(0.0), bad.is_none())?;
        }
        parameter::positive("max_pair_gap_s", self.max_pair_gap_s)?;
        parameter::positive("max_waiting_images", self.max_waiting_images as f64)?;
        let poses = self.smoothing_poses as f64;
        parameter::between("smoothing_poses", poses, 1.0, MOST_SMOOTHING_POSES)?;
        parameter::positive("path_poses", self.path_poses as f64)?;
        parameter::not_negative("track_margin_m", self.track_margin_m)?;
        parameter::positive("max_track_age_s", self.max_track_age_s)?;
        for (name, is_asked_for, needs_file) in [
            ("localisation_only", self.localisation_only, true),
            ("load_map_on_start", self.load_map_on_start, true),
            ("save_map_on_exit", !self.save_map_on_exit.is_empty(), false),
        ] {
            if is_asked_for && !self.slam {
                return Err(PoseParametersError::WithoutSlam(name));
            }
            if is_asked_for && needs_file && self.map_file.is_empty() {
                return Err(PoseParametersError::WithoutMapFile(name));
            }
        }
        Ok(self.tracker.validate()?)
    }

    /// Whether a saved map is there from the start.
    pub(super) fn begins_with_map(&self) -> bool {
        self.load_map_on_start || self.localisation_only
    }

    pub(super) fn rig_from_camera(&self) -> Isometry3<f64> {
        pose_from_vector(&self.rig_from_camera)
    }
}
