//! `stillmap node`: one node of the suite, as its own program would run it.

use std::process::ExitCode;

use clap::{Args, Subcommand};

/// Arguments of `stillmap node`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  stillmap node detection --ros-args -r scan:=/laser/scan -p voxel_edge_m:=0.05
  stillmap node detection --help")]
pub struct NodeArgs {
    /// Which node
    #[command(subcommand)]
    node: NodeName,
}

/// The nodes of the suite.
#[derive(Subcommand, Debug)]
enum NodeName {
    /// Scans to dynamic zones; reduces the cloud
    Detection(OwnArgs),
    /// Zones and cloud to static and dynamic clouds
    Segmentation(OwnArgs),
    /// Static clouds to the static map
    Reconstruction(OwnArgs),
    /// Colour and depth images to the rig's pose
    Pose(OwnArgs),
    /// Clouds or packets of a turning LiDAR to the vehicle's pose
    LidarOdometry(OwnArgs),
    /// A camera's raw images to compressed ones, beside a driver that sends only raw ones
    Compression(OwnArgs),
}

/// What the node itself reads.
#[derive(Args, Debug)]
#[command(disable_help_flag = true)]
struct OwnArgs {
    /// The node's topics and parameters
    #[arg(short, long)]
    help: bool,
    /// Its arguments, as ROS 2 nodes take them
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<String>,
}

impl OwnArgs {
    fn for_node(self) -> Vec<String> {
        if self.help { vec!["--help".to_owned()] } else { self.arguments }
    }
}

/// Runs a node until SIGINT or SIGTERM.
pub(crate) fn run(args: NodeArgs) -> ExitCode {
    match args.node {
        NodeName::Detection(own) => detection::shell::run(own.for_node()),
        NodeName::Segmentation(own) => segmentation::shell::run(own.for_node()),
        NodeName::Reconstruction(own) => reconstruction::shell::run(own.for_node()),
        NodeName::Pose(own) => pose::shell::run(own.for_node()),
        NodeName::LidarOdometry(own) => lidar_odometry::shell::run(own.for_node()),
        NodeName::Compression(own) => compression::run(own.for_node()),
    }
}
