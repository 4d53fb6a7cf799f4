//! What a map of either kind says: of a cycle, of its points, of its changes, of what it cannot take.

use geometry::{Cloud, LastSight, MapView, OrientedPoints};
use volume::ViewError;

use crate::tiles::TileError;

/// What one cycle did to the map. A map of depth images counts blocks of 8 voxels an axis in the place of voxels, and no
/// points.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Addition {
    /// Points of the cloud that went into the map.
    pub added_points: usize,
    /// Points that needed a voxel beyond `max_voxels`. Of a map of depth images, blocks beyond `max_map_blocks`, or, where tiles
    /// are spilled, whose tile could not be read, or for which no other one could be written to make room.
    pub refused_points: usize,
    /// Points that were left out because a coordinate is not finite.
    pub not_finite_points: usize,
    /// Voxels that the map did not have before.
    pub new_voxels: usize,
    /// Voxels that were touched, the new ones included.
    pub changed_voxels: usize,
    /// Blocks that were removed since nothing is in them any more.
    pub cleared_voxels: usize,
    /// Blocks that were removed to make room for others.
    pub dropped_voxels: usize,
    /// Whether the depth image has more blocks than one image may update: those left out are the farthest.
    pub is_view_cut: bool,
}

/// A cycle that does not fit the map.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum MapError {
    /// The map is made of depth images, and the cycle has none.
    #[error(
        "the map is made of depth images, and the cycle has none: detection and segmentation of this version send one with \
         the method free_space"
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

/// All points of the map, and what could not be read of it.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct WholeMap {
    /// The points, one a voxel, in ascending order of the voxels' keys; of a map of depth images, of its
    /// blocks' keys and of the voxels within a block. The normals of the surface are of length 1, to the side from which it was seen;
    /// a colour is [`geometry::NO_COLOUR`] where none was seen. A map of means has neither.
    pub points: OrientedPoints,
    /// Where a map of depth images was seen from; of a map of means none.
    pub views: Vec<MapView>,
    /// How the blocks of a map of depth images were seen last, by ascending key, for a file that is to be continued; of a map of means none.
    pub sights: Vec<LastSight>,
    /// The spilled tiles whose points are not among them, by ascending key.
    pub unreadable: Vec<TileError>,
}

/// What a listener has to do to its copy of the map, as two clouds of the map's frame and stamp.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct MapChanges {
    /// Points that are new or have moved: each replaces the listener's point of its voxel.
    pub updated: Cloud,
    /// Their colours, as those of [`WholeMap::points`].
    pub updated_colours: Vec<[u8; 3]>,
    /// A place in each voxel whose point was removed: the listener's point of that voxel is to be removed. The
    /// listener may have none.
    pub removed: Cloud,
    /// More has changed than these say: listeners need the whole map.
    pub is_incomplete: bool,
}

/// A map that cannot be loaded.
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
    /// More blocks than there may be.
    #[error(
        "the map would have {blocks} blocks, and max_map_blocks is {max_map_blocks}: raise it, or set at_max_voxels to spill, with spill_folder; \
         the other values of at_max_voxels load no part of a map"
    )]
    TooManyBlocks {
        /// Of the points, at the map's edge.
        blocks: usize,
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
