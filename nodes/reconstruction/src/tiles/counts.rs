//! What became of the tiles, in numbers.

use serde::Serialize;

/// What has become of the tiles of a map that spills.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub struct SpillCounts {
    /// Tiles in memory now.
    pub tiles_in_memory: usize,
    /// Tiles in the store now.
    pub tiles_in_store: usize,
    /// Voxels of these; of a map of depth images about: [`crate::SurfaceMap::len`].
    pub voxels_in_store: usize,
    /// Tiles written since the map was made.
    pub written: u64,
    /// Tiles read back.
    pub read: u64,
    /// Tiles that were missing or broken, with all their voxels.
    pub lost: u64,
    /// How often writing began to fail, or a tile could not be read for now that could before: as long as the same
    /// failure lasts it counts once.
    pub failed: u64,
}
