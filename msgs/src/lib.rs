//! The ROS 2 messages of the suite: their Rust structs, their `.msg` files, their CDR encoding, and
//! the one place where a message becomes geometry or back ([`convert`]).
//!
//! A struct and its `.msg` file state the same twice: tests compare names, order, types, defaults
//! and constants of the two, so that neither can change alone. The standard messages are as
//! in ROS 2 Jazzy; `stillmap_msgs` is the suite's own package.
//!
//! Whatever a message claims about its own sizes is checked before it is used: [`cdr::decode`] and
//! the conversions return typed errors, read nothing beyond the message, and allocate no more than the
//! message itself justifies.
//!
//! ```
//! use geometry::{Stamp, StampedPose};
//! use msgs::geometry_msgs::PoseStamped;
//! use msgs::{cdr, convert};
//! use nalgebra::Isometry3;
//!
//! let pose = StampedPose {
//!     stamp: Stamp::from_secs_nanos(1, 500_000_000),
//!     frame_id: "map".to_owned(),
//!     map_from_rig: Isometry3::translation(1.0, 2.0, 0.0),
//! };
//! // The bytes that DDS and bags carry, with the four of their encapsulation.
//! let bytes = cdr::encode(&convert::message_from_pose(&pose))?;
//! let message: PoseStamped = cdr::decode(&bytes)?;
//! assert_eq!(convert::pose_from_message(&message)?, pose);
//!
//! // Four numbers that are no rotation are told, and do not become one.
//! let mut message = message;
//! message.pose.orientation.w = 0.0;
//! assert!(convert::pose_from_message(&message).is_err());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[macro_use]
mod message;

pub mod builtin_interfaces;
pub mod cdr;
pub mod convert;
mod definition;
pub mod diagnostic_msgs;
mod domain;
mod fixed_array;
pub mod geometry_msgs;
pub mod lifecycle_msgs;
pub mod map_msgs;
pub mod nav_msgs;
pub mod rcl_interfaces;
mod registry;
pub mod rosgraph_msgs;
mod schema;
pub mod sensor_msgs;
pub mod std_msgs;
pub mod std_srvs;
pub mod stillmap_msgs;
pub mod tf2_msgs;
mod type_hash;
pub mod velodyne_msgs;
pub mod visualization_msgs;

#[cfg(test)]
mod introspection;

pub use domain::Domain;
pub use message::{RosMessage, RosService};
pub use schema::schema_of;
pub use type_hash::type_hash_of;
