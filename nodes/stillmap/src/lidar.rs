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

pub(crate) use files::TileFolder;
pub(crate) use follower::LidarFollower;
pub(crate) use odometry::run as run_odometry;
pub(crate) use road::{RoadArgs, run as run_road};
pub(crate) use source::{LidarArgs, LidarSource, Sensed};

/// The name of the node and of its parameters' section.
pub(crate) const NODE: &str = "lidar_odometry";
/// What the pose is to be taken from, in place of a topic.
pub(crate) const LIDAR: &str = "lidar";

/// The nodes' own topics are apart from those of a bag.
const NAMESPACE: &str = "/stillmap_lidar";
