//! Volumetric maps: which places are free, occupied or unknown and since when, and where the surface is.
//! No ROS, no clock, no files.
//!
//! Space is divided into voxels, and these into blocks of 8 an axis, found by a hash of their keys. Images update it by
//! **projection**: instead of a ray being cast from each pixel, a voxel is projected into the depth image and compared with the
//! depth there. A pyramid of least and greatest depths classifies whole cubes of blocks at once, so that most of the time is
//! spent near surfaces.
//!
//! | type | what |
//! |---|---|
//! | [`DepthView`] | one depth image or cloud, prepared: any number of layers with different voxel edges are updated from it |
//! | [`Cell`] | the evidence on a place, in 2D or 3D: hits and passes, free, occupied or unknown, since when, and the rules for them |
//! | [`Occupancy`] | a cell for each voxel, updated by images |
//! | [`PlaneOccupancy`] | the same in the horizontal plane, of the rays of scans |
//! | [`TiledView`], [`SeenBefore`] | what an image saw by direction, without the image; where nothing comes back any more |
//! | [`Surface`] | signed distances, weights, colours: the map; points, triangles, changes for listeners, blocks as bytes, corrections |
//! | [`DistanceField`] | how far a place is from the nearest point of a surface, and in which direction that is |
//!
//! ```
//! use geometry::{CameraModel, DepthFrame, DepthImage, DepthPixels, Distortion, Stamp};
//! use volume::*;
//!
//! let (size, distortion) = ((64, 48), Distortion::None);
//! let (width_px, height_px, fx_px, fy_px, cx_px, cy_px) = (64, 48, 52.5, 52.5, 31.5, 23.5);
//! let camera = CameraModel { width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion };
//! let wall = DepthPixels::Millimetres(vec![2000; 64 * 48]);
//! let image = DepthImage::new(Stamp::default(), "camera".into(), size, wall)?;
//!
//! let mut view = DepthView::new(DepthRange::default(), DepthNoise::default())?;
//! let mut surface = Surface::new(SurfaceConfig { edge_m: 0.05, ..SurfaceConfig::default() })?;
//! let (frame, map_from_camera) = (DepthFrame::new(image, camera)?, nalgebra::Isometry3::identity());
//! view.fill(&DepthInput::new(&frame, &map_from_camera))?;
//! surface.integrate(&view, &estimation::executor::Serial);
//! assert!(surface.points(PointRules::default()).iter().all(|p| (p.position_m.z - 2.0).abs() < 0.001));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod block;
mod camera_frame;
mod cell;
mod depth_view;
mod descent;
mod evidence;
mod layer;
mod levels;
mod no_return;
mod noise;
mod occupancy;
mod plane;
mod projection;
mod surface;
#[cfg(test)]
mod testing;
mod ticks;
mod tiled_view;

pub use block::{BLOCK_EDGE, BLOCK_VOXELS, BlockBox, BlockKey, voxel_index};
pub use cell::{Cell, CellState};
pub use depth_view::{DepthInput, DepthRange, DepthView, ViewError};
pub use no_return::{
    AS_NEAR, FARTHEST_SEEN_M, NEAREST_SEEN_M, SeenBefore, is_missed_long_enough, sees_as_well,
};
pub use noise::DepthNoise;
pub use occupancy::{Occupancy, OccupancyConfig, OccupancyConfigError, OccupancyUpdate, Place};
pub use plane::{PlaneConfig, PlaneOccupancy, PlaneRay, SAMPLES_PER_CELL, WIDEST_GAP_M};
pub use projection::{SphericalModel, SphericalModelError};
pub use surface::{
    BlockFormatError, BlockMesh, ChangeFollower, DistanceConfig, DistanceConfigError,
    DistanceField, LISTENER_TOLERANCE_IN_EDGES, LatticeBox, MeshChange, MeshFollower, MeshJoiner,
    MeshVertex, PointRules, Surface, SurfaceChanges, SurfaceConfig, SurfaceConfigError,
    SurfacePoint, SurfaceUpdate,
};
pub use tiled_view::{Sight, TiledView};
