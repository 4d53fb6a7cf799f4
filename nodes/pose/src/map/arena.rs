//! Things under numbers that are never given twice, and copies of all of them that cost next to nothing.

use std::cmp::Ordering;
use std::fmt;
use std::hash::{Hash, Hasher};
use std::marker::PhantomData;
use std::sync::Arc;

/// Slots that are copied at once when one of them changes that a snapshot still holds: 4 KiB.
const CHUNK: usize = 256;

/// The number of a thing in an [`Arena`]: its slot, and the generation of the slot. That of a thing that was
/// removed finds nothing, whatever came into its place.
pub struct Id<T> {
    index: u32,
    generation: u32,
    kind: PhantomData<fn() -> T>,
}

/// Things of one kind.
///
/// A clone shares everything with the original; what is changed afterwards, in either, is copied first, and nothing else
/// is. So a clone is a snapshot, which another thread reads without a lock.
#[derive(Debug)]
pub struct Arena<T> {
    chunks: Vec<Arc<Vec<Slot<T>>>>,
    /// Slots that are free, the next to be used last.
    free: Vec<u32>,
    len: usize,
}

#[derive(Debug)]
struct Slot<T> {
    generation: u32,
    value: Option<Arc<T>>,
}

impl<T> Arena<T> {
    /// How many things there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The thing of this number, if it is still there.
    #[must_use]
    pub fn get(&self, id: Id<T>) -> Option<&T> {
        let (chunk, place) = place_of(id.index);
        let slot = self.chunks.get(chunk)?.get(place)?;
        slot.value.as_deref().filter(|_| slot.generation == id.generation)
    }

    /// Whether it is still there.
    #[must_use]
    pub fn contains(&self, id: Id<T>) -> bool {
        self.get(id).is_some()
    }

    /// All things with their numbers, by their places.
    pub fn iter(&self) -> impl Iterator<Item = (Id<T>, &T)> {
        let slots = self.chunks.iter().flat_map(|chunk| chunk.iter());
        (0_u32..).zip(slots).filter_map(|(index, slot)| {
            let id = Id { index, generation: slot.generation, kind: PhantomData };
            Some((id, slot.value.as_deref()?))
        })
    }

    /// All numbers, by their places.
    pub fn ids(&self) -> impl Iterator<Item = Id<T>> {
        self.iter().map(|(id, _)| id)
    }

    /// Takes a thing in. `None` when four thousand million slots are taken.
    pub(super) fn insert(&mut self, value: T) -> Option<Id<T>> {
        let index = match self.free.pop() {
            Some(index) => index,
            None => self.new_slot()?,
        };
        let slot = self.slot_mut(index)?;
        slot.value = Some(Arc::new(value));
        let generation = slot.generation;
        self.len += 1;
        Some(Id { index, generation, kind: PhantomData })
    }

    /// Takes a thing out.
    pub(super) fn remove(&mut self, id: Id<T>) -> Option<Arc<T>> {
        self.get(id)?;
        let slot = self.slot_mut(id.index)?;
        let value = slot.value.take();
        // A slot whose numbers are used up stays empty.
        if let Some(generation) = slot.generation.checked_add(1) {
            slot.generation = generation;
            self.free.push(id.index);
        }
        self.len -= 1;
        value
    }

    /// The thing of this number, to be changed.
    pub(super) fn get_mut(&mut self, id: Id<T>) -> Option<&mut T>
    where
        T: Clone,
    {
        self.get(id)?;
        self.slot_mut(id.index)?.value.as_mut().map(Arc::make_mut)
    }

    fn new_slot(&mut self) -> Option<u32> {
        if self.chunks.last().is_none_or(|chunk| chunk.len() == CHUNK) {
            self.chunks.push(Arc::new(Vec::with_capacity(CHUNK)));
        }
        let full = (self.chunks.len() - 1) * CHUNK;
        let chunk = Arc::make_mut(self.chunks.last_mut()?);
        let index = u32::try_from(full + chunk.len()).ok()?;
        chunk.push(Slot { generation: 0, value: None });
        Some(index)
    }

    fn slot_mut(&mut self, index: u32) -> Option<&mut Slot<T>> {
        let (chunk, place) = place_of(index);
        Arc::make_mut(self.chunks.get_mut(chunk)?).get_mut(place)
    }
}

fn place_of(index: u32) -> (usize, usize) {
    (index as usize / CHUNK, index as usize % CHUNK)
}

impl<T> Default for Arena<T> {
    fn default() -> Self {
        Self { chunks: Vec::new(), free: Vec::new(), len: 0 }
    }
}

// What is derived would ask the same of the things.

impl<T> Clone for Arena<T> {
    fn clone(&self) -> Self {
        Self { chunks: self.chunks.clone(), free: self.free.clone(), len: self.len }
    }
}

impl<T> Clone for Slot<T> {
    fn clone(&self) -> Self {
        Self { generation: self.generation, value: self.value.clone() }
    }
}

impl<T> Clone for Id<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Id<T> {}

impl<T> PartialEq for Id<T> {
    fn eq(&self, other: &Self) -> bool {
        (self.index, self.generation) == (other.index, other.generation)
    }
}

impl<T> Eq for Id<T> {}

impl<T> PartialOrd for Id<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<T> Ord for Id<T> {
    fn cmp(&self, other: &Self) -> Ordering {
        (self.index, self.generation).cmp(&(other.index, other.generation))
    }
}

impl<T> Hash for Id<T> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        (self.index, self.generation).hash(state);
    }
}

impl<T> fmt::Debug for Id<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.index, self.generation)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn an_arena_is_a_map_whose_keys_never_come_back(
            steps in prop::collection::vec((0..3_u8, any::<prop::sample::Index>()), 0..2000),
        ) {
            let (mut arena, mut twin, mut gone) = (Arena::default(), BTreeMap::new(), Vec::new());
            for (number, (step, choice)) in steps.into_iter().enumerate() {
                let chosen = twin.keys().copied().nth(choice.index(twin.len().max(1)));
                match (step, chosen) {
                    (1, Some(id)) => {
                        let removed = arena.remove(id);
                        prop_assert_eq!(removed.as_deref().copied(), twin.remove(&id));
                        gone.push(id);
                    }
                    (2, Some(id)) => {
                        *arena.get_mut(id).unwrap() = number;
                        twin.insert(id, number);
                    }
                    _ => {
                        let id = arena.insert(number).unwrap();
                        prop_assert!(!gone.contains(&id) && twin.insert(id, number).is_none());
                    }
                }
            }
            let all: BTreeMap<_, _> = arena.iter().map(|(id, value)| (id, *value)).collect();
            prop_assert_eq!(arena.len(), twin.len());
            prop_assert_eq!(all, twin);
            prop_assert!(gone.iter().all(|id| arena.get(*id).is_none()));
        }
    }

    #[test]
    fn a_snapshot_stays_as_it_was_and_shares_what_did_not_change() {
        let mut arena = Arena::default();
        let ids: Vec<_> = (0..1000).map(|number| arena.insert(number).unwrap()).collect();
        let snapshot = arena.clone();
        *arena.get_mut(ids[300]).unwrap() = -1;
        arena.remove(ids[301]);
        arena.insert(-2);
        for (number, id) in ids.iter().enumerate() {
            assert_eq!(snapshot.get(*id), Some(&(number as i32)));
        }
        assert_eq!(snapshot.len(), 1000);
        assert_eq!(arena.get(ids[300]), Some(&-1));
        let shared = arena.chunks.iter().zip(&snapshot.chunks);
        let shared: Vec<bool> = shared.map(|(one, other)| Arc::ptr_eq(one, other)).collect();
        assert_eq!(shared, [true, false, true, true]);
    }
}
