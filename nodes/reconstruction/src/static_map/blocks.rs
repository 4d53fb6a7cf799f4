//! Which voxels are occupied, as a bit each: what a ray looks at on its way.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use geometry::{BuildVoxelHasher, VoxelKey};

/// A block is a cube of 4 voxels an axis: 64 of them, a bit each of one number.
const SHIFT: i32 = 2;
/// Its edge.
pub(crate) const BLOCK_EDGE_VOXELS: u16 = 1 << SHIFT;
const WITHIN: i32 = (1 << SHIFT) - 1;

/// The block of a voxel.
pub(super) fn block_of(key: VoxelKey) -> VoxelKey {
    VoxelKey { x: key.x >> SHIFT, y: key.y >> SHIFT, z: key.z >> SHIFT }
}

/// One of the voxels of a block.
pub(super) fn a_voxel_of(block: VoxelKey) -> VoxelKey {
    VoxelKey { x: block.x << SHIFT, y: block.y << SHIFT, z: block.z << SHIFT }
}

/// The bit of a voxel in its block.
pub(super) fn bit_of(key: VoxelKey) -> u64 {
    1 << ((key.x & WITHIN) | (key.y & WITHIN) << SHIFT | (key.z & WITHIN) << (2 * SHIFT))
}

/// The occupied voxels. Most of a ray's way is through blocks without any, and costs a look-up for four steps or
/// so, in a table that is a tenth as large as that of the voxels.
#[derive(Clone, Debug, Default)]
pub(super) struct Blocks {
    /// Looked up by key alone. No block in it is empty.
    blocks: HashMap<VoxelKey, u64, BuildVoxelHasher>,
}

impl Blocks {
    pub(super) fn insert(&mut self, key: VoxelKey) {
        *self.blocks.entry(block_of(key)).or_default() |= bit_of(key);
    }

    pub(super) fn remove(&mut self, key: VoxelKey) {
        if let Entry::Occupied(mut block) = self.blocks.entry(block_of(key)) {
            *block.get_mut() &= !bit_of(key);
            if *block.get() == 0 {
                block.remove();
            }
        }
    }

    /// The bits of a block's voxels.
    pub(super) fn bits(&self, block: VoxelKey) -> u64 {
        self.blocks.get(&block).copied().unwrap_or_default()
    }

    /// The voxels of a block.
    pub(super) fn voxels_of(&self, block: VoxelKey) -> impl Iterator<Item = VoxelKey> + use<> {
        let mut bits = self.bits(block);
        std::iter::from_fn(move || {
            let bit = bits.trailing_zeros() as i32;
            bits &= bits.checked_sub(1)?;
            Some(VoxelKey {
                x: block.x << SHIFT | bit & WITHIN,
                y: block.y << SHIFT | bit >> SHIFT & WITHIN,
                z: block.z << SHIFT | bit >> (2 * SHIFT),
            })
        })
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.blocks.capacity() * (size_of::<(VoxelKey, u64)>() + 1)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn it_is_a_set_of_voxels(
            steps in prop::collection::vec((any::<bool>(), prop::array::uniform3(-5..5_i32)), 0..300),
        ) {
            let (mut blocks, mut set) = (Blocks::default(), BTreeSet::new());
            for (is_in, [x, y, z]) in steps {
                let key = VoxelKey { x, y, z };
                if is_in {
                    blocks.insert(key);
                    set.insert(key);
                } else {
                    blocks.remove(key);
                    set.remove(&key);
                }
            }
            let range = || -6..6;
            for key in range().flat_map(|x| range().flat_map(move |y| range().map(move |z| VoxelKey { x, y, z }))) {
                prop_assert_eq!(blocks.bits(block_of(key)) & bit_of(key) != 0, set.contains(&key));
            }
            prop_assert!(blocks.blocks.values().all(|bits| *bits != 0));
            let all: BTreeSet<_> =
                blocks.blocks.keys().flat_map(|block| blocks.voxels_of(*block)).collect();
            prop_assert_eq!(all, set);
        }
    }
}
