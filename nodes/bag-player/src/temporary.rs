//! Temporary files, for bags that are compressed as a whole and bags of ROS 1.
//!
//! Each is in a folder of its own below the system's folder for temporary files, with a locked file in it. What a process
//! that was killed has left there has a lock that is free, and is removed when the next such folder is made.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use crate::error::BagError;

/// How the names of the folders begin.
const PREFIX: &str = "stillmap-bag-";
/// Locked as long as the folder is in use.
const LOCK: &str = "lock";
/// The lock before it is locked: nobody takes such a folder for a leftover.
const NEW_LOCK: &str = "lock.new";

/// A folder for temporary bags, which is removed when it is dropped; at the latest, by the next process that makes one.
#[derive(Debug)]
pub struct TemporaryFolder {
    folder: TempDir,
    /// Holds the lock; none where the file system has no locks.
    _lock: Option<File>,
}

impl TemporaryFolder {
    /// A new folder below the system's folder for temporary files.
    ///
    /// # Errors
    /// When it cannot be made.
    pub fn new() -> io::Result<Self> {
        Self::below(&std::env::temp_dir())
    }

    fn below(parent: &Path) -> io::Result<Self> {
        remove_leftovers(parent);
        let folder = tempfile::Builder::new().prefix(PREFIX).tempdir_in(parent)?;
        let lock = File::create(folder.path().join(NEW_LOCK))?;
        let is_locked = lock.try_lock().is_ok();
        if is_locked {
            fs::rename(folder.path().join(NEW_LOCK), folder.path().join(LOCK))?;
        }
        Ok(Self { folder, _lock: is_locked.then_some(lock) })
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// Removes the folders of processes that have ended without doing so. One that cannot be removed, as another user's, only takes
/// room.
fn remove_leftovers(parent: &Path) {
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        if !is_folder || !entry.file_name().to_string_lossy().starts_with(PREFIX) {
            continue;
        }
        // Over NFS only a file that is open for writing can be locked.
        let lock = OpenOptions::new().write(true).open(entry.path().join(LOCK));
        if lock.is_ok_and(|lock| lock.try_lock().is_ok()) {
            let _ = fs::remove_dir_all(entry.path());
        }
    }
}

/// A file in a separate folder. Both are removed when the last reader is dropped.
#[derive(Debug)]
pub(crate) struct Temporary {
    path: PathBuf,
    folder: TemporaryFolder,
}

impl Temporary {
    /// A path for the content of `original`; the file is not created yet.
    pub(crate) fn place_for(original: &Path) -> Result<Self, BagError> {
        let folder = TemporaryFolder::new()
            .map_err(|source| refused(original, &std::env::temp_dir(), source))?;
        Ok(Self { path: folder.path().join("bag"), folder })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The error of a failed write.
    pub(crate) fn refused(&self, original: &Path, source: io::Error) -> BagError {
        refused(original, self.folder.path(), source)
    }
}

fn refused(original: &Path, folder: &Path, source: io::Error) -> BagError {
    BagError::Temporary { path: original.to_owned(), folder: folder.to_owned(), source }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each interrupted look at a large bag of ROS 1 left up to its whole size in the folder for temporary files.
    #[test]
    fn what_a_killed_process_has_left_is_removed_by_the_next_one() {
        let parent = tempfile::tempdir().unwrap();
        let at = |name: &str| parent.path().join(name);
        let running = TemporaryFolder::below(parent.path()).unwrap();
        for (name, file) in [("left", LOCK), ("starting", NEW_LOCK), ("unknown", "bag")] {
            fs::create_dir(at(&format!("{PREFIX}{name}"))).unwrap();
            fs::write(at(&format!("{PREFIX}{name}")).join(file), "").unwrap();
        }
        fs::create_dir(at("other")).unwrap();
        fs::write(at("other").join(LOCK), "").unwrap();
        fs::write(at(&format!("{PREFIX}left")).join("bag"), [0; 1000]).unwrap();
        let own = TemporaryFolder::below(parent.path()).unwrap();
        assert!(!at(&format!("{PREFIX}left")).exists());
        for name in ["starting", "unknown"] {
            assert!(at(&format!("{PREFIX}{name}")).exists(), "{name}");
        }
        assert!(at("other").exists() && running.path().exists() && own.path().exists());
        let place = running.path().to_owned();
        drop(running);
        assert!(!place.exists());
    }
}
