//! Builds the static map out of the static clouds of the cycles (Rec-HV 3.2.8, 3.3.4, eq. 9).
//!
//! [`StaticMap`] takes one cycle's clouds and costs by their points, and where rays clear voxels by their rays'
//! lengths and by what is in view, however large the map has become. When the map that its poses were told in is
//! corrected, it follows ([`StaticMap::follow_path`]). [`SurfaceMap`] takes the depth images themselves, at an edge of its
//! own; a [`Map`] is either. [`octomap`] knows the files of another map. This crate without
//! its feature `ros` is the core: it knows no ROS, no clock and no file.
//!
//! ```
//! use geometry::{Cloud, Stamp};
//! use nalgebra::Point3;
//! use reconstruction::{ReconstructionConfig, StaticMap};
//!
//! // Two points of one voxel and one of another.
//! let cloud = Cloud {
//!     stamp: Stamp::from_secs_nanos(1, 0),
//!     frame_id: "map".to_owned(),
//!     points_m: [[1.01, 0.01, 0.01], [1.02, 0.01, 0.01], [2.0, 0.0, 0.0]].map(Point3::from).to_vec(),
//! };
//! let mut map = StaticMap::new(ReconstructionConfig::default()).unwrap();
//! map.add(&cloud).unwrap();
//! assert_eq!((map.len(), map.frame_id()), (2, Some("map")));
//! ```

pub mod config;
mod map;
pub mod octomap;
#[cfg(feature = "ros")]
pub mod shell;
pub mod static_map;
pub mod surface_map;
pub mod tiles;

pub use config::{AtMaxVoxels, ConfigError, ReconstructionConfig};
pub use map::Map;
pub use static_map::{
    Addition, CorrectionCounts, CorrectionError, LISTENER_TOLERANCE_IN_EDGES, LOADED_HITS,
    LoadError, MapChanges, MapCorrection, MapError, StaticMap, WholeMap,
};
pub use surface_map::SurfaceMap;
pub use tiles::SpillCounts;
