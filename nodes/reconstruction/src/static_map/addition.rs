//! What became of a cycle.

use volume::ViewError;

/// What one cycle did to the map. A map of depth images counts blocks of 8 voxels an axis in the place of voxels, and no
/// points.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Addition {
    /// Points of the cloud that went into the map.
    pub added_points: usize,
    /// Points that were refused: they needed a voxel beyond `max_voxels`, or, where tiles are spilled, their tile could
    /// not be read or no other one could be written to make room.
    pub refused_points: usize,
    /// Points that were left out because a coordinate is not finite.
    pub not_finite_points: usize,
    /// Voxels that the map did not have before.
    pub new_voxels: usize,
    /// Voxels that were touched, the new ones included.
    pub changed_voxels: usize,
    /// Voxels that went since rays passed them, or since nothing comes back from their directions any more.
    pub cleared_voxels: usize,
    /// Voxels that went to make room for others.
    pub dropped_voxels: usize,
}

/// A cloud that does not belong into the map.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum MapError {
    /// The map is made of depth images, and the cycle has none.
    #[error(
        "the map is made of depth images (map_edge_m), and the cycle has none: detection and segmentation of this version \
         send one with the method free_space; or set map_edge_m to 0"
    )]
    NoDepthImage,
    /// The depth image cannot be used.
    #[error(transparent)]
    View(#[from] ViewError),
    /// The cloud is in another frame than those before.
    #[error(
        "the static cloud is in frame {cloud:?}, the map in frame {map:?}: clear the map, or let the pose source \
         keep its frame"
    )]
    AnotherFrame {
        /// The frame of the map.
        map: String,
        /// The frame of the cloud.
        cloud: String,
    },
}
