//! The bytes of a tile: [`crate::tiles`] has the table.

use geometry::{VoxelGrid, VoxelKey};

use super::super::anchor::Anchor;
use super::super::blocks::BLOCK_EDGE_VOXELS;
use super::super::changes::Told;
use super::super::evidence::Evidence;
use super::super::voxel::{Known, UNITS_PER_METRE, VoxelMean};
use crate::tiles::{TileFormatError, TileKey};

const MAGIC: &[u8; 4] = b"SMTL";
const VERSION: u16 = 2;
/// Everything before the voxels.
const HEADER_BYTES: usize = 40;
const CHECKSUM_BYTES: usize = 4;
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
        let mut bytes =
            Vec::with_capacity(HEADER_BYTES + voxels.len() * VOXEL_BYTES + CHECKSUM_BYTES);
        bytes.extend(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend(self.edge_voxels.to_le_bytes());
        bytes.extend(self.grid.edge_m().to_le_bytes());
        for along in [tile.x, tile.y, tile.z] {
            bytes.extend(along.to_le_bytes());
        }
        bytes.extend((voxels.len() as u32).to_le_bytes());
        bytes.extend(latest.to_le_bytes());
        bytes.extend(newest.ticks().to_le_bytes());
        let mut next = 0;
        for (key, voxel) in voxels {
            let index = self.index(*key);
            push_varint(&mut bytes, u128::from(index.wrapping_sub(next)));
            next = index + 1;
            push_varint(&mut bytes, u128::from(voxel.points()));
            push_varint(&mut bytes, u128::from(latest - voxel.last_cycle));
            push_varint(&mut bytes, u128::from(newest.ticks() - voxel.anchor.ticks()));
            bytes.extend(voxel.evidence.steps().to_le_bytes());
            voxel.told.push_to(&mut bytes);
            let middles = self.middles(*key);
            for (sum, middle) in voxel.sum_units().into_iter().zip(middles) {
                push_sum(
                    &mut bytes,
                    sum.wrapping_sub(middle.wrapping_mul(i128::from(voxel.points()))),
                );
            }
        }
        let checksum = crc32fast::hash(&bytes);
        bytes.extend(checksum.to_le_bytes());
        bytes
    }

    /// The voxels of the tile, by ascending key.
    pub(super) fn decode(
        &self,
        tile: TileKey,
        bytes: &[u8],
    ) -> Result<Vec<(VoxelKey, VoxelMean)>, TileFormatError> {
        let (bytes, checksum) =
            bytes.split_last_chunk::<CHECKSUM_BYTES>().ok_or(TileFormatError::CutOff)?;
        let mut reader = Reader { bytes };
        if reader.array()? != *MAGIC {
            return Err(TileFormatError::NotThisFormat);
        }
        let version = u16::from_le_bytes(reader.array()?);
        if version != VERSION {
            return Err(TileFormatError::OtherVersion { version });
        }
        if crc32fast::hash(bytes) != u32::from_le_bytes(*checksum) {
            return Err(TileFormatError::Checksum);
        }
        let edge_voxels = u16::from_le_bytes(reader.array()?);
        let edge_m = f64::from_le_bytes(reader.array()?);
        let mut along = || Ok(i32::from_le_bytes(reader.array()?));
        let key = TileKey { x: along()?, y: along()?, z: along()? };
        if (edge_voxels, key) != (self.edge_voxels, tile)
            || edge_m.to_bits() != self.grid.edge_m().to_bits()
        {
            return Err(TileFormatError::OtherTile);
        }
        let count = u32::from_le_bytes(reader.array()?) as usize;
        let latest = [u32::from_le_bytes(reader.array()?), u32::from_le_bytes(reader.array()?)];
        // Each voxel takes ten bytes at least: no number of theirs takes more memory than the bytes allow.
        let mut voxels = Vec::with_capacity(count.min(bytes.len()));
        let mut next = 0_u64;
        for _ in 0..count {
            let (key, voxel) = self.decode_voxel(tile, &mut reader, &mut next, latest)?;
            voxels.push((key, voxel));
        }
        if reader.bytes.is_empty() { Ok(voxels) } else { Err(TileFormatError::Voxels) }
    }

    fn decode_voxel(
        &self,
        tile: TileKey,
        reader: &mut Reader<'_>,
        next: &mut u64,
        [latest, newest]: [u32; 2],
    ) -> Result<(VoxelKey, VoxelMean), TileFormatError> {
        let index = next.saturating_add(reader.number()?);
        let key = self.voxel(tile, index).ok_or(TileFormatError::Voxels)?;
        *next = index + 1;
        let points: u32 = reader.number()?;
        let before: u32 = reader.number()?;
        let last_cycle = latest.checked_sub(before).ok_or(TileFormatError::Voxels)?;
        let ticks = newest.checked_sub(reader.number()?).ok_or(TileFormatError::Voxels)?;
        let anchor = Anchor::of_ticks(ticks);
        let evidence = Evidence::of_steps(i8::from_le_bytes(reader.array()?));
        let [flags] = reader.array()?;
        let told = Told::read(flags, || reader.array().map(u16::from_le_bytes))?;
        let mut sum_units = self.middles(key);
        for sum in &mut sum_units {
            *sum = sum.wrapping_mul(i128::from(points)).wrapping_add(reader.sum()?);
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

fn push_varint(bytes: &mut Vec<u8>, mut value: u128) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

fn push_sum(bytes: &mut Vec<u8>, sum: i128) {
    let zeros = if sum == 0 { 0 } else { sum.trailing_zeros() };
    bytes.push(zeros as u8);
    let value = sum >> zeros;
    push_varint(bytes, (value << 1 ^ value >> 127) as u128);
}

struct Reader<'a> {
    bytes: &'a [u8],
}

impl Reader<'_> {
    fn array<const N: usize>(&mut self) -> Result<[u8; N], TileFormatError> {
        let (array, rest) = self.bytes.split_first_chunk().ok_or(TileFormatError::CutOff)?;
        self.bytes = rest;
        Ok(*array)
    }

    fn varint(&mut self) -> Result<u128, TileFormatError> {
        let mut value = 0_u128;
        for shift in (0..u128::BITS).step_by(7) {
            let [byte] = self.array()?;
            value |= u128::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(TileFormatError::Voxels)
    }

    fn number<N: TryFrom<u128>>(&mut self) -> Result<N, TileFormatError> {
        N::try_from(self.varint()?).map_err(|_| TileFormatError::Voxels)
    }

    fn sum(&mut self) -> Result<i128, TileFormatError> {
        let [zeros] = self.array()?;
        let zigzag = self.varint()?;
        let value = (zigzag >> 1) as i128 ^ -((zigzag & 1) as i128);
        if u32::from(zeros) >= u128::BITS {
            return Err(TileFormatError::Voxels);
        }
        Ok(value << zeros)
    }
}
