//! Tiles as files of a folder: `X_Y_Z.tile`, the tile's key in its name.
//!
//! Each run has a folder of its own below the parameter `spill_folder`, `tiles-PROCESS-NUMBER`, with a locked file in
//! it. It goes when the node ends. One whose file is not locked any more is what a run that was killed has left, and
//! is removed when the next one starts.
//!
//! A tile is written beside and then given its name, so that a file is whole or not there. It is not forced onto the
//! disk: after a crash of the machine nobody reads it.

#[cfg(test)]
mod tests;

use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use node_shell::NodeFailure;

use crate::tiles::{TileKey, TileStore, TileStoreError};

/// How the folder of a run begins.
const PREFIX: &str = "tiles-";
/// Locked as long as the run goes on.
const LOCK: &str = "lock";
const TILE: &str = "tile";
const PART: &str = "part";

/// The maps of one process have folders of their own.
static NUMBER: AtomicU32 = AtomicU32::new(0);

/// A folder of tiles, removed when it is dropped.
#[derive(Debug)]
pub(super) struct TileFolder {
    folder: PathBuf,
    /// Holds the lock.
    _lock: File,
}

impl TileFolder {
    /// A folder for this run below the value of `spill_folder`, which is made if it is not there. What killed runs
    /// have left there is removed.
    ///
    /// # Errors
    /// When nothing can be written there, or the value is empty.
    pub(super) fn new(spill_folder: &str) -> Result<Self, NodeFailure> {
        if spill_folder.is_empty() {
            return Err("parameter spill_folder is empty: with at_max_voxels spill it must name a folder, which is \
                        made if it is not there"
                .into());
        }
        let within = |error: io::Error| format!("parameter spill_folder: {spill_folder}: {error}");
        let parent = Path::new(spill_folder);
        fs::create_dir_all(parent).map_err(within)?;
        remove_leftovers(parent).map_err(within)?;
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let folder = parent.join(format!("{PREFIX}{}-{number}", std::process::id()));
        fs::create_dir(&folder).map_err(within)?;
        let lock = File::create(folder.join(LOCK)).map_err(within)?;
        lock.try_lock().map_err(|error| within(error.into()))?;
        Ok(Self { folder, _lock: lock })
    }

    fn path(&self, tile: TileKey, extension: &str) -> PathBuf {
        self.folder.join(format!("{}_{}_{}.{extension}", tile.x, tile.y, tile.z))
    }
}

impl Drop for TileFolder {
    fn drop(&mut self) {
        // What cannot be removed now is removed by the next run.
        let _ = fs::remove_dir_all(&self.folder);
    }
}

impl TileStore for TileFolder {
    fn write(&mut self, tile: TileKey, bytes: &[u8]) -> Result<(), TileStoreError> {
        let (part, path) = (self.path(tile, PART), self.path(tile, TILE));
        fs::write(&part, bytes).and_then(|()| fs::rename(&part, &path)).map_err(|error| {
            // Half a file helps nobody, and takes room.
            let _ = fs::remove_file(&part);
            failed(&path, &error)
        })
    }

    fn read(&self, tile: TileKey) -> Result<Vec<u8>, TileStoreError> {
        let path = self.path(tile, TILE);
        fs::read(&path).map_err(|error| match error.kind() {
            ErrorKind::NotFound => TileStoreError::Missing,
            _ => failed(&path, &error),
        })
    }

    fn clear(&mut self) -> Result<(), TileStoreError> {
        let clear = || {
            for entry in fs::read_dir(&self.folder)? {
                let path = entry?.path();
                if [TILE, PART].iter().any(|kind| path.extension().is_some_and(|e| e == *kind)) {
                    fs::remove_file(path)?;
                }
            }
            Ok(())
        };
        clear().map_err(|error: io::Error| failed(&self.folder, &error))
    }
}

fn failed(path: &Path, error: &io::Error) -> TileStoreError {
    TileStoreError::Failed { reason: format!("{}: {error}", path.display()) }
}

/// Removes the folders of runs that have ended without doing so.
fn remove_leftovers(parent: &Path) -> io::Result<()> {
    for entry in fs::read_dir(parent)? {
        let entry = entry?;
        let is_of_a_run = entry.file_name().to_string_lossy().starts_with(PREFIX);
        if !is_of_a_run {
            continue;
        }
        // One without the file is being made, or is none of ours.
        let Ok(lock) = File::open(entry.path().join(LOCK)) else { continue };
        if lock.try_lock().is_ok() {
            fs::remove_dir_all(entry.path())?;
        }
    }
    Ok(())
}
