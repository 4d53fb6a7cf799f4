//! Blocks as bytes, and back: for files, and for a store of what does not fit into memory.
//!
//! All numbers are little-endian.
//!
//! | bytes | what |
//! |---|---|
//! | 4 | `SMVB` |
//! | 2 | the version, 3 |
//! | 1 | 1 where there are colours |
//! | 1 | the evidence, signed: log-odds in steps of 0.05 |
//! | 8, 8 | the edge in m, and the truncation in edges, 64-bit floats |
//! | 3 x 4 | the block's key |
//! | 8, 8, 8 | when it was seen first, changed last and hit last, in ns; the least number where it never was |
//! | 3 x 4 | where the camera was then, in m, 32-bit floats |
//! | 3 x 4 | where its middle was in the camera's frame, if always in the same place; otherwise infinite |
//! | 64 | a bit for each node that is known, x first, then y, then z |
//! | | of each of these: the distance in 32767ths of the truncation (2, signed), the weight (2), red, green and blue (3) |

use geometry::Stamp;

use super::Surface;
use super::block::SurfaceBlock;
use crate::block::{BLOCK_VOXELS, BlockBox, BlockKey};
use crate::evidence::Evidence;

const MAGIC: &[u8; 4] = b"SMVB";
const VERSION: u16 = 3;
/// In the place of a moment where there was none.
const NEVER: i64 = i64::MIN;

/// Bytes are not those of a block of this surface.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum BlockFormatError {
    /// They begin in another way.
    #[error("it does not begin with SMVB")]
    NotThisFormat,
    /// They are of another version.
    #[error("it has the version {version}, and {VERSION} is known")]
    OtherVersion {
        /// Of the bytes.
        version: u16,
    },
    /// They are too few, or too many.
    #[error("its length is not that of its nodes")]
    Length,
    /// They are of a surface with other voxels.
    #[error(
        "its voxels have {edge_m} m and distances cut at {in_edges} edges: other ones than this surface"
    )]
    OtherVoxels {
        /// The edge of the voxels.
        edge_m: f64,
        /// The truncation.
        in_edges: f64,
    },
    /// There is no room for it.
    #[error("the surface has {max_blocks} blocks, and may not have more")]
    Full {
        /// The bound.
        max_blocks: usize,
    },
}

/// Takes what comes next from the bytes.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn next<const N: usize>(&mut self) -> Result<[u8; N], BlockFormatError> {
        let (next, rest) = self.0.split_first_chunk().ok_or(BlockFormatError::Length)?;
        self.0 = rest;
        Ok(*next)
    }

    fn place_m(&mut self) -> Result<[f32; 3], BlockFormatError> {
        let mut along = || self.next().map(f32::from_le_bytes);
        Ok([along()?, along()?, along()?])
    }
}

impl Surface {
    /// A block as bytes; `None` where there is none.
    #[must_use]
    pub fn block_bytes(&self, key: BlockKey) -> Option<Vec<u8>> {
        let block = self.block(key)?;
        let known = |index: &usize| block.weight.get(*index).is_some_and(|weight| *weight > 0);
        let moment = |tick| self.ticks.stamp(tick).map_or(NEVER, Stamp::as_nanos).to_le_bytes();
        let mut bytes = Vec::new();
        bytes.extend(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        bytes.push(u8::from(block.colour.is_some()));
        bytes.extend(block.evidence.steps().to_le_bytes());
        bytes.extend(self.config.edge_m.to_le_bytes());
        bytes.extend(self.config.truncation_in_edges.to_le_bytes());
        bytes.extend(key.coordinates().into_iter().flat_map(i32::to_le_bytes));
        bytes.extend(moment(block.first_seen));
        bytes.extend(moment(block.last_seen));
        bytes.extend(moment(block.last_hit));
        let seen_at_m = block.seen_at_m.unwrap_or([f32::INFINITY; 3]);
        bytes.extend(block.hit_from_m.into_iter().chain(seen_at_m).flat_map(f32::to_le_bytes));
        for first in (0..BLOCK_VOXELS).step_by(8) {
            bytes.push((0..8).fold(0, |bits, bit| bits | u8::from(known(&(first + bit))) << bit));
        }
        for index in (0..BLOCK_VOXELS).filter(known) {
            bytes.extend(block.distance[index].to_le_bytes());
            bytes.extend(block.weight[index].to_le_bytes());
            if let Some(colour) = &block.colour {
                bytes.extend(colour[index]);
            }
        }
        Some(bytes)
    }

    /// Puts a block in the place of what is there. Returns where.
    ///
    /// # Errors
    /// When the bytes are none of a block of this surface, or there is no room.
    pub fn put_block(&mut self, bytes: &[u8]) -> Result<BlockKey, BlockFormatError> {
        let mut reader = Reader(bytes);
        if reader.next() != Ok(*MAGIC) {
            return Err(BlockFormatError::NotThisFormat);
        }
        let version = u16::from_le_bytes(reader.next()?);
        if version != VERSION {
            return Err(BlockFormatError::OtherVersion { version });
        }
        let [has_colour, evidence] = reader.next()?;
        let (edge_m, in_edges) =
            (f64::from_le_bytes(reader.next()?), f64::from_le_bytes(reader.next()?));
        if (edge_m, in_edges) != (self.config.edge_m, self.config.truncation_in_edges) {
            return Err(BlockFormatError::OtherVoxels { edge_m, in_edges });
        }
        let mut along = || reader.next().map(i32::from_le_bytes);
        let key = BlockKey { x: along()?, y: along()?, z: along()? };
        let ticks = &mut self.ticks;
        let mut tick = || {
            let moment = i64::from_le_bytes(reader.next()?);
            Ok(if moment == NEVER { 0 } else { ticks.at(Stamp::from_nanos(moment)) })
        };
        let mut block = Box::new(SurfaceBlock {
            evidence: Evidence::of_steps(evidence as i8),
            first_seen: tick()?,
            last_seen: tick()?,
            last_hit: tick()?,
            hit_from_m: reader.place_m()?,
            seen_at_m: {
                let seen_at_m = reader.place_m()?;
                seen_at_m.iter().all(|along_m| along_m.is_finite()).then_some(seen_at_m)
            },
            colour: (has_colour == 1).then(|| Box::new([[0; 3]; BLOCK_VOXELS])),
            ..SurfaceBlock::default()
        });
        let known: [u8; BLOCK_VOXELS / 8] = reader.next()?;
        for index in (0..BLOCK_VOXELS).filter(|index| known[index / 8] >> (index % 8) & 1 == 1) {
            block.distance[index] = i16::from_le_bytes(reader.next()?);
            block.weight[index] = u16::from_le_bytes(reader.next()?);
            if let Some(colour) = &mut block.colour {
                colour[index] = reader.next()?;
            }
        }
        if !reader.0.is_empty() {
            return Err(BlockFormatError::Length);
        }
        let max_blocks = self.config.max_blocks;
        if self.layer.get(key).is_none() && self.layer.len() >= max_blocks {
            return Err(BlockFormatError::Full { max_blocks });
        }
        self.count_near(&mut block);
        if let Some(before) = self.layer.insert(key, Some(block)).flatten() {
            self.near_nodes -= usize::from(before.near_nodes);
        }
        Ok(key)
    }

    /// Removes a block. Returns whether there was one.
    pub fn remove_block(&mut self, key: BlockKey) -> bool {
        let removed = self.layer.remove(key);
        let near_nodes = removed.iter().flatten().map(|block| usize::from(block.near_nodes));
        self.near_nodes -= near_nodes.sum::<usize>();
        removed.is_some()
    }

    /// The blocks within a box, which it costs by, ascending.
    #[must_use]
    pub fn blocks_in(&self, within: BlockBox) -> Vec<BlockKey> {
        let mut keys = Vec::new();
        self.layer.for_each_in(within, |key, _| keys.push(key));
        keys.sort_unstable();
        keys
    }

    /// The blocks that were seen longest ago, at most so many, the oldest first.
    #[must_use]
    pub fn oldest_blocks(&self, most: usize) -> Vec<BlockKey> {
        let blocks = self.layer.unordered();
        let mut blocks: Vec<(u32, BlockKey)> =
            blocks.filter_map(|(key, block)| Some((block.as_ref()?.last_seen, key))).collect();
        blocks.sort_unstable();
        blocks.into_iter().take(most).map(|(_, key)| key).collect()
    }
}
