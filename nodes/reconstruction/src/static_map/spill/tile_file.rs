//! The voxels of a tile as bytes: [`crate::tiles`] has the table.

use geometry::{VoxelGrid, VoxelKey};

use super::super::anchor::Anchor;
use super::super::blocks::BLOCK_EDGE_VOXELS;
use super::super::changes::Told;
use super::super::evidence::Evidence;
use super::super::voxel::{Known, UNITS_PER_METRE, VoxelMean};
use crate::tiles::{TileFormatError, TileFrame, TileKey, TileReader, push_varint};

/// About what a voxel takes.
const VOXEL_BYTES: usize = 24;

/// How a map is cut into tiles.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(in super::super) struct TileLayout {
    /// A tile's edge, whole blocks.
    pub(in super::super) edge_voxels: u16,
    pub(in super::super) grid: VoxelGrid,
}

impl TileLayout {
    pub(in super::super) fn tile_of(&self, voxel: VoxelKey) -> TileKey {
        TileKey::of(voxel, self.edge_voxels)
    }

    fn frame(&self) -> TileFrame {
        TileFrame { edge_voxels: self.edge_voxels, edge_m: self.grid.edge_m() }
    }

    /// The keys of the tile's blocks.
    pub(super) fn blocks_of(&self, tile: TileKey) -> impl Iterator<Item = VoxelKey> + use<> {
        let blocks = i64::from(self.edge_voxels) / i64::from(BLOCK_EDGE_VOXELS);
        // Beyond the outermost voxel there is no block.
        let along = move |tile: i32| {
            let first = i64::from(tile) * blocks;
            (first..first + blocks).filter_map(|block| i32::try_from(block).ok())
        };
        along(tile.x).flat_map(move |x| {
            along(tile.y).flat_map(move |y| along(tile.z).map(move |z| VoxelKey { x, y, z }))
        })
    }

    /// The index of a voxel in its tile.
    fn index(&self, voxel: VoxelKey) -> u64 {
        let edge = i64::from(self.edge_voxels);
        let [x, y, z] =
            [voxel.x, voxel.y, voxel.z].map(|cell| i64::from(cell).rem_euclid(edge) as u64);
        (x * edge as u64 + y) * edge as u64 + z
    }

    fn voxel(&self, tile: TileKey, index: u64) -> Option<VoxelKey> {
        let edge = u64::from(self.edge_voxels);
        let along = |tile: i32, within: u64| {
            i32::try_from(i64::from(tile) * edge as i64 + within as i64).ok()
        };
        (index < edge.pow(3)).then_some(())?;
        Some(VoxelKey {
            x: along(tile.x, index / edge / edge)?,
            y: along(tile.y, index / edge % edge)?,
            z: along(tile.z, index % edge)?,
        })
    }

    /// The bytes of these voxels of the tile, which come by ascending key.
    pub(super) fn encode(&self, tile: TileKey, voxels: &[(VoxelKey, VoxelMean)]) -> Vec<u8> {
        let latest = voxels.iter().map(|(_, voxel)| voxel.last_cycle).max().unwrap_or(0);
        let newest = voxels.iter().map(|(_, voxel)| voxel.anchor).max().unwrap_or_default();
        self.frame().seal(tile, voxels.len() * VOXEL_BYTES, |bytes| {
            bytes.extend((voxels.len() as u32).to_le_bytes());
            bytes.extend(latest.to_le_bytes());
            bytes.extend(newest.ticks().to_le_bytes());
            let mut next = 0;
            for (key, voxel) in voxels {
                let index = self.index(*key);
                push_varint(bytes, u128::from(index.wrapping_sub(next)));
                next = index + 1;
                push_varint(bytes, u128::from(voxel.points()));
                push_varint(bytes, u128::from(latest - voxel.last_cycle));
                push_varint(bytes, u128::from(newest.ticks() - voxel.anchor.ticks()));
                bytes.extend(voxel.evidence.steps().to_le_bytes());
                voxel.told.push_to(bytes);
                let middles = self.middles(*key);
                for (sum, middle) in voxel.sum_units().into_iter().zip(middles) {
                    push_sum(
                        bytes,
                        sum.wrapping_sub(middle.wrapping_mul(i128::from(voxel.points()))),
                    );
                }
            }
        })
    }

    /// The voxels of the tile, by ascending key.
    pub(super) fn decode(
        &self,
        tile: TileKey,
        bytes: &[u8],
    ) -> Result<Vec<(VoxelKey, VoxelMean)>, TileFormatError> {
        let mut reader = self.frame().open(tile, bytes)?;
        let count = u32::from_le_bytes(reader.array()?) as usize;
        let latest = [u32::from_le_bytes(reader.array()?), u32::from_le_bytes(reader.array()?)];
        // Each voxel takes ten bytes at least: no number of theirs takes more memory than the bytes allow.
        let mut voxels = Vec::with_capacity(count.min(reader.left()));
        let mut next = 0_u64;
        for _ in 0..count {
            let (key, voxel) = self.decode_voxel(tile, &mut reader, &mut next, latest)?;
            voxels.push((key, voxel));
        }
        if reader.left() == 0 { Ok(voxels) } else { Err(TileFormatError::Content) }
    }

    fn decode_voxel(
        &self,
        tile: TileKey,
        reader: &mut TileReader<'_>,
        next: &mut u64,
        [latest, newest]: [u32; 2],
    ) -> Result<(VoxelKey, VoxelMean), TileFormatError> {
        let index = next.saturating_add(reader.number()?);
        let key = self.voxel(tile, index).ok_or(TileFormatError::Content)?;
        *next = index + 1;
        let points: u32 = reader.number()?;
        let before: u32 = reader.number()?;
        let last_cycle = latest.checked_sub(before).ok_or(TileFormatError::Content)?;
        let ticks = newest.checked_sub(reader.number()?).ok_or(TileFormatError::Content)?;
        let anchor = Anchor::of_ticks(ticks);
        let evidence = Evidence::of_steps(i8::from_le_bytes(reader.array()?));
        let [flags] = reader.array()?;
        let told = Told::read(flags, || reader.array().map(u16::from_le_bytes))?;
        let mut sum_units = self.middles(key);
        for sum in &mut sum_units {
            *sum = sum.wrapping_mul(i128::from(points)).wrapping_add(read_sum(reader)?);
        }
        let known = Known { last_cycle, told, evidence, anchor };
        Ok((key, VoxelMean::of(sum_units, points, known)))
    }

    /// The voxel's middle in the units of the sums, as far as a 32-bit number tells it: a difference to it has as
    /// many zeros at its lower end as the points have.
    fn middles(&self, voxel: VoxelKey) -> [i128; 3] {
        let middle = self.grid.middle_m(voxel);
        [middle.x, middle.y, middle.z]
            .map(|along_m| (f64::from(along_m as f32) * UNITS_PER_METRE) as i128)
    }
}

fn push_sum(bytes: &mut Vec<u8>, sum: i128) {
    let zeros = if sum == 0 { 0 } else { sum.trailing_zeros() };
    bytes.push(zeros as u8);
    let value = sum >> zeros;
    push_varint(bytes, (value << 1 ^ value >> 127) as u128);
}

fn read_sum(reader: &mut TileReader<'_>) -> Result<i128, TileFormatError> {
    let [zeros] = reader.array()?;
    let zigzag = reader.varint()?;
    let value = (zigzag >> 1) as i128 ^ -((zigzag & 1) as i128);
    if u32::from(zeros) >= u128::BITS {
        return Err(TileFormatError::Content);
    }
    Ok(value << zeros)
}
