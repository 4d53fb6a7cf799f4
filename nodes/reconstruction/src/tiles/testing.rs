//! A store in memory, whose tiles a test can see, spoil and lose.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use super::{TileKey, TileStore, TileStoreError};

/// Clones of it are the same store.
#[derive(Clone, Debug, Default)]
pub(crate) struct MemoryStore {
    tiles: Arc<Mutex<BTreeMap<TileKey, Vec<u8>>>>,
    /// It fails after so many more writes; `None` where it does not.
    fails_after: Arc<Mutex<Option<usize>>>,
}

impl MemoryStore {
    pub(crate) fn with<T>(&self, look: impl FnOnce(&mut BTreeMap<TileKey, Vec<u8>>) -> T) -> T {
        look(&mut self.tiles.lock().unwrap())
    }

    /// From now on nothing can be written or read, or all can be again.
    pub(crate) fn fail(&self, fails: bool) {
        *self.fails_after.lock().unwrap() = fails.then_some(0);
    }

    /// After so many more writes, those into other stores included, nothing can be written or read.
    pub(crate) fn fail_after(&self, writes: usize) {
        *self.fails_after.lock().unwrap() = Some(writes);
    }

    fn check(&self) -> Result<(), TileStoreError> {
        let reason = "no space left on device".to_owned();
        let fails = *self.fails_after.lock().unwrap() == Some(0);
        if fails { Err(TileStoreError::Failed { reason }) } else { Ok(()) }
    }
}

impl TileStore for MemoryStore {
    fn write(&mut self, tile: TileKey, bytes: &[u8]) -> Result<(), TileStoreError> {
        self.check()?;
        if let Some(writes) = &mut *self.fails_after.lock().unwrap() {
            *writes -= 1;
        }
        self.with(|tiles| tiles.insert(tile, bytes.to_vec()));
        Ok(())
    }

    fn read(&self, tile: TileKey) -> Result<Vec<u8>, TileStoreError> {
        self.check()?;
        self.with(|tiles| tiles.get(&tile).cloned()).ok_or(TileStoreError::Missing)
    }

    /// A store of its own, which fails when this one does.
    fn another(&self) -> Result<Box<dyn TileStore>, TileStoreError> {
        self.check()?;
        let fails_after = Arc::clone(&self.fails_after);
        Ok(Box::new(Self { tiles: Arc::default(), fails_after }))
    }

    fn clear(&mut self) -> Result<(), TileStoreError> {
        self.check()?;
        self.with(BTreeMap::clear);
        Ok(())
    }
}
