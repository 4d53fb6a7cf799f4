//! 3D LiDAR: the node of LiDAR odometry in this process, with input from a bag, a capture or scans of KITTI.

mod drive_map;
mod files;
mod findings;
mod follower;
mod odometry;
mod pictures;
mod report;
mod road;
mod road_tiles;
mod source;
#[cfg(test)]
mod tests;

pub(crate) use findings::POINT_TIMES_FIX;
pub use follower::LidarFollower;
pub use odometry::run as run_odometry;
pub(crate) use road::RESULTS as ROAD_RESULTS;
pub use road::{RoadArgs, run as run_road};
pub use road_tiles::RoadTiles;
pub(crate) use source::nothing_decoded;
pub use source::{LidarArgs, LidarSource, Sensed};

/// The name of the node and of its parameters' section.
pub const NODE: &str = "lidar_odometry";
/// The value of `--pose` that selects this node instead of a topic.
pub const LIDAR: &str = "lidar";

/// The namespace of the nodes, which keeps their topics apart from those of a bag.
const NAMESPACE: &str = "/stillmap_lidar";
