//! The parameters of the node.

use std::f64::consts::FRAC_PI_2;
use std::num::NonZeroUsize;
use std::sync::Arc;

use estimation::{Executor, ScopedThreads};
use geometry::pose_from_vector;
use nalgebra::Isometry3;
use node_shell::NodeFailure;
use node_shell::parameters::NodeParameters;

use crate::tracking::TrackerConfig;

geometry::choices! {
    /// What the colour images come as.
    pub enum ImageInput {
        /// As the camera's driver sends them.
        Raw = "raw",
        /// As JPEG or PNG pictures, by compressed_image_transport.
        Compressed = "compressed",
    }
}

geometry::choices! {
    /// Whose view the depth images are.
    pub enum DepthSource {
        /// That of the colour camera, pixel by pixel, distortion included: the driver has registered them.
        Registered = "registered",
        /// That of the depth camera beside it; they are registered here.
        Raw = "raw",
    }
}

geometry::parameters! {
    /// The parameters of the node.
    #[derive(Clone, PartialEq, Debug)]
    pub struct PoseParameters {
        /// What the colour images come as.
        input: ImageInput = ImageInput::Raw;
        /// Whose view the depth images are.
        depth: DepthSource = DepthSource::Registered;
        /// Pose of the depth camera in the colour camera, both by their optical frames: [x_m, y_m, z_m, yaw_rad, pitch_rad,
        /// roll_rad].
        color_from_depth: [f64; 6] = [0.0; 6], read_with("depth", "raw");
        /// Pose of the colour camera's optical frame in the rig, in the same form.
        // As detection has it: the optical frame looks along the rig's x.
        rig_from_camera: [f64; 6] = [0.0, 0.0, 0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2];
        /// Pose of the rig at the first image, in odom_frame_id, in the same form.
        initial_pose: [f64; 6] = [0.0; 6];
        /// The frame in which poses are published.
        // REP 105.
        odom_frame_id: String = "odom".to_owned();
        /// The rig's frame.
        base_frame_id: String = "base_link".to_owned();
        /// Whether the pose is published on /tf, too.
        publish_tf: bool = true;
        /// A colour and a depth image belong together when their stamps differ by at most this.
        // Two thirds of the time between two images of a Kinect.
        max_pair_gap_s: f64 = 0.02, positive;
        /// The most images that wait for their partner.
        // Ten raw images of a Kinect take 9 MB.
        max_waiting_images: usize = 10, at_least(1.0);
        /// The published pose is the mean of this many; 1 for the pose itself (PL-SLAM's thesis takes 4).
        // More poses in a mean would be another course.
        smoothing_poses: usize = 1, whole(1, 100);
        /// The path has this many poses, the latest.
        // Five minutes and a half.
        path_poses: usize = 10_000, at_least(1.0);
        /// Threads that extract features. Their number changes no result.
        // One for corners, one for line segments; more than the bound would be idle.
        threads: usize = 2, whole(1, 64);
        /// Whether features on tracked objects are left out.
        leave_out_tracks: bool = true;
        /// Features up to this distance around a tracked object are left out, too.
        // Half a voxel's diagonal, and the pixels beside an edge.
        track_margin_m: f64 = 0.1, not_negative;
        /// A track is used for this long.
        // Three cycles of the RPLIDAR A1.
        max_track_age_s: f64 = 0.5, positive;
        /// Whether a gyroscope predicts the camera's rotation.
        use_imu: bool = false;
        /// Pose of the inertial unit in the rig, in the form of rig_from_camera. Its position is not used.
        rig_from_imu: [f64; 6] = [0.0; 6], read_with("use_imu", "true");
        /// Whether wheel odometry predicts the rig's motion.
        use_wheels: bool = false;
        /// Whether a map of keyframes is kept and loops are closed: pose and path are in map_frame_id then, and /tf has the
        /// transform to odom_frame_id.
        slam: bool = false;
        /// Whether the map is worked on in a thread of its own; otherwise between two images, and the same images give the same
        /// poses.
        slam_in_background: bool = true, read_with("slam", "true");
        /// The frame of the map.
        // REP 105.
        map_frame_id: String = "map".to_owned();
        /// The file of the map of keyframes for the services ~/save_map and ~/load_map: a path, or "" for none.
        map_file: String = String::new(), read_with("slam", "true");
        /// Whether the map of map_file is loaded at the start; it grows when the camera has been located in it.
        load_map_on_start: bool = false;
        /// The file that the map is saved to when the node ends: a path, or "" for none.
        save_map_on_exit: String = String::new();
        /// Whether the camera is only located in the map of map_file, which is loaded at the start and does not change.
        localisation_only: bool = false;
        /// The parameters of the method.
        tracker: TrackerConfig as flatten;
    }
}

/// A parameter is about a map that is not there.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub(super) enum PoseParametersError {
    /// It is about a map, and there is none.
    #[error("parameter {0} needs slam: without it there is no map")]
    WithoutSlam(&'static str),
    /// It is about a saved map, and none is named.
    #[error("parameter {0} needs map_file: the path of a map that ~/save_map has saved")]
    WithoutMapFile(&'static str),
    /// The map is one of places that are known by their corners, and none are extracted.
    #[error(
        "parameter slam needs frame.use_points: the map places a camera by points, and lines do not suffice"
    )]
    SlamWithoutPoints,
}

impl NodeParameters for PoseParameters {
    fn validate_node(&self) -> Result<(), NodeFailure> {
        self.validate()?;
        Ok(self.check_map()?)
    }
}

impl PoseParameters {
    /// That those about a map have one.
    fn check_map(&self) -> Result<(), PoseParametersError> {
        if self.slam && !self.tracker.frame.use_points {
            return Err(PoseParametersError::SlamWithoutPoints);
        }
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
        Ok(())
    }

    /// Whether a saved map is there from the start.
    pub(super) fn begins_with_map(&self) -> bool {
        self.load_map_on_start || self.localisation_only
    }

    /// The extractor of features.
    pub(super) fn executor(&self) -> Arc<dyn Executor> {
        Arc::new(ScopedThreads::new(NonZeroUsize::new(self.threads).unwrap_or(NonZeroUsize::MIN)))
    }

    pub(super) fn rig_from_camera(&self) -> Isometry3<f64> {
        pose_from_vector(&self.rig_from_camera)
    }
}
