//! The voxels in the order in which they were seen last: who makes room when the map is full.

use std::collections::HashMap;

use geometry::{BuildVoxelHasher, VoxelKey};

/// The ends of the list link here.
const NONE: u32 = u32::MAX;

#[derive(Clone, Copy, Debug)]
struct Link {
    key: VoxelKey,
    older: u32,
    newer: u32,
}

/// A list of voxels, doubly linked through a table, so that each step takes a constant time. A map of more than
/// 2^32 - 1 voxels has no memory.
#[derive(Clone, Debug)]
pub(super) struct SeenOrder {
    links: Vec<Link>,
    free: Vec<u32>,
    /// Looked up by key alone.
    places: HashMap<VoxelKey, u32, BuildVoxelHasher>,
    oldest: u32,
    newest: u32,
}

impl Default for SeenOrder {
    fn default() -> Self {
        Self {
            links: Vec::new(),
            free: Vec::new(),
            places: HashMap::default(),
            oldest: NONE,
            newest: NONE,
        }
    }
}

impl SeenOrder {
    /// The voxel, known or not, was seen now.
    pub(super) fn saw(&mut self, key: VoxelKey) {
        let place = match self.places.get(&key) {
            Some(place) if *place == self.newest => return,
            Some(place) => {
                let place = *place;
                self.unlink(place);
                place
            }
            None => self.new_place(key),
        };
        self.link_as_newest(place);
    }

    /// The voxel is not there any more.
    pub(super) fn forget(&mut self, key: VoxelKey) {
        if let Some(place) = self.places.remove(&key) {
            self.unlink(place);
            self.free.push(place);
        }
    }

    /// The voxel that was seen longest ago.
    pub(super) fn oldest(&self) -> Option<VoxelKey> {
        self.link(self.oldest).map(|link| link.key)
    }

    /// All voxels, those first that were seen longest ago.
    pub(super) fn by_age(&self) -> impl Iterator<Item = VoxelKey> {
        let first = self.link(self.oldest);
        let links = std::iter::successors(first, |link| self.link(link.newer));
        links.map(|link| link.key)
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.links.capacity() * size_of::<Link>()
            + self.free.capacity() * size_of::<u32>()
            + self.places.capacity() * (size_of::<(VoxelKey, u32)>() + 1)
    }

    fn link(&self, place: u32) -> Option<Link> {
        self.links.get(place as usize).copied()
    }

    fn new_place(&mut self, key: VoxelKey) -> u32 {
        let link = Link { key, older: NONE, newer: NONE };
        let place = self.free.pop().unwrap_or(self.links.len() as u32);
        match self.links.get_mut(place as usize) {
            Some(free) => *free = link,
            None => self.links.push(link),
        }
        self.places.insert(key, place);
        place
    }

    fn set_newer(&mut self, place: u32, newer: u32) {
        match self.links.get_mut(place as usize) {
            Some(link) => link.newer = newer,
            None => self.oldest = newer,
        }
    }

    fn set_older(&mut self, place: u32, older: u32) {
        match self.links.get_mut(place as usize) {
            Some(link) => link.older = older,
            None => self.newest = older,
        }
    }

    fn unlink(&mut self, place: u32) {
        if let Some(Link { older, newer, .. }) = self.link(place) {
            self.set_newer(older, newer);
            self.set_older(newer, older);
        }
    }

    fn link_as_newest(&mut self, place: u32) {
        let before = self.newest;
        self.set_newer(before, place);
        self.set_newer(place, NONE);
        self.set_older(place, before);
        self.newest = place;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Against a plain list.
        #[test]
        fn it_is_a_list_by_the_time_of_the_last_sight(
            steps in prop::collection::vec((0..3_u8, 0..12_i32), 0..400),
        ) {
            let (mut order, mut list) = (SeenOrder::default(), Vec::new());
            for (step, x) in steps {
                let key = VoxelKey { x, y: 0, z: 0 };
                list.retain(|known| *known != key);
                if step == 0 {
                    order.forget(key);
                } else {
                    order.saw(key);
                    list.push(key);
                }
                prop_assert_eq!(order.oldest(), list.first().copied());
                prop_assert_eq!(order.by_age().collect::<Vec<_>>(), list.clone());
            }
            for key in list {
                prop_assert_eq!(order.oldest(), Some(key));
                order.forget(key);
            }
            prop_assert_eq!(order.oldest(), None);
            prop_assert!(order.links.len() <= 12);
        }
    }
}
