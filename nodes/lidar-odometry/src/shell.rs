//! The node `lidar_odometry`: clouds or packets of a turning LiDAR in, the vehicle's pose out.

mod background_search;
mod hints;
mod inputs;
mod loops;
mod network;
mod output;
mod parameters;
mod pictures;
mod stage;
#[cfg(test)]
mod tests;

use std::process::ExitCode;

use node_shell::{Node, NodeFailure, Program};

pub use background_search::BackgroundSearch;
pub use parameters::{
    EchoChoice, FilterChoice, LidarInput, LidarOdometryParameters, ModelChoice, TimeUnitChoice,
};
pub use stage::Stage;

const PROGRAM: Program = Program {
    name: "lidar_odometry",
    about: "Tracks a vehicle by its spinning LiDAR.",
    topics: "in  points (sensor_msgs/msg/PointCloud2 of a LiDAR's driver), best effort; with input:=points
             in  velodyne_packets (velodyne_msgs/msg/VelodyneScan), best effort; with input:=velodyne_packets
             in  UDP packets of a Velodyne; with input:=udp
             in  imu (sensor_msgs/msg/Imu), best effort; with use_imu:=true
             in  wheels (nav_msgs/msg/Odometry), best effort; with use_wheels:=true
             out pose (geometry_msgs/msg/PoseStamped: the vehicle in odom_frame_id), reliable
             out odom (nav_msgs/msg/Odometry: the same with covariance and velocity), reliable
             out /tf (tf2_msgs/msg/TFMessage: odom_frame_id to base_frame_id), reliable; with publish_tf:=true
             out /tf (map_frame_id to odom_frame_id), reliable; with loop_closing:=true and publish_tf:=true
             out path (nav_msgs/msg/Path), reliable, once a second, for a viewer
             out map_path (nav_msgs/msg/Path: every two metres of the drive in map_frame_id), transient local; at each loop
             out local_map (sensor_msgs/msg/PointCloud2: the map that scans are registered to), reliable, once a second, for a viewer
             out lidar_scan (sensor_msgs/msg/PointCloud2: the points in base_frame_id as if measured at once), best effort, for a viewer
             out intensity_panorama, range_panorama (sensor_msgs/msg/Image: all around), best effort, for a viewer
             out drive_from_above, whole_drive (sensor_msgs/msg/Image: the trajectory, about the vehicle and all of it), best effort, for a viewer
             out ~/report (stillmap_msgs/msg/StageReport), reliable",
};

/// Runs the node until SIGINT or SIGTERM, with the arguments behind the program's name.
pub fn run(arguments: impl IntoIterator<Item = String>) -> ExitCode {
    PROGRAM.run(arguments, serve)
}

/// The node's body: serves until the node is to end.
///
/// # Errors
/// When a parameter is out of its range, a topic cannot be created, or listening on the scanner's port fails.
pub async fn serve(node: &Node, parameters: LidarOdometryParameters) -> Result<(), NodeFailure> {
    let mut stage = Stage::new(node, &parameters)?;
    // None of them changes while the map continues.
    node.serve_parameters(&parameters)?;
    let mut lifecycle = node.manage()?;
    let shutdown = node.shutdown_signal();
    loop {
        tokio::select! {
            biased;
            () = shutdown.wait() => break,
            _reset = lifecycle.reset() => stage.reset(),
            arrival = stage.next() => {
                // Packets of the scanner itself arrive in every state.
                if lifecycle.is_active() {
                    stage.take(arrival);
                    node_shell::let_peers_run().await;
                }
            }
        }
    }
    Ok(())
}
