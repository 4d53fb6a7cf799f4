//! Tiles: the cubes in which a map that is larger than its memory goes to a store and comes back.
//!
//! The core decides which tile goes and what its bytes are; where they go is the business of a [`TileStore`], which
//! the core gets as an input. The node's is a folder with a file a tile.
//!
//! # The bytes of a tile
//! Version 2. All numbers are little-endian.
//!
//! | bytes | what |
//! |---|---|
//! | 4 | `SMTL` |
//! | 2 | the version, 2 |
//! | 2 | the tile's edge in voxels |
//! | 8 | the voxel's edge in m, 64-bit float |
//! | 3 x 4 | the tile's key, signed: its voxels have keys from `key * edge` to `key * edge + edge - 1` an axis |
//! | | the content |
//! | 4 | CRC-32 (IEEE) of all before |
//!
//! The content:
//!
//! | bytes | what |
//! |---|---|
//! | 4 | the number of blocks |
//! | | the blocks, in ascending order of their keys |
//!
//! | bytes | what |
//! |---|---|
//! | 2 | the number of the bytes that follow |
//! | | a block: [`volume::Surface::block_bytes`] has the table |
//! | 2 | the number of the bytes that follow; 0 where changes are not followed |
//! | | what listeners know of its points: of each, the index of its voxel (2), its place in it in 255ths of the edge (3), and 1 where some know it elsewhere (1) |
//!
//! That is some 2.3 kB a block, as in memory, and exact.

mod counts;
mod file;
mod table;
#[cfg(test)]
pub(crate) mod testing;
mod tile_box;

use std::fmt;
use std::hash::{Hash, Hasher};

use geometry::VoxelKey;

pub use counts::SpillCounts;
pub(crate) use file::TileFrame;
pub(crate) use table::{InStore, Reached, TileTable};
pub(crate) use tile_box::TileBox;

/// A tile's place: a cube of voxels, counted as voxels are.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub struct TileKey {
    /// Along x.
    pub x: i32,
    /// Along y.
    pub y: i32,
    /// Along z.
    pub z: i32,
}

impl TileKey {
    /// The tile of a voxel, where a tile has `edge_voxels` an axis, at least 1.
    #[must_use]
    pub fn of(voxel: VoxelKey, edge_voxels: u16) -> Self {
        let edge = i32::from(edge_voxels.max(1));
        let along = |cell: i32| cell.div_euclid(edge);
        Self { x: along(voxel.x), y: along(voxel.y), z: along(voxel.z) }
    }
}

impl Hash for TileKey {
    fn hash<H: Hasher>(&self, state: &mut H) {
        VoxelKey { x: self.x, y: self.y, z: self.z }.hash(state);
    }
}

impl fmt::Display for TileKey {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "({}, {}, {})", self.x, self.y, self.z)
    }
}

/// Where tiles go, and come back from.
pub trait TileStore: fmt::Debug + Send + Sync {
    /// Keeps the bytes of a tile in the place of those it had.
    ///
    /// # Errors
    /// When they are not kept; [`TileStore::read`] then gives what there was before, or tells that it is missing.
    fn write(&mut self, tile: TileKey, bytes: &[u8]) -> Result<(), TileStoreError>;

    /// The bytes that were kept last.
    ///
    /// # Errors
    /// [`TileStoreError::Missing`] when there are none, [`TileStoreError::Failed`] when they cannot be had now.
    fn read(&self, tile: TileKey) -> Result<Vec<u8>, TileStoreError>;

    /// An empty store of the same kind, for the tiles of the map as it is after a correction. When all of them are there, it
    /// takes the place of this one, which is dropped and then has to leave nothing behind.
    ///
    /// # Errors
    /// When there is none to be had.
    fn another(&self) -> Result<Box<dyn TileStore>, TileStoreError>;

    /// Forgets every tile.
    ///
    /// # Errors
    /// When some may still be there, which does no harm: nobody asks for them any more.
    fn clear(&mut self) -> Result<(), TileStoreError>;
}

/// What a store could not do.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum TileStoreError {
    /// It has no such tile.
    #[error("it is not there")]
    Missing,
    /// It cannot at the moment: a full disk, too many open files.
    #[error("{reason}")]
    Failed {
        /// Why.
        reason: String,
    },
}

/// The bytes are not those of the tile.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum TileFormatError {
    /// They begin in another way.
    #[error("it does not begin with SMTL")]
    NotThisFormat,
    /// They are of a later version.
    #[error("it has the version {version}, and 2 is known")]
    OtherVersion {
        /// Of the bytes.
        version: u16,
    },
    /// They end too early.
    #[error("it is cut off")]
    CutOff,
    /// Some of them have changed.
    #[error("its checksum is wrong")]
    Checksum,
    /// They are of another tile, or of a map with other edges.
    #[error("it is of another tile, or of a map with other edges")]
    OtherTile,
    /// The checksum is right, and the content is none.
    #[error("its content is none of a tile")]
    Content,
}

/// What went wrong with a tile.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum TileError {
    /// It stays in memory, and points that would need its room are refused until it can be written.
    #[error("tile {tile} cannot be written: {source}")]
    Write {
        /// Which.
        tile: TileKey,
        /// Why.
        source: TileStoreError,
    },
    /// Where it is missing, the map has lost its voxels; otherwise points in it are refused until it can be read.
    #[error("tile {tile} cannot be read: {source}")]
    Read {
        /// Which.
        tile: TileKey,
        /// Why.
        source: TileStoreError,
    },
    /// The map has lost its voxels.
    #[error("tile {tile} is broken: {source}")]
    Broken {
        /// Which.
        tile: TileKey,
        /// Why.
        source: TileFormatError,
    },
    /// There is no store for the tiles of the map as it is after a correction, which waits.
    #[error("there is no room for the tiles of the corrected map: {source}")]
    Another {
        /// Why.
        source: TileStoreError,
    },
    /// What the store had before may take up room.
    #[error("the tiles of before cannot be removed: {source}")]
    Clear {
        /// Why.
        source: TileStoreError,
    },
}

impl TileError {
    /// The tile, if it is about one.
    #[must_use]
    pub fn tile(&self) -> Option<TileKey> {
        match self {
            Self::Write { tile, .. } | Self::Read { tile, .. } | Self::Broken { tile, .. } => {
                Some(*tile)
            }
            Self::Another { .. } | Self::Clear { .. } => None,
        }
    }

    /// Whether the tile's voxels are gone for good.
    #[must_use]
    pub fn is_loss(&self) -> bool {
        matches!(self, Self::Broken { .. } | Self::Read { source: TileStoreError::Missing, .. })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_counted_as_voxels_are() {
        let tile = |x, y, z| TileKey::of(VoxelKey { x, y, z }, 8);
        assert_eq!(tile(0, 7, 8), TileKey { x: 0, y: 0, z: 1 });
        assert_eq!(tile(-1, -8, -9), TileKey { x: -1, y: -1, z: -2 });
        assert_eq!(tile(-1, -8, -9).to_string(), "(-1, -1, -2)");
        assert_eq!(tile(i32::MIN, i32::MAX, 0).y, (1 << 28) - 1);
    }
}
