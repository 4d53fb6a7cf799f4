//! `geometry_msgs`: positions, rotations, poses, velocities.

use serde::{Deserialize, Serialize};

use crate::fixed_array;
use crate::std_msgs::Header;

/// A position in metres.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Point {
    /// Along x.
    pub x: f64,
    /// Along y.
    pub y: f64,
    /// Along z.
    pub z: f64,
}
ros_message!(Point, "geometry_msgs");

/// A direction or an amount along three axes; only rotations act on it.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Vector3 {
    /// Along x.
    pub x: f64,
    /// Along y.
    pub y: f64,
    /// Along z.
    pub z: f64,
}
ros_message!(Vector3, "geometry_msgs");

/// A rotation as a unit quaternion; the default is no rotation.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Quaternion {
    /// Imaginary part along x.
    pub x: f64,
    /// Imaginary part along y.
    pub y: f64,
    /// Imaginary part along z.
    pub z: f64,
    /// Real part.
    pub w: f64,
}
ros_message!(Quaternion, "geometry_msgs");

impl Default for Quaternion {
    fn default() -> Self {
        Self { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }
    }
}

/// A position and an orientation.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Pose {
    /// The position in metres.
    pub position: Point,
    /// The orientation.
    pub orientation: Quaternion,
}
ros_message!(Pose, "geometry_msgs");

/// A pose with its moment and the frame that it is expressed in.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct PoseStamped {
    /// The moment and the frame.
    pub header: Header,
    /// The pose.
    pub pose: Pose,
}
ros_message!(PoseStamped, "geometry_msgs");

/// Poses of one moment.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct PoseArray {
    /// The moment and the frame.
    pub header: Header,
    /// The poses.
    pub poses: Vec<Pose>,
}
ros_message!(PoseArray, "geometry_msgs");

/// A pose and how sure it is.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct PoseWithCovariance {
    /// The pose.
    pub pose: Pose,
    /// 6 x 6 by rows: x, y, z in metres, rotations about x, y, z in radians.
    #[serde(with = "fixed_array")]
    pub covariance: [f64; 36],
}
ros_message!(PoseWithCovariance, "geometry_msgs");

impl Default for PoseWithCovariance {
    fn default() -> Self {
        Self { pose: Pose::default(), covariance: [0.0; 36] }
    }
}

/// A pose and how sure it is, with its moment and the frame that it is expressed in.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct PoseWithCovarianceStamped {
    /// The moment and the frame.
    pub header: Header,
    /// The pose.
    pub pose: PoseWithCovariance,
}
ros_message!(PoseWithCovarianceStamped, "geometry_msgs");

/// A rigid motion: the rotation first, then the translation.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Transform {
    /// The translation in metres.
    pub translation: Vector3,
    /// The rotation.
    pub rotation: Quaternion,
}
ros_message!(Transform, "geometry_msgs");

/// Takes coordinates of the child frame to the header's frame.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct TransformStamped {
    /// The moment, and the parent frame.
    pub header: Header,
    /// The child frame.
    pub child_frame_id: String,
    /// Pose of the child frame in the parent frame.
    pub transform: Transform,
}
ros_message!(TransformStamped, "geometry_msgs");

/// A velocity.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Twist {
    /// Linear, in m/s.
    pub linear: Vector3,
    /// Angular, in rad/s.
    pub angular: Vector3,
}
ros_message!(Twist, "geometry_msgs");

/// A velocity and how sure it is.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct TwistWithCovariance {
    /// The velocity.
    pub twist: Twist,
    /// 6 x 6 by rows: x, y, z in m/s, rotations about x, y, z in rad/s.
    #[serde(with = "fixed_array")]
    pub covariance: [f64; 36],
}
ros_message!(TwistWithCovariance, "geometry_msgs");

impl Default for TwistWithCovariance {
    fn default() -> Self {
        Self { twist: Twist::default(), covariance: [0.0; 36] }
    }
}
