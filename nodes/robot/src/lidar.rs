//! What a turning LiDAR tells: the node of LiDAR odometry in this process, fed from a bag, a capture or scans of KITTI.

mod drive_map;
mod files;
mod follower;
mod odometry;
mod pictures;
mod report;
mod road;
mod source;
#[cfg(test)]
mod tests;

pub use files::TileFolder;
pub use follower::LidarFollower;
pub use odometry::run as run_odometry;
pub(crate) use road::RESULTS as ROAD_RESULTS;
pub use road::{RoadArgs, run as run_road};
pub use source::{LidarArgs, LidarSource, Sensed};

/// The name of the node and of its parameters' section.
pub const NODE: &str = "lidar_odometry";
/// What the pose is to be taken from, in place of a topic.
pub const LIDAR: &str = "lidar";

/// The nodes' own topics are apart from those of a bag.
const NAMESPACE: &str = "/stillmap_lidar";
