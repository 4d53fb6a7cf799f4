//! Builds the static map out of the static clouds of the cycles (Rec-HV 3.2.8, 3.3.4, eq. 9).
//!
//! [`StaticMap`] takes one cycle's clouds and costs by their points, and where rays clear voxels by their rays'
//! lengths and by what is in view, however large the map has become. When the map that its poses were told in is
//! corrected, it follows ([`StaticMap::follow_path`]). [`octomap`] knows the files of another map. This crate without
//! its feature `ros` is the core: it knows no ROS, no clock and no file.

pub mod config;
pub mod octomap;
#[cfg(feature = "ros")]
pub mod shell;
pub mod static_map;
pub mod tiles;

pub use config::{AtMaxVoxels, ConfigError, Method, ReconstructionConfig};
pub use static_map::{
    Addition, CorrectionCounts, CorrectionError, LISTENER_TOLERANCE_IN_EDGES, LOADED_HITS,
    LoadError, MapChanges, MapCorrection, MapError, SpillCounts, StaticMap, WholeMap,
};
