//! A box of tiles: their keys are counted and listed as those of a box of blocks are.

use volume::{BlockBox, BlockKey};

use super::TileKey;

/// The tiles between two along each axis, these included.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileBox(BlockBox);

impl TileBox {
    pub(crate) fn between(least: TileKey, most: TileKey) -> Self {
        Self(BlockBox { least: place_of(least), most: place_of(most) })
    }

    /// The number of their places.
    pub(crate) fn places(self) -> u64 {
        self.0.blocks()
    }

    pub(crate) fn contains(self, tile: TileKey) -> bool {
        self.0.contains(place_of(tile))
    }

    /// Their keys, ascending.
    pub(crate) fn keys(self) -> impl Iterator<Item = TileKey> + use<> {
        self.0.keys().map(|BlockKey { x, y, z }| TileKey { x, y, z })
    }
}

fn place_of(TileKey { x, y, z }: TileKey) -> BlockKey {
    BlockKey { x, y, z }
}
