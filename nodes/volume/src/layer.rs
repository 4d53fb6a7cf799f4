//! A layer: blocks of one kind, found by their keys.

use std::collections::HashMap;

use geometry::BuildVoxelHasher;

use crate::block::{BlockBox, BlockKey};

/// Blocks along the edge of a region; one word holds which of its 64 blocks exist.
const REGION_EDGE: i32 = 4;

/// A block's index in the layer's memory. It does not change until the block is removed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Slot(u32);

/// Blocks by key. `B` is the block, or a box that holds it.
#[derive(Clone, Debug)]
pub(crate) struct Layer<B> {
    /// Looked up by key only; no result depends on its order.
    index: HashMap<BlockKey, u32, BuildVoxelHasher>,
    slots: Vec<Option<(BlockKey, B)>>,
    vacant: Vec<u32>,
    /// Which blocks of a region exist. Looked up by key only.
    regions: HashMap<BlockKey, u64, BuildVoxelHasher>,
}

impl<B> Default for Layer<B> {
    fn default() -> Self {
        Self {
            index: HashMap::default(),
            slots: Vec::new(),
            vacant: Vec::new(),
            regions: HashMap::default(),
        }
    }
}

impl<B> Layer<B> {
    pub(crate) fn len(&self) -> usize {
        self.index.len()
    }

    pub(crate) fn slot(&self, key: BlockKey) -> Option<Slot> {
        self.index.get(&key).copied().map(Slot)
    }

    pub(crate) fn get(&self, key: BlockKey) -> Option<&B> {
        self.at(self.slot(key)?)
    }

    pub(crate) fn at(&self, slot: Slot) -> Option<&B> {
        self.slots.get(slot.0 as usize)?.as_ref().map(|(_, block)| block)
    }

    pub(crate) fn at_mut(&mut self, slot: Slot) -> Option<&mut B> {
        self.slots.get_mut(slot.0 as usize)?.as_mut().map(|(_, block)| block)
    }

    pub(crate) fn get_mut(&mut self, key: BlockKey) -> Option<&mut B> {
        let slot = self.slot(key)?;
        self.at_mut(slot)
    }

    /// Inserts a block, and returns the one that it replaces.
    pub(crate) fn insert(&mut self, key: BlockKey, block: B) -> Option<B> {
        if let Some(slot) = self.slot(key) {
            let place = self.slots.get_mut(slot.0 as usize)?;
            return place.replace((key, block)).map(|(_, before)| before);
        }
        let (region, bit) = region_of(key);
        *self.regions.entry(region).or_default() |= bit;
        if let Some(vacant) = self.vacant.pop()
            && let Some(place) = self.slots.get_mut(vacant as usize)
        {
            *place = Some((key, block));
            self.index.insert(key, vacant);
        } else {
            self.index.insert(key, self.slots.len() as u32);
            self.slots.push(Some((key, block)));
        }
        None
    }

    pub(crate) fn remove(&mut self, key: BlockKey) -> Option<B> {
        let slot = self.index.remove(&key)?;
        let (region, bit) = region_of(key);
        if let Some(bits) = self.regions.get_mut(&region) {
            *bits &= !bit;
            if *bits == 0 {
                self.regions.remove(&region);
            }
        }
        self.vacant.push(slot);
        self.slots.get_mut(slot as usize)?.take().map(|(_, block)| block)
    }

    /// All keys, ascending.
    pub(crate) fn sorted_keys(&self) -> Vec<BlockKey> {
        let mut keys: Vec<BlockKey> = self.index.keys().copied().collect();
        keys.sort_unstable();
        keys
    }

    /// The blocks in arbitrary order.
    pub(crate) fn unordered(&self) -> impl Iterator<Item = (BlockKey, &B)> {
        self.slots.iter().flatten().map(|(key, block)| (*key, block))
    }

    /// Calls `visit` with each block that exists within a cube of `2^level` blocks an axis, of which `least` is the
    /// least. In a fixed order.
    pub(crate) fn for_each_in_cube(
        &self,
        least: BlockKey,
        level: u32,
        visit: impl FnMut(BlockKey, Slot),
    ) {
        let beyond = (1_i32 << level.min(20)) - 1;
        self.for_each_in(BlockBox { least, most: least.offset(beyond, beyond, beyond) }, visit);
    }

    /// Calls `visit` with each block that exists within a box, in a fixed order. The time grows with the box.
    pub(crate) fn for_each_in(&self, within: BlockBox, mut visit: impl FnMut(BlockKey, Slot)) {
        let BlockBox { least, most } = within;
        let regions =
            |least: i32, most: i32| least.div_euclid(REGION_EDGE)..=most.div_euclid(REGION_EDGE);
        for region_z in regions(least.z, most.z) {
            for region_y in regions(least.y, most.y) {
                for region_x in regions(least.x, most.x) {
                    let region = BlockKey { x: region_x, y: region_y, z: region_z };
                    let mut bits = self.regions.get(&region).copied().unwrap_or_default();
                    while bits != 0 {
                        let key = block_of_bit(region, bits.trailing_zeros());
                        bits &= bits - 1;
                        let slot = within.contains(key).then(|| self.slot(key));
                        if let Some(slot) = slot.flatten() {
                            visit(key, slot);
                        }
                    }
                }
            }
        }
    }

    /// The memory of the tables, in bytes, without that of boxed blocks.
    pub(crate) fn table_bytes(&self) -> usize {
        // A hash table of the standard library is filled up to 7/8, and has one more byte for each entry.
        let table = |capacity: usize, entry: usize| (capacity * 8).div_ceil(7) * (entry + 1);
        table(self.index.capacity(), size_of::<(BlockKey, u32)>())
            + table(self.regions.capacity(), size_of::<(BlockKey, u64)>())
            + self.slots.capacity() * size_of::<Option<(BlockKey, B)>>()
            + self.vacant.capacity() * size_of::<u32>()
    }
}

fn region_of(key: BlockKey) -> (BlockKey, u64) {
    let [x, y, z] = key.coordinates().map(|along| along.rem_euclid(REGION_EDGE));
    let region = key.coordinates().map(|along| along.div_euclid(REGION_EDGE));
    (region.into(), 1 << ((z * REGION_EDGE + y) * REGION_EDGE + x))
}

fn block_of_bit(region: BlockKey, bit: u32) -> BlockKey {
    let bit = bit as i32;
    let within =
        [bit % REGION_EDGE, bit / REGION_EDGE % REGION_EDGE, bit / (REGION_EDGE * REGION_EDGE)];
    let along = |region: i32, within: i32| region * REGION_EDGE + within;
    BlockKey {
        x: along(region.x, within[0]),
        y: along(region.y, within[1]),
        z: along(region.z, within[2]),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// A layer behaves like a map under any insertions and removals.
        #[test]
        fn it_holds_what_a_plain_map_holds(
            steps in prop::collection::vec((any::<bool>(), -9..9, -9..9, -9..9, any::<u8>()), 0..80),
            cube in (-12..12, -12..12, -12..12, 0..4_u32),
        ) {
            let (mut layer, mut plain) = (Layer::default(), BTreeMap::new());
            for (insert, x, y, z, value) in steps {
                let key = BlockKey { x, y, z };
                if insert {
                    prop_assert_eq!(layer.insert(key, value), plain.insert(key, value));
                } else {
                    prop_assert_eq!(layer.remove(key), plain.remove(&key));
                }
            }
            prop_assert_eq!(layer.sorted_keys(), plain.keys().copied().collect::<Vec<_>>());
            prop_assert!(plain.iter().all(|(key, value)| layer.get(*key) == Some(value)));
            let (x, y, z, level) = cube;
            let mut found = Vec::new();
            layer.for_each_in_cube(BlockKey { x, y, z }, level, |key, _| found.push(key));
            found.sort_unstable();
            let within = |key: &BlockKey| {
                let inside = |along: i32, least: i32| (least..least + (1 << level)).contains(&along);
                inside(key.x, x) && inside(key.y, y) && inside(key.z, z)
            };
            prop_assert_eq!(found, plain.keys().copied().filter(within).collect::<Vec<_>>());
        }
    }
}
