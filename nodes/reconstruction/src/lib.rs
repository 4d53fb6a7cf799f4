//! Builds the static map out of the static clouds of the cycles (Rec-HV 3.2.8, 3.3.4, eq. 9).
//!
//! [`StaticMap`] takes one cloud a cycle and costs by that cloud's points, however large the map has
//! become. This crate without its feature `ros` is the core: it knows no ROS, no clock and no file.

pub mod config;
#[cfg(feature = "ros")]
pub mod shell;
pub mod static_map;

pub use config::{ConfigError, Method, ReconstructionConfig};
pub use static_map::{Addition, LISTENER_TOLERANCE_IN_EDGES, MapError, StaticMap};
