//! The node `detection`: scans, depth images (or clouds) and poses in, reduced clouds and zones out.

mod backlog;
mod camera;
mod colour;
mod extrinsics;
mod inputs;
mod mounts;
mod output;
mod parameters;
mod rendering;
mod restarts;
mod rig_pose;
mod sensor_frame;
mod stage;
#[cfg(test)]
mod tests;
mod transform_state;
mod transforms;

use std::process::ExitCode;
use std::time::Duration;

use geometry::ExtrinsicsSource;
use node_shell::{Node, NodeFailure, Program};

use crate::DetectionConfig;
pub use camera::IMAGE_WITHOUT_CALIBRATION;
pub use stage::{Stage, UNUSABLE_MESSAGE_ON};
pub use transforms::WAITING_FOR_TRANSFORM;

const PROGRAM: Program = Program {
    name: "detection",
    about: "Finds moving objects in the scans of a 2D laser scanner, and reduces the cloud.",
    topics: "in  scan (sensor_msgs/msg/LaserScan), best effort
             in  depth/image (sensor_msgs/msg/Image: 16UC1 or 32FC1), best effort; with input:=depth
             in  depth/image/compressedDepth (sensor_msgs/msg/CompressedImage: png or rvl), best effort;
                 with input:=compressed_depth
             in  depth/camera_info (sensor_msgs/msg/CameraInfo), best effort; with both of these
             in  points (sensor_msgs/msg/PointCloud2), best effort; with input:=points
             in  rgb/image (sensor_msgs/msg/Image: rgb8, bgr8, rgba8, bgra8 or mono8), best effort; with colour:=raw
             in  rgb/image/compressed (sensor_msgs/msg/CompressedImage: jpeg or png), best effort; with colour:=compressed
             in  rgb/camera_info (sensor_msgs/msg/CameraInfo), best effort; with both of these
             in  pose (geometry_msgs/msg/PoseStamped: the rig in the map), best effort; with pose_source:=pose
             in  pose_with_covariance (geometry_msgs/msg/PoseWithCovarianceStamped), best effort; with this pose_source
             in  odom (nav_msgs/msg/Odometry), best effort; with pose_source:=odometry
             in  map_path (nav_msgs/msg/Path: the trajectory of the rig, as corrected by now), reliable; nobody need publish it
             in  /tf_static, /tf (tf2_msgs/msg/TFMessage: where the sensors are, or the rig in the map), reliable and transient
                 local, best effort; with extrinsics:=tf, extrinsics:=tf_from_rig, or pose_source:=tf
             out reduced_cloud (stillmap_msgs/msg/ReducedCloud), reliable
             out dynamic_zones (stillmap_msgs/msg/DynamicZones), reliable
             out ~/report (stillmap_msgs/msg/StageReport), reliable
             out ~/views (stillmap_msgs/msg/StageReport), reliable: each image or cloud that was taken, for a paced player",
};

/// The waiting scans are dropped when nothing has arrived for so many times `max_wait_s`: the end of the input cannot be
/// recognised by stamps.
const SILENCE_IN_WAITS: f64 = 2.0;

geometry::choices! {
    /// Where the cloud comes from.
    pub enum CloudInput {
        /// depth/image with depth/camera_info: a tenth of the bytes of a cloud.
        Depth = "depth",
        /// The same as PNG or RVL, from depth/image/compressedDepth.
        CompressedDepth = "compressed_depth",
        /// points, a PointCloud2 in the camera's optical frame.
        Points = "points",
    }
}

geometry::choices! {
    /// Where the colours of the map come from.
    pub enum ColourInput {
        /// The field rgb or rgba of points, where input is points and they have one; else there are none.
        Cloud = "cloud",
        /// rgb/image with rgb/camera_info.
        Raw = "raw",
        /// The same as JPEG or PNG, from rgb/image/compressed.
        Compressed = "compressed",
        /// There are none.
        None = "none",
    }
}

geometry::choices! {
    /// Where the pose of the rig comes from.
    pub enum PoseInput {
        /// pose, a PoseStamped.
        Pose = "pose",
        /// pose_with_covariance, a PoseWithCovarianceStamped, as AMCL and RTAB-Map publish it. The covariance is not used.
        PoseWithCovariance = "pose_with_covariance",
        /// odom, an Odometry. With extrinsics: tf_from_rig its child_frame_id may be another frame of the robot than rig_frame_id; else
        /// it is taken as the rig.
        Odometry = "odometry",
        /// /tf and /tf_static: rig_frame_id in map_frame_id, at the stamp of the camera's message. A scan waits for it as for its
        /// image.
        Tf = "tf",
    }
}

geometry::parameters! {
    /// The parameters of the node.
    #[derive(Clone, PartialEq, Debug)]
    pub struct DetectionParameters {
        /// Where the cloud comes from.
        input: CloudInput = CloudInput::Depth;
        /// Where the pose of the rig comes from.
        pose_source: PoseInput = PoseInput::Pose;
        /// The frame of the map.
        // REP-105.
        map_frame_id: String = "map".to_owned(), read_with("pose_source", "tf");
        /// The depth camera's calibration in place of that on depth/camera_info: the path of a camera_info file in YAML, as
        /// camera_calibration and camera_info_manager write it; "" for none.
        camera_info_file: String = String::new();
        /// Where the colours of the map come from. Nothing is subscribed to but with raw and compressed.
        // A robot without a colour camera waits for none.
        colour: ColourInput = ColourInput::Cloud, read_with("method", "free_space");
        /// A colour image belongs to a depth image when their stamps differ by at most this. A cycle waits for it until the next
        /// cycle is complete, and then goes without colours; /diagnostics counts these.
        // Two thirds of the time between two images of a Kinect.
        max_colour_offset_s: f64 = 0.02, positive, read_with("method", "free_space");
        /// Pose of the depth camera in the colour camera, both by their optical frames: [x_m, y_m, z_m, yaw_rad, pitch_rad,
        /// roll_rad]. Zeros where the driver has registered the depth images. By it the map gets its colours, and static_rgb its mask.
        colour_from_depth: [f64; 6] = [0.0; 6];
        /// How often it is checked whether the scan lies on the surfaces that the camera sees; 0 turns the check off. The outcome
        /// is on /diagnostics, a warning when it does not: then calibrate anew (stillmap calibrate).
        // A knock is reported in some five seconds, for a few milliseconds of each.
        extrinsics_check_period_s: f64 = 1.0, not_negative, changeable;
        /// How far beside those surfaces the scan may lie.
        extrinsics_limit_m: f64 = calibration::DriftConfig::default().limit_m, positive, changeable;
        /// The parameters of the method.
        config: DetectionConfig as flatten;
    }
}

impl DetectionParameters {
    /// Where colours come from; `None` where nowhere, or the method has no use for them.
    pub(crate) fn colour_source(&self) -> Option<ColourInput> {
        let is_used = self.config.pipeline.needs_depth() && self.colour != ColourInput::None;
        is_used.then_some(self.colour)
    }

    /// Whether the node needs anything from tf.
    #[must_use]
    pub fn needs_tf(&self) -> bool {
        let extrinsics = self.config.pipeline.rig.extrinsics;
        self.pose_source == PoseInput::Tf || extrinsics != ExtrinsicsSource::Parameters
    }
}

/// Runs the node until SIGINT or SIGTERM, with the arguments behind the program's name.
pub fn run(arguments: impl IntoIterator<Item = String>) -> ExitCode {
    PROGRAM.run(arguments, serve)
}

/// The node's body: serves until the node is to end.
///
/// # Errors
/// When a parameter is out of its range, or a topic cannot be had.
pub async fn serve(node: &Node, parameters: DetectionParameters) -> Result<(), NodeFailure> {
    let longest_silence =
        Duration::try_from_secs_f64(SILENCE_IN_WAITS * parameters.config.max_wait_s)?;
    let mut stage = Stage::new(node, &parameters)?;
    let mut live = node.serve_parameters(&parameters)?;
    let mut lifecycle = node.manage()?;
    let clock = node.clock();
    let mut jumps = clock.jumps();
    let shutdown = node.shutdown_signal();
    loop {
        let silence = async {
            if stage.is_waiting() {
                clock.sleep(longest_silence).await;
            } else {
                std::future::pending::<()>().await;
            }
        };
        tokio::select! {
            biased;
            () = shutdown.wait() => break,
            parameters = live.changed() => stage.change(&parameters)?,
            _reset = lifecycle.reset() => stage.reset(),
            now = jumps.next() => stage.set_back(now),
            () = std::future::ready(()), if stage.may_go_on() => {
                stage.process_next();
                node_shell::let_peers_run().await;
            }
            arrival = stage.next() => {
                stage.take(arrival);
                node_shell::let_peers_run().await;
            }
            // Of a recording every cycle counts, and its player waits for slow nodes: silence is no end while it is there.
            () = silence => if !(node.takes_every_cycle() && stage.has_view_publishers()) {
                stage.give_up_waiting();
            },
        }
    }
    // Live, who ends does not process what waits.
    if node.takes_every_cycle() {
        stage.give_up_waiting();
    }
    Ok(())
}
