//! Builds the static map out of the cycles (Rec-HV 3.2.8, 3.3.4, eq. 9).
//!
//! [`StaticMap`], of the method `rec_hv`, takes a cycle's static cloud and costs by its points, however large the map has become.
//! [`SurfaceMap`], of the method `free_space`, takes the depth images without what moves in them, at an edge of its own. A
//! [`Map`] is either. When the map that its poses were measured in is corrected, both follow ([`Map::follow_path`]). [`octomap`]
//! knows the files of another map, [`mesh`] those of the surface as triangles, [`distance`] what planners ask. This crate without its feature `ros` is the core: it knows no ROS, no clock and no file.
//!
//! ```
//! use geometry::{Cloud, Method, PipelineConfig, Stamp};
//! use nalgebra::Point3;
//! use reconstruction::{ReconstructionConfig, StaticMap};
//!
//! // Two points of one voxel and one of another.
//! let cloud = Cloud {
//!     stamp: Stamp::from_secs_nanos(1, 0),
//!     frame_id: "map".to_owned(),
//!     points_m: [[1.01, 0.01, 0.01], [1.02, 0.01, 0.01], [2.0, 0.0, 0.0]].map(Point3::from).to_vec(),
//! };
//! let pipeline = PipelineConfig::new(Method::RecHv, 0.08);
//! let mut map = StaticMap::new(ReconstructionConfig { pipeline, ..Default::default() }).unwrap();
//! map.add(&cloud).unwrap();
//! assert_eq!((map.len(), map.frame_id()), (2, Some("map")));
//! ```

mod bounds;
pub mod config;
mod correction;
pub mod distance;
pub mod grid;
mod map;
pub mod mesh;
pub mod octomap;
mod outcome;
#[cfg(feature = "ros")]
pub mod shell;
mod static_map;
pub mod surface_map;
pub mod tiles;

pub use bounds::{BoundReached, KeptOut};
pub use config::{AtMaxVoxels, ConfigError, ReconstructionConfig};
pub use correction::{CorrectionCounts, CorrectionError, MapCorrection};
pub use distance::{DistanceError, MapBox};
pub use grid::{GridConfig, GridError, GridSource};
pub use map::Map;
pub use mesh::{MeshError, MeshForm};
pub use outcome::{Addition, LoadError, MapChanges, MapError, WholeMap};
pub use static_map::{LISTENER_TOLERANCE_IN_EDGES, LOADED_HITS, StaticMap};
pub use surface_map::SurfaceMap;
pub use surface_map::loading::one_a_voxel;
pub use surface_map::normals::normals;
pub use tiles::SpillCounts;
