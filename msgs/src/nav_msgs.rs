//! `nav_msgs`: odometry and paths.

use serde::{Deserialize, Serialize};

use crate::geometry_msgs::{PoseStamped, PoseWithCovariance, TwistWithCovariance};
use crate::std_msgs::Header;

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
