//! Blocks: cubes of voxels that are stored, looked up and classified together.

use std::hash::{Hash, Hasher};
use std::ops::Range;

use geometry::VoxelKey;

/// Voxels along a block's edge. Eight 32-bit numbers fill a register of AVX2, so that a row of a block is one
/// operation; a block of 16 voxels would hold four times the voxels that are not near the surface.
pub const BLOCK_EDGE: usize = 8;
/// Voxels of a block.
pub const BLOCK_VOXELS: usize = BLOCK_EDGE * BLOCK_EDGE * BLOCK_EDGE;

const EDGE: i32 = BLOCK_EDGE as i32;

/// A block's place: its voxels have keys from `8 * key` to `8 * key + 7` along each axis.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub struct BlockKey {
    /// Along x.
    pub x: i32,
    /// Along y.
    pub y: i32,
    /// Along z.
    pub z: i32,
}

impl BlockKey {
    /// The block of a voxel.
    #[must_use]
    #[inline]
    pub fn of(voxel: VoxelKey) -> Self {
        let along = |cell: i32| cell.div_euclid(EDGE);
        Self { x: along(voxel.x), y: along(voxel.y), z: along(voxel.z) }
    }

    /// The voxel of an index within the block; see [`voxel_index`].
    #[must_use]
    #[inline]
    pub fn voxel(self, index: usize) -> VoxelKey {
        let along = |block: i32, within: usize| {
            block.saturating_mul(EDGE).saturating_add((within % BLOCK_EDGE) as i32)
        };
        VoxelKey {
            x: along(self.x, index),
            y: along(self.y, index / BLOCK_EDGE),
            z: along(self.z, index / (BLOCK_EDGE * BLOCK_EDGE)),
        }
    }

    /// The indices along x, y and z, within the block, of its voxels between two. It holds some of these.
    #[inline]
    pub(crate) fn indices_between(self, least: VoxelKey, most: VoxelKey) -> [Range<usize>; 3] {
        let along = |block: i32, least: i32, most: i32| {
            let first = block.saturating_mul(EDGE);
            let within = |cell: i32| cell.saturating_sub(first).clamp(0, EDGE - 1) as usize;
            within(least)..within(most) + 1
        };
        [
            along(self.x, least.x, most.x),
            along(self.y, least.y, most.y),
            along(self.z, least.z, most.z),
        ]
    }

    /// The block at this offset in blocks.
    #[must_use]
    #[inline]
    pub fn offset(self, x: i32, y: i32, z: i32) -> Self {
        Self {
            x: self.x.saturating_add(x),
            y: self.y.saturating_add(y),
            z: self.z.saturating_add(z),
        }
    }

    /// Its coordinates.
    #[must_use]
    #[inline]
    pub fn coordinates(self) -> [i32; 3] {
        [self.x, self.y, self.z]
    }
}

impl From<[i32; 3]> for BlockKey {
    fn from([x, y, z]: [i32; 3]) -> Self {
        Self { x, y, z }
    }
}

/// All blocks between two, these included.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct BlockBox {
    /// The least block along each axis.
    pub least: BlockKey,
    /// The greatest block along each axis.
    pub most: BlockKey,
}

impl BlockBox {
    /// Every block.
    pub const ALL: Self = Self {
        least: BlockKey { x: i32::MIN, y: i32::MIN, z: i32::MIN },
        most: BlockKey { x: i32::MAX, y: i32::MAX, z: i32::MAX },
    };

    /// Whether a block is in it.
    #[must_use]
    #[inline]
    pub fn contains(&self, key: BlockKey) -> bool {
        let Self { least, most } = self;
        (least.x..=most.x).contains(&key.x)
            && (least.y..=most.y).contains(&key.y)
            && (least.z..=most.z).contains(&key.z)
    }

    /// The intersection of both; it is empty if `least` is beyond `most`.
    #[must_use]
    pub fn intersection(&self, other: &Self) -> Self {
        let (a, b) = (self, other);
        let [x, y, z] = [0, 1, 2].map(|axis: usize| {
            let least = a.least.coordinates()[axis].max(b.least.coordinates()[axis]);
            (least, a.most.coordinates()[axis].min(b.most.coordinates()[axis]))
        });
        Self { least: [x.0, y.0, z.0].into(), most: [x.1, y.1, z.1].into() }
    }

    /// The number of block positions in it.
    #[must_use]
    pub fn blocks(&self) -> u64 {
        let along = self.least.coordinates().into_iter().zip(self.most.coordinates());
        let along = along.map(|(least, most)| i64::from(most) - i64::from(least) + 1);
        along.fold(1, |blocks: u64, along| blocks.saturating_mul(along.max(0) as u64))
    }

    /// The blocks in it.
    pub fn keys(&self) -> impl Iterator<Item = BlockKey> + use<> {
        let Self { least, most } = *self;
        (least.x..=most.x).flat_map(move |x| {
            (least.y..=most.y)
                .flat_map(move |y| (least.z..=most.z).map(move |z| BlockKey { x, y, z }))
        })
    }

    /// The box, larger by this many blocks on each side.
    #[must_use]
    pub fn grown(&self, blocks: i32) -> Self {
        Self {
            least: self.least.offset(-blocks, -blocks, -blocks),
            most: self.most.offset(blocks, blocks, blocks),
        }
    }
}

impl Hash for BlockKey {
    #[inline]
    fn hash<H: Hasher>(&self, state: &mut H) {
        VoxelKey { x: self.x, y: self.y, z: self.z }.hash(state);
    }
}

/// The index of a voxel within its block: x runs fastest, then y, then z.
#[must_use]
#[inline]
pub fn voxel_index(voxel: VoxelKey) -> usize {
    let within = |cell: i32| cell.rem_euclid(EDGE) as usize;
    (within(voxel.z) * BLOCK_EDGE + within(voxel.y)) * BLOCK_EDGE + within(voxel.x)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_voxel_is_found_again_by_its_block_and_index(
            x in -1_000_000..1_000_000, y in -1_000_000..1_000_000, z in -1_000_000..1_000_000,
        ) {
            let voxel = VoxelKey { x, y, z };
            prop_assert!(voxel_index(voxel) < BLOCK_VOXELS);
            prop_assert_eq!(BlockKey::of(voxel).voxel(voxel_index(voxel)), voxel);
        }
    }
}
