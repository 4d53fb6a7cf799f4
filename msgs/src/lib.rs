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
