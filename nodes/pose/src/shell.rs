//! The node `pose`: colour and depth images in, the rig's pose out.

mod cameras;
mod drawing;
mod follower;
mod hints;
mod inputs;
mod output;
mod pairing;
mod parameters;
mod ranges;
mod stage;
#[cfg(test)]
mod tests;

use std::process::ExitCode;

use node_shell::{Node, NodeFailure, Program};

pub use parameters::{DepthSource, ImageInput, PoseParameters};
pub use stage::Stage;

const PROGRAM: Program = Program {
    name: "pose",
    about: "Follows an RGB-D camera by the points and line segments that it sees.",
    topics: "in  rgb/image (sensor_msgs/msg/Image), best effort; with input:=raw
             in  rgb/image/compressed (sensor_msgs/msg/CompressedImage: jpeg, png), best effort; with input:=compressed
             in  rgb/camera_info (sensor_msgs/msg/CameraInfo), best effort
             in  depth/image (sensor_msgs/msg/Image: 16UC1 or 32FC1), best effort
             in  depth/camera_info (sensor_msgs/msg/CameraInfo), best effort; with depth:=raw
             in  tracks (stillmap_msgs/msg/Tracks: what moves, from segmentation), reliable
             in  imu (sensor_msgs/msg/Imu), best effort; with use_imu:=true
             in  wheels (nav_msgs/msg/Odometry), best effort; with use_wheels:=true
             out pose (geometry_msgs/msg/PoseStamped: the rig in odom_frame_id), reliable
             out odom (nav_msgs/msg/Odometry: the same with covariance and velocity), reliable
             out /tf (tf2_msgs/msg/TFMessage: odom_frame_id to base_frame_id), reliable; with publish_tf:=true
             out /tf (map_frame_id to odom_frame_id), likewise; with slam:=true, and then pose and path are in map_frame_id
             out path (nav_msgs/msg/Path), reliable, once a second, for a viewer
             out features (sensor_msgs/msg/Image: what is seen, and what became of it), best effort, for a viewer
             out ~/report (stillmap_msgs/msg/StageReport), reliable",
};

/// Runs the node until SIGINT or SIGTERM, with the arguments behind the program's name.
pub fn run(arguments: impl IntoIterator<Item = String>) -> ExitCode {
    PROGRAM.run(arguments, serve)
}

/// The node's body: serves until the node is to end.
///
/// # Errors
/// When a parameter is out of its range, or a topic cannot be had.
pub async fn serve(node: &Node, parameters: PoseParameters) -> Result<(), NodeFailure> {
    let mut stage = Stage::new(node, &parameters)?;
    // None of them changes while the map goes on.
    node.serve_parameters(&parameters)?;
    let mut lifecycle = node.manage()?;
    let shutdown = node.shutdown_signal();
    loop {
        tokio::select! {
            biased;
            () = shutdown.wait() => break,
            _reset = lifecycle.reset() => stage.reset()?,
            arrival = stage.next() => stage.take(arrival),
        }
    }
    Ok(())
}
