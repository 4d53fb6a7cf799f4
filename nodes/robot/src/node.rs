//! `stillmap node`: one node of the suite, as its own program would run it.

use std::process::ExitCode;

use clap::{Args, ValueEnum};

/// Arguments of `stillmap node`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap node detection --ros-args -r scan:=/laser/scan -p voxel_edge_m:=0.05")]
pub struct NodeArgs {
    /// Which node
    node: NodeName,
    /// Its arguments, as ROS 2 nodes take them
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<String>,
}

/// The nodes of the suite.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum NodeName {
    /// Scans to dynamic zones; reduces the cloud
    Detection,
    /// Zones and cloud to static and dynamic clouds
    Segmentation,
    /// Static clouds to the static map
    Reconstruction,
    /// Colour and depth images to the rig's pose
    Pose,
    /// Clouds or packets of a turning LiDAR to the vehicle's pose
    LidarOdometry,
    /// A camera's raw images to compressed ones, beside a driver that sends only raw ones
    Compression,
}

/// Runs a node until it is told to stop.
pub(crate) fn run(args: NodeArgs) -> ExitCode {
    match args.node {
        NodeName::Detection => detection::shell::run(args.arguments),
        NodeName::Segmentation => segmentation::shell::run(args.arguments),
        NodeName::Reconstruction => reconstruction::shell::run(args.arguments),
        NodeName::Pose => pose::shell::run(args.arguments),
        NodeName::LidarOdometry => lidar_odometry::shell::run(args.arguments),
        NodeName::Compression => compression::run(args.arguments),
    }
}
