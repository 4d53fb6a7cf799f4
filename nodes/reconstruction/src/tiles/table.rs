//! Where each tile of a map is: in memory, or in the store.
//!
//! A tile is in memory as a whole or not at all, so that whatever is computed of a place is computed of all that was
//! ever known of it. The tile that was reached longest ago goes first.
//!
//! A store may fail for a while. A tile that could not be read or written then is asked for again in the next round: the
//! next cycle, or the next time that listeners are told of changes.

use std::collections::{BTreeMap, HashMap};

use geometry::BuildVoxelHasher;

use super::{SpillCounts, TileBox, TileError, TileKey, TileStore, TileStoreError};

/// The tiles of a map, in memory and out of it. What a tile is made of, and its bytes, is the map's.
#[derive(Debug)]
pub(crate) struct TileTable {
    store: Box<dyn TileStore>,
    /// When each was reached. Some may have nothing in memory any more. Looked up by key, or for the least of the times.
    in_memory: HashMap<TileKey, u64, BuildVoxelHasher>,
    /// Looked up by key alone, or in the order of the keys.
    in_store: HashMap<TileKey, InStore, BuildVoxelHasher>,
    /// Counts how often tiles were reached.
    time: u64,
    /// Counts how often changes began to be followed.
    following: u32,
    round: u32,
    /// The tiles in the store that could not be read when they were last asked for, and the round in which that was:
    /// they are not tried again in it.
    unreadable: BTreeMap<TileKey, u32>,
    /// The latest write failed, in this round: no other is tried in it.
    unwritable: Option<u32>,
    counts: SpillCounts,
    error: Option<TileError>,
}

/// What is known of a tile in the store.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InStore {
    /// What it counts in the bound of the memory: voxels, or blocks.
    pub(crate) parts: u32,
    /// Its points.
    points: u32,
    /// [`TileTable::following`] when it went.
    following: u32,
}

/// Where a tile is.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Reached {
    /// All that is known of it is in memory.
    InMemory,
    InStore(InStore),
    /// It is in the store, which could not give it in this round.
    Unreadable,
}

impl TileTable {
    /// No tiles yet. The store is cleared.
    pub(crate) fn new(store: Box<dyn TileStore>) -> Self {
        let mut table = Self {
            store,
            in_memory: HashMap::default(),
            in_store: HashMap::default(),
            time: 0,
            following: 0,
            round: 0,
            unreadable: BTreeMap::new(),
            unwritable: None,
            counts: SpillCounts::default(),
            error: None,
        };
        table.clear();
        table
    }

    /// The tiles of the same map as it is after a correction, in another store: none yet.
    ///
    /// # Errors
    /// When there is no other store.
    pub(crate) fn another(&self) -> Result<Self, TileError> {
        let store = self.store.another().map_err(|source| TileError::Another { source })?;
        let (round, following) = (self.round, self.following);
        let counts = SpillCounts { voxels_in_store: 0, ..self.counts };
        Ok(Self { round, following, counts, ..Self::new(store) })
    }

    /// Forgets every tile.
    pub(crate) fn clear(&mut self) {
        self.in_memory = HashMap::default();
        self.in_store = HashMap::default();
        self.unreadable = BTreeMap::new();
        self.unwritable = None;
        self.counts.voxels_in_store = 0;
        if let Err(source) = self.store.clear() {
            self.failed(TileError::Clear { source });
        }
    }

    /// What failed may be tried again.
    pub(crate) fn begin_round(&mut self) {
        self.round = self.round.wrapping_add(1);
    }

    /// Changes are followed from now on, or anew: what is in the store, listeners know as it is.
    pub(crate) fn follow(&mut self) {
        self.following = self.following.wrapping_add(1);
    }

    /// Whether listeners know a tile of the store as it is: it went before changes were followed.
    pub(crate) fn is_known_as_it_is(&self, tile: InStore) -> bool {
        tile.following != self.following
    }

    /// From now on other tiles are reached: those that were reached until now may go.
    pub(crate) fn pass_on(&mut self) {
        self.time += 1;
    }

    /// Reaches a tile, which does not go until [`TileTable::pass_on`].
    pub(crate) fn reach(&mut self, tile: TileKey) -> Reached {
        if let Some(reached) = self.in_memory.get_mut(&tile) {
            *reached = self.time;
        } else if let Some(spilled) = self.in_store.get(&tile) {
            if self.unreadable.get(&tile) == Some(&self.round) {
                return Reached::Unreadable;
            }
            return Reached::InStore(*spilled);
        }
        Reached::InMemory
    }

    /// A tile has something in memory.
    pub(crate) fn has(&mut self, tile: TileKey) {
        self.in_memory.insert(tile, self.time);
    }

    /// Whether a tile is in the store.
    pub(crate) fn is_in_store(&self, tile: TileKey) -> bool {
        self.in_store.contains_key(&tile)
    }

    /// The tile that goes next: that which was reached longest ago. `None` where those that are left are reached now, and
    /// where none can be written in this round.
    pub(crate) fn next_to_go(&self) -> Option<TileKey> {
        let others = self.in_memory.iter().filter(|(_, reached)| **reached < self.time);
        let oldest = others.min_by_key(|(tile, reached)| (**reached, **tile));
        oldest.map(|(tile, _)| *tile).filter(|_| self.unwritable != Some(self.round))
    }

    /// A tile goes to the store, with so many parts in memory and points. Returns whether it is there; where not it stays
    /// in memory.
    pub(crate) fn write(
        &mut self,
        tile: TileKey,
        bytes: &[u8],
        parts: usize,
        points: usize,
    ) -> bool {
        if parts > 0
            && let Err(source) = self.store.write(tile, bytes)
        {
            // It counts as a failure when the write before it did not fail.
            self.counts.failed += u64::from(self.unwritable.replace(self.round).is_none());
            self.error = Some(TileError::Write { tile, source });
            return false;
        }
        self.in_memory.remove(&tile);
        if parts > 0 {
            let (parts, following) = (parts as u32, self.following);
            self.in_store.insert(tile, InStore { parts, points: points as u32, following });
            self.unwritable = None;
            self.counts.voxels_in_store += points;
            self.counts.written += 1;
        }
        true
    }

    /// The bytes of a tile in the store. It stays there.
    pub(crate) fn read(&self, tile: TileKey) -> Result<Vec<u8>, TileError> {
        self.store.read(tile).map_err(|source| TileError::Read { tile, source })
    }

    /// A tile of the store is in memory now.
    pub(crate) fn came_back(&mut self, tile: TileKey) {
        self.left_store(tile);
        self.counts.read += 1;
        self.has(tile);
    }

    /// A tile could not be read. One that is lost is in the store no more; another one counts as a failure when it
    /// could be read before. Returns whether it is lost.
    pub(crate) fn could_not_read(&mut self, tile: TileKey, error: TileError) -> bool {
        let is_lost = error.is_loss();
        if is_lost {
            self.left_store(tile);
            self.counts.lost += 1;
        } else if self.unreadable.insert(tile, self.round).is_none() {
            self.counts.failed += 1;
        }
        self.error = Some(error);
        is_lost
    }

    /// Tries those again that failed, so that a store that goes on failing is not read to its end each time.
    ///
    /// # Errors
    /// The first that fails again.
    pub(crate) fn retry_unreadable(&mut self) -> Result<(), TileError> {
        for tile in self.unreadable.keys().copied().collect::<Vec<_>>() {
            if let Err(error) = self.read(tile)
                && !error.is_loss()
            {
                self.could_not_read(tile, error.clone());
                return Err(error);
            }
        }
        Ok(())
    }

    /// All tiles were read, but for these. Returns whether some are lost.
    ///
    /// # Errors
    /// The first that cannot be read for now.
    pub(crate) fn were_read_but(&mut self, unreadable: Vec<TileError>) -> Result<bool, TileError> {
        let (mut first_failure, mut some_are_lost) = (None, false);
        for error in unreadable {
            let Some(tile) = error.tile() else { continue };
            if self.could_not_read(tile, error.clone()) {
                some_are_lost = true;
            } else {
                first_failure.get_or_insert(error);
            }
        }
        if let Some(error) = first_failure {
            return Err(error);
        }
        self.unreadable = BTreeMap::new();
        Ok(some_are_lost)
    }

    /// A tile of the store before a correction was found to be lost.
    pub(crate) fn lost_before(&mut self, error: TileError) {
        self.counts.lost += 1;
        self.error = Some(error);
    }

    /// Something could not be done that another attempt may do.
    pub(crate) fn failed(&mut self, error: TileError) {
        self.counts.failed += 1;
        self.error = Some(error);
    }

    /// What the store could not do when there was no room.
    pub(crate) fn why_no_room(&self) -> TileError {
        let none = TileError::Another { source: TileStoreError::Missing };
        self.error.clone().unwrap_or(none)
    }

    /// The latest of the errors since this was last asked.
    pub(crate) fn take_error(&mut self) -> Option<TileError> {
        self.error.take()
    }

    /// The tiles in the store, by ascending key.
    pub(crate) fn in_store_by_key(&self) -> Vec<TileKey> {
        sorted(self.in_store.keys().copied())
    }

    /// The tiles in memory, by ascending key.
    pub(crate) fn in_memory_by_key(&self) -> Vec<TileKey> {
        sorted(self.in_memory.keys().copied())
    }

    /// All tiles, by ascending key.
    pub(crate) fn by_key(&self) -> Vec<TileKey> {
        sorted(self.known())
    }

    /// The tiles in a box, by ascending key. Costs by its places or by all tiles, whichever are fewer.
    pub(crate) fn within(&self, tiles: TileBox) -> Vec<TileKey> {
        if tiles.places() > (self.in_memory.len() + self.in_store.len()) as u64 {
            return sorted(self.known().filter(|tile| tiles.contains(*tile)));
        }
        let is_known =
            |tile: &TileKey| self.in_memory.contains_key(tile) || self.is_in_store(*tile);
        tiles.keys().filter(is_known).collect()
    }

    fn known(&self) -> impl Iterator<Item = TileKey> {
        self.in_memory.keys().chain(self.in_store.keys()).copied()
    }

    /// Points of the tiles in the store.
    pub(crate) fn points_in_store(&self) -> usize {
        self.counts.voxels_in_store
    }

    pub(crate) fn counts(&self) -> SpillCounts {
        SpillCounts {
            tiles_in_memory: self.in_memory.len(),
            tiles_in_store: self.in_store.len(),
            ..self.counts
        }
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        // A table of the standard library is filled up to 7/8, and has a byte beside each entry.
        let slots = |capacity: usize| (capacity * 8).div_ceil(7);
        slots(self.in_memory.capacity()) * (size_of::<(TileKey, u64)>() + 1)
            + slots(self.in_store.capacity()) * (size_of::<(TileKey, InStore)>() + 1)
            + self.unreadable.len() * size_of::<(TileKey, u32)>()
    }

    /// The tile is in the store no more: it has come back, or is lost.
    fn left_store(&mut self, tile: TileKey) {
        self.unreadable.remove(&tile);
        if let Some(spilled) = self.in_store.remove(&tile) {
            self.counts.voxels_in_store =
                self.counts.voxels_in_store.saturating_sub(spilled.points as usize);
        }
    }
}

fn sorted(tiles: impl Iterator<Item = TileKey>) -> Vec<TileKey> {
    let mut tiles: Vec<TileKey> = tiles.collect();
    tiles.sort_unstable();
    tiles
}
