//! The node `pose`: colour and depth images in, the rig's pose out.

mod background_mapping;
mod cameras;
mod drawing;
mod follower;
mod frames;
mod hints;
mod inputs;
mod left_out;
mod map_file;
mod map_path;
mod output;
mod pairing;
mod parameters;
mod progress;
mod saving;
mod smoothing;
mod stage;
#[cfg(test)]
mod tests;

use std::process::ExitCode;

use msgs::std_srvs::Trigger;
use node_shell::{Node, NodeFailure, Program};

pub use background_mapping::BackgroundMapping;
pub use parameters::{DepthSource, ImageInput, PoseParameters};
use saving::Saving;
pub use stage::Stage;

const PROGRAM: Program = Program {
    name: "pose",
    about: "Tracks an RGB-D camera by the points and line segments that it sees.",
    topics: "in  rgb/image (sensor_msgs/msg/Image), best effort; with input:=raw
             in  rgb/image/compressed (sensor_msgs/msg/CompressedImage: jpeg, png), best effort; with input:=compressed
             in  rgb/camera_info (sensor_msgs/msg/CameraInfo), best effort
             in  depth/image (sensor_msgs/msg/Image: 16UC1 or 32FC1), best effort
             in  depth/camera_info (sensor_msgs/msg/CameraInfo), best effort; with depth:=raw
             in  tracks (stillmap_msgs/msg/Tracks: moving objects, from segmentation), reliable
             in  imu (sensor_msgs/msg/Imu), best effort; with use_imu:=true
             in  wheels (nav_msgs/msg/Odometry), best effort; with use_wheels:=true
             out pose (geometry_msgs/msg/PoseStamped: the rig in odom_frame_id), reliable
             out odom (nav_msgs/msg/Odometry: the same with covariance and velocity), reliable
             out /tf (tf2_msgs/msg/TFMessage: odom_frame_id to base_frame_id), reliable; with publish_tf:=true
             out /tf (map_frame_id to odom_frame_id), likewise; with slam:=true, and then pose and path are in map_frame_id
             out map_path (nav_msgs/msg/Path: the trajectory of the rig in the current map, in map_frame_id), reliable and transient local; with slam:=true
             out path (nav_msgs/msg/Path), reliable, once a second, for a viewer
             out features (sensor_msgs/msg/Image: the features and their status), best effort, for a viewer
             out ~/report (stillmap_msgs/msg/StageReport), reliable
             srv ~/save_map (std_srvs/srv/Trigger): saves the map of keyframes to the parameter map_file
             srv ~/load_map (std_srvs/srv/Trigger): puts the map of map_file in the place of the map; the camera is searched for in it
             srv ~/reset (std_srvs/srv/Trigger): begins anew with an empty map; with localisation_only:=true the map stays",
};

/// Runs the node until SIGINT or SIGTERM, with the arguments behind the program's name.
pub fn run(arguments: impl IntoIterator<Item = String>) -> ExitCode {
    PROGRAM.run(arguments, serve)
}

/// The node's body: serves until the node is to end.
///
/// # Errors
/// When a parameter is out of its range, a topic cannot be had, or the map cannot be loaded or saved.
pub async fn serve(node: &Node, parameters: PoseParameters) -> Result<(), NodeFailure> {
    let mut stage = Stage::new(node, &parameters)?;
    // None of them changes while the map continues.
    node.serve_parameters(&parameters)?;
    let mut lifecycle = node.manage()?;
    let save_map = node.service::<Trigger>("~/save_map")?;
    let load_map = node.service::<Trigger>("~/load_map")?;
    let begin_anew = node.service::<Trigger>("~/reset")?;
    let shutdown = node.shutdown_signal();
    let mut saving = Saving::default();
    loop {
        tokio::select! {
            biased;
            () = shutdown.wait() => break,
            _reset = lifecycle.reset() => stage.reset()?,
            () = saving.finish(), if !saving.is_idle() => {}
            request = save_map.next(), if saving.is_idle() => saving.begin(request, stage.to_be_saved()),
            request = load_map.next() => request.answer(stage.load_map()),
            request = begin_anew.next() => request.answer(stage.begin_anew()),
            arrival = stage.next() => {
                stage.take(arrival);
                node_shell::let_peers_run().await;
            }
        }
    }
    if !saving.is_idle() {
        saving.finish().await;
    }
    stage.save_on_exit()
}
