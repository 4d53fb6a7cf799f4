//! The blocks of a tile as bytes: [`crate::tiles`] has the table.

use volume::{BlockKey, ChangeFollower, Surface};

use super::Spill;
use crate::tiles::{TileError, TileFormatError, TileKey};

/// About what a block takes: 512 nodes of 4 bytes, of which some are not known, and what listeners know of its points.
const BLOCK_BYTES: usize = 2_300;

/// What came with a block of a tile.
pub(super) struct Known {
    pub(super) key: BlockKey,
    /// What listeners know of its points: [`ChangeFollower::known_bytes`].
    pub(super) bytes: Vec<u8>,
}

impl Spill {
    /// The bytes of a tile with these blocks.
    pub(super) fn encode(
        &self,
        tile: TileKey,
        keys: &[BlockKey],
        surface: &Surface,
        follower: Option<&ChangeFollower>,
    ) -> Vec<u8> {
        self.frame.seal(tile, keys.len() * BLOCK_BYTES, |bytes| {
            bytes.extend((keys.len() as u32).to_le_bytes());
            let mut push = |part: &[u8]| {
                // 512 nodes of 7 bytes with their header, and 512 points of 6, are less than 65536.
                bytes.extend((part.len() as u16).to_le_bytes());
                bytes.extend(part);
            };
            for key in keys {
                push(&surface.block_bytes(*key).unwrap_or_default());
                push(&follower.map_or_else(Vec::new, |follower| follower.known_bytes(*key)));
            }
        })
    }

    /// Puts the blocks of a tile in the store, which stays there, into a surface that has none of them.
    ///
    /// # Errors
    /// When it cannot be read, or is broken; the surface is then as it was.
    pub(super) fn read_into(
        &self,
        tile: TileKey,
        surface: &mut Surface,
    ) -> Result<Vec<Known>, TileError> {
        let bytes = self.tiles.read(tile)?;
        let mut known = Vec::new();
        self.decode(tile, &bytes, surface, &mut known).map_err(|source| {
            for Known { key, .. } in &known {
                surface.remove_block(*key);
            }
            TileError::Broken { tile, source }
        })?;
        Ok(known)
    }

    fn decode(
        &self,
        tile: TileKey,
        bytes: &[u8],
        surface: &mut Surface,
        known: &mut Vec<Known>,
    ) -> Result<(), TileFormatError> {
        let mut reader = self.frame.open(tile, bytes)?;
        let count = u32::from_le_bytes(reader.array()?);
        let within = self.blocks_of(tile);
        for _ in 0..count {
            let mut part = || {
                let length = u16::from_le_bytes(reader.array()?);
                reader.slice(usize::from(length))
            };
            let (block, told) = (part()?, part()?);
            let key = surface.put_block(block).map_err(|_| TileFormatError::Content)?;
            known.push(Known { key, bytes: told.to_vec() });
            if !within.contains(key) {
                return Err(TileFormatError::Content);
            }
        }
        if reader.left() == 0 { Ok(()) } else { Err(TileFormatError::Content) }
    }
}
