//! Tiles of blocks go to a store when the memory is full, and come back before an image that can change them: the map is
//! that of unbounded memory, to the last bit, as long as the store gives back what it was given and what one image can
//! change has room. [`TileTable`] has the rules.
//!
//! Points lie between the nodes of a block and those of the next ones. So the tiles beside those that the image can
//! change come back as well: whatever listeners are told of is told by all that is known.

mod looked_at;
mod tile_file;
mod traffic;

use geometry::VoxelKey;
use volume::{BLOCK_EDGE, BlockBox, BlockKey};

use crate::tiles::{TileBox, TileError, TileFrame, TileKey, TileStore, TileTable};
pub(super) use looked_at::LookedAt;

/// The tiles of a map, in memory and out of it.
#[derive(Debug)]
pub(super) struct Spill {
    frame: TileFrame,
    pub(super) tiles: TileTable,
}

impl Spill {
    pub(super) fn new(frame: TileFrame, store: Box<dyn TileStore>) -> Self {
        Self { frame, tiles: TileTable::new(store) }
    }

    /// The tiles of the same map as it is after a correction, in another store: none yet.
    ///
    /// # Errors
    /// When there is no other store.
    pub(super) fn another(&self) -> Result<Self, TileError> {
        Ok(Self { frame: self.frame, tiles: self.tiles.another()? })
    }

    fn edge_blocks(&self) -> u16 {
        self.frame.edge_voxels / BLOCK_EDGE as u16
    }

    /// The tile of a block.
    pub(super) fn tile_of(&self, key: BlockKey) -> TileKey {
        let BlockKey { x, y, z } = key;
        TileKey::of(VoxelKey { x, y, z }, self.edge_blocks())
    }

    /// The blocks of a tile.
    pub(super) fn blocks_of(&self, tile: TileKey) -> BlockBox {
        let edge = i32::from(self.edge_blocks());
        let [x, y, z] = [tile.x, tile.y, tile.z].map(|along| along.saturating_mul(edge));
        let least = BlockKey { x, y, z };
        BlockBox { least, most: least.offset(edge - 1, edge - 1, edge - 1) }
    }

    fn tile_box(&self, blocks: BlockBox) -> TileBox {
        TileBox::between(self.tile_of(blocks.least), self.tile_of(blocks.most))
    }

    /// The tiles of the blocks of a box, known or not, by ascending key.
    pub(super) fn tiles_of(&self, blocks: BlockBox) -> impl Iterator<Item = TileKey> + use<> {
        self.tile_box(blocks).keys()
    }

    /// The tiles between whose nodes the points of a tile lie, itself included.
    pub(super) fn with_next(&self, tile: TileKey) -> impl Iterator<Item = TileKey> + use<> {
        let BlockBox { least, most } = self.blocks_of(tile);
        self.tiles_of(BlockBox { least, most: most.offset(1, 1, 1) })
    }

    /// A tile and those on all sides.
    pub(super) fn with_all_around(&self, tile: TileKey) -> impl Iterator<Item = TileKey> + use<> {
        self.tiles_of(self.blocks_of(tile).grown(1))
    }
}
