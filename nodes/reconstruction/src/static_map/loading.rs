//! A map that was saved takes the place of this one.

use geometry::VoxelKey;
use nalgebra::Point3;

use super::{Addition, StaticMap};
use crate::tiles::TileError;

/// A point of a loaded map counts as so many points of its voxel's mean, and its voxel as seen in so many cycles: half
/// of what the clamp of the evidence remembers (see [`geometry::Method::FreeSpace`]), since the map was sure of it
/// when it was saved, and the place may have changed since. Five cycles in which something is seen behind it
/// clear it.
pub const LOADED_HITS: u32 = 2;

/// A map does not fit.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum LoadError {
    /// More voxels than there may be.
    #[error("the map would have {voxels} voxels, and max_voxels is {max_voxels}")]
    TooManyVoxels {
        /// Of the points, at the map's edge.
        voxels: usize,
        /// The bound.
        max_voxels: usize,
    },
    /// A map of depth images needs normals.
    #[error(
        "a map of depth images (map_edge_m) is loaded from points with normals, a .ply or .pcd file of such a map, and this has none"
    )]
    NoNormals,
    /// More blocks than there may be.
    #[error("the map would have more blocks than max_map_blocks, {max_map_blocks}")]
    TooManyBlocks {
        /// The bound.
        max_map_blocks: usize,
    },
    /// Tiles cannot be spilled, so that there is no room for all. The map is empty.
    #[error(
        "{refused_points} of its points found no room, and the map is empty now{}",
        .reason.as_ref().map_or_else(String::new, |reason| format!(": {reason}"))
    )]
    NoRoom {
        /// The points that were refused.
        refused_points: usize,
        /// What the store could not do.
        reason: Option<TileError>,
    },
}

impl StaticMap {
    /// Puts these points, in `frame_id`, in the place of the whole map: each voxel is the mean of its points, with
    /// [`LOADED_HITS`]. Points that are not finite are left out. The order of the points changes nothing. The
    /// stamp stays. Who follows the changes has to start with a new map, as after [`StaticMap::clear`].
    ///
    /// # Errors
    /// When the points need more than `max_voxels`, also where old voxels make room, but not where tiles are spilled;
    /// the map is then as it was. Where tiles are spilled, when they cannot be: the old map has gone then, half a map is
    /// none, and the map is empty.
    pub fn replace(
        &mut self,
        points_m: &[Point3<f32>],
        frame_id: &str,
    ) -> Result<Addition, LoadError> {
        let mut keyed: Vec<(VoxelKey, &Point3<f32>)> = points_m
            .iter()
            .filter(|point| geometry::is_finite(point))
            .map(|point| (self.grid.key(point), point))
            .collect();
        keyed.sort_unstable_by_key(|(key, _)| *key);
        let voxels = keyed.chunk_by(|a, b| a.0 == b.0).count();
        if voxels > self.max_voxels && self.spill.is_none() {
            return Err(LoadError::TooManyVoxels { voxels, max_voxels: self.max_voxels });
        }
        let stamp = self.stamp;
        self.clear();
        self.stamp = stamp;
        self.frame_id = Some(frame_id.to_owned());
        let mut addition =
            Addition { not_finite_points: points_m.len() - keyed.len(), ..Addition::default() };
        for _ in 0..LOADED_HITS {
            // A cycle each, so that the evidence counts too.
            self.begin_counting_cycle();
            for (_, point) in &keyed {
                self.add_point(point, &mut addition);
            }
            if addition.refused_points > 0 {
                // Half a map is none.
                let refused_points = addition.refused_points;
                let reason = self.take_tile_error();
                self.clear();
                return Err(LoadError::NoRoom { refused_points, reason });
            }
        }
        addition.added_points = keyed.len();
        self.end_adding(&mut addition);
        Ok(addition)
    }

    /// Gives the frame of the map another name, as when its first cloud says the name in full. The points stay.
    pub fn rename_frame(&mut self, frame_id: &str) {
        self.frame_id = Some(frame_id.to_owned());
    }
}
