//! `nav_msgs`: odometry, paths and floor plans.

use serde::{Deserialize, Serialize};

use crate::builtin_interfaces::Time;
use crate::geometry_msgs::{Pose, PoseStamped, PoseWithCovariance, TwistWithCovariance};
use crate::std_msgs::Header;

/// What the cells of a grid are.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct MapMetaData {
    /// When the map was made.
    pub map_load_time: Time,
    /// Edge of a cell in metres.
    pub resolution: f32,
    /// Cells along x.
    pub width: u32,
    /// Cells along y.
    pub height: u32,
    /// Pose of the corner of cell (0, 0) in the map, in metres.
    pub origin: Pose,
}
ros_message!(MapMetaData, "nav_msgs");

/// A floor plan in cells.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct OccupancyGrid {
    /// The moment, and the frame of the map.
    pub header: Header,
    /// What the cells are.
    pub info: MapMetaData,
    /// The cells row by row, along x first, from cell (0, 0): 0 free, 100 occupied, -1 unknown.
    pub data: Vec<i8>,
}
ros_message!(OccupancyGrid, "nav_msgs");

/// An estimate of pose and velocity.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Odometry {
    /// The moment, and the frame of the pose.
    pub header: Header,
    /// The frame whose pose it is, in which the velocity is expressed.
    pub child_frame_id: String,
    /// The pose of the child frame in the header's frame.
    pub pose: PoseWithCovariance,
    /// The velocity in the child frame.
    pub twist: TwistWithCovariance,
}
ros_message!(Odometry, "nav_msgs");

/// Poses along a path.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Path {
    /// The frame of the poses.
    pub header: Header,
    /// The poses, from first to last.
    pub poses: Vec<PoseStamped>,
}
ros_message!(Path, "nav_msgs");
