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

use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use node_shell::{NodeFailure, folder_of};

use crate::tiles::{TileKey, TileStore, TileStoreError};

/// How the folder of a run begins.
const PREFIX: &str = "tiles-";
/// Locked as long as the run goes on.
const LOCK: &str = "lock";
const TILE: &str = "tile";
const PART: &str = "part";

/// So many names of folders are tried before another run is to blame.
const MOST_TRIES: u32 = 1000;

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
    /// When nothing can be written or locked there, or the value is empty.
    pub(super) fn new(spill_folder: &str) -> Result<Self, NodeFailure> {
        if spill_folder.is_empty() {
            return Err("parameter spill_folder is empty: with at_max_voxels spill it must name a folder, which is \
                        made if it is not there"
                .into());
        }
        let parent = Path::new(spill_folder);
        fs::create_dir_all(parent).map_err(|error| cannot("make the folder", parent, &error))?;
        remove_leftovers(parent)?;
        for _ in 0..MOST_TRIES {
            let number = NUMBER.fetch_add(1, Ordering::Relaxed);
            let folder = parent.join(format!("{PREFIX}{}-{number}", std::process::id()));
            if let Some(own) = Self::at(folder)? {
                return Ok(own);
            }
        }
        Err(format!(
            "parameter spill_folder: {spill_folder} has {MOST_TRIES} folders of other runs by the name of this one's: \
             choose another folder"
        )
        .into())
    }

    /// The folder at this path, made and locked; `None` where another run has it, or has taken it away as a leftover
    /// between the two.
    fn at(folder: PathBuf) -> Result<Option<Self>, NodeFailure> {
        match fs::create_dir(&folder) {
            Ok(()) => {}
            // Of a run with the same number, as each container counts them anew.
            Err(error) if error.kind() == ErrorKind::AlreadyExists => return Ok(None),
            Err(error) => return Err(cannot("make the folder", &folder, &error)),
        }
        let path = folder.join(LOCK);
        let lock = match File::create(&path) {
            Ok(lock) => lock,
            Err(error) => return Err(cannot("make the file", &path, &error)),
        };
        match lock.try_lock() {
            Ok(()) if path.exists() => Ok(Some(Self { folder, _lock: lock })),
            Ok(()) | Err(TryLockError::WouldBlock) => Ok(None),
            Err(TryLockError::Error(error)) => Err(cannot("lock the file", &path, &error)),
        }
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

    /// A folder beside this one.
    fn another(&self) -> Result<Box<dyn TileStore>, TileStoreError> {
        let another = Self::new(&folder_of(&self.folder).to_string_lossy());
        let reason = |error: NodeFailure| TileStoreError::Failed { reason: error.to_string() };
        Ok(Box::new(another.map_err(reason)?))
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

fn cannot(what: &str, path: &Path, error: &io::Error) -> NodeFailure {
    format!("parameter spill_folder: cannot {what} {}: {error}", path.display()).into()
}

/// Removes the folders of runs that have ended without doing so. One that cannot be removed, as another user's, is told
/// of and left: it is in nobody's way but the disk's.
fn remove_leftovers(parent: &Path) -> Result<(), NodeFailure> {
    let failed = |error: &io::Error| cannot("list the folder", parent, error);
    for entry in fs::read_dir(parent).map_err(|error| failed(&error))? {
        let entry = entry.map_err(|error| failed(&error))?;
        let is_of_a_run = entry.file_name().to_string_lossy().starts_with(PREFIX);
        if !is_of_a_run {
            continue;
        }
        let folder = entry.path();
        // One without the file is being made, or is none of ours.
        let Ok(lock) = File::open(folder.join(LOCK)) else { continue };
        if lock.try_lock().is_err() {
            continue;
        }
        match fs::remove_dir_all(&folder) {
            Ok(()) => {}
            // Another run that starts was faster.
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => tracing::warn!(
                "the tiles in {}, which a run that was killed has left, cannot be removed: {error}",
                folder.display()
            ),
        }
    }
    Ok(())
}
