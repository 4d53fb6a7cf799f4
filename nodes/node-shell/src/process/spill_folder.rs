//! A folder for the files of one run: what its memory has no room for.
//!
//! Each run has a folder of its own below the one that the user names, `tiles-PROCESS-NUMBER`, with a locked file in
//! it. It is removed when it is dropped. One whose file is no longer locked, or that is empty, was left by a run that was
//! killed, and is removed when the next run starts. Where the file system has no locks, what a killed run has left stays.

#[cfg(test)]
mod tests;

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use super::file_lock::{TryLock, has_no_locks, is_at};
use super::whole_file::folder_of;

/// How the folder of a run begins.
const PREFIX: &str = "tiles-";
/// Locked as long as the run goes on.
const LOCK: &str = "lock";
/// In place of the lock where the file system has none. Such a folder is not empty, and nobody takes it for a leftover.
const NO_LOCK: &str = "no_lock";
/// The end of the name of a file that is being written.
const PART: &str = ".part";

/// So many names of folders are tried before other runs are to blame.
const MOST_TRIES: u32 = 1000;

/// The folders of one process have numbers of their own.
static NUMBER: AtomicU32 = AtomicU32::new(0);

/// What could not be done with the folder of a run or a file in it.
#[derive(Debug, thiserror::Error)]
pub enum SpillFolderError {
    /// The file system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Failed {
        /// What was tried.
        action: &'static str,
        /// With which file or folder.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// Other runs have folders by all names that were tried.
    #[error("{} has {tries} folders of other runs by the name of this one's: choose another folder", parent.display())]
    NoName {
        /// The folder that the user named.
        parent: PathBuf,
        /// The names that were tried.
        tries: u32,
    },
}

/// A folder of files for one run, removed when it is dropped.
///
/// Files are not forced onto the disk: after a crash of the machine nobody reads them.
#[derive(Debug)]
pub struct SpillFolder {
    folder: PathBuf,
    /// Holds the lock; none where the file system has no locks.
    _lock: Option<File>,
}

impl SpillFolder {
    /// A folder for this run below `parent`, which is made if it is not there. What killed runs have left there is
    /// removed.
    ///
    /// # Errors
    /// When nothing can be written there, or the lock fails in another way than that the file system has none.
    pub fn below(parent: &Path) -> Result<Self, SpillFolderError> {
        Self::below_with(parent, File::try_lock)
    }

    fn below_with(parent: &Path, try_lock: TryLock) -> Result<Self, SpillFolderError> {
        fs::create_dir_all(parent).map_err(failed("make the folder", parent))?;
        remove_leftovers(parent)?;
        for _ in 0..MOST_TRIES {
            let number = NUMBER.fetch_add(1, Ordering::Relaxed);
            let folder = parent.join(format!("{PREFIX}{}-{number}", std::process::id()));
            if let Some(own) = Self::at(folder, try_lock)? {
                return Ok(own);
            }
        }
        Err(SpillFolderError::NoName { parent: parent.to_owned(), tries: MOST_TRIES })
    }

    /// Another folder for this run, beside this one.
    ///
    /// # Errors
    /// As of [`Self::below`].
    pub fn beside(&self) -> Result<Self, SpillFolderError> {
        Self::below(folder_of(&self.folder))
    }

    /// The folder at this path, made and locked; `None` where another run has it, or has removed it as a leftover
    /// before it was locked.
    fn at(folder: PathBuf, try_lock: TryLock) -> Result<Option<Self>, SpillFolderError> {
        match fs::create_dir(&folder) {
            Ok(()) => {}
            // Of a run with the same number, as each container counts them anew.
            Err(error) if error.kind() == ErrorKind::AlreadyExists => return Ok(None),
            Err(error) => return Err(failed("make the folder", &folder)(error)),
        }
        let path = folder.join(LOCK);
        let Some(lock) = created_in_folder(&path)? else { return Ok(None) };
        match try_lock(&lock) {
            // Else it was locked after another run had removed it, and a third one may have made it anew.
            Ok(()) if is_at(&lock, &path) => Ok(Some(Self { folder, _lock: Some(lock) })),
            Ok(()) | Err(TryLockError::WouldBlock) => Ok(None),
            Err(TryLockError::Error(error)) if has_no_locks(&error) => Self::without_lock(folder),
            Err(TryLockError::Error(error)) => Err(failed("lock the file", &path)(error)),
        }
    }

    /// The folder, which cannot be locked; `None` where another run has removed it as a leftover.
    fn without_lock(folder: PathBuf) -> Result<Option<Self>, SpillFolderError> {
        if created_in_folder(&folder.join(NO_LOCK))?.is_none() {
            return Ok(None);
        }
        // A run on a machine that can lock it would take this one for ended.
        let path = folder.join(LOCK);
        match fs::remove_file(&path) {
            Ok(()) => {}
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(failed("remove the file", &path)(error)),
        }
        tracing::warn!(
            "the file system of {} has no locks: if this process is killed, remove the folder by hand",
            folder.display()
        );
        Ok(Some(Self { folder, _lock: None }))
    }

    /// Where the files are.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.folder
    }

    /// Writes the file `name`, in place of the one that it may be. A file is whole or not there: it is written beside
    /// and then given its name.
    ///
    /// # Errors
    /// When it cannot be written; a previous file of that name is kept.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<(), SpillFolderError> {
        let (part, path) = (self.folder.join(format!("{name}{PART}")), self.folder.join(name));
        fs::write(&part, bytes).and_then(|()| fs::rename(&part, &path)).map_err(|error| {
            // Half a file helps nobody, and takes room.
            let _ = fs::remove_file(&part);
            failed("write", &path)(error)
        })
    }

    /// Puts bytes behind those of the file `name`, which is made if it is not there.
    ///
    /// # Errors
    /// When they cannot be written; the file is then as it was.
    pub fn append(&self, name: &str, bytes: &[u8]) -> Result<(), SpillFolderError> {
        let path = self.folder.join(name);
        let append = || {
            let mut file = OpenOptions::new().create(true).append(true).open(&path)?;
            let length = file.seek(SeekFrom::End(0))?;
            file.write_all(bytes).inspect_err(|_| {
                // A part of the bytes is useless.
                let _ = file.set_len(length);
            })
        };
        append().map_err(failed("write", &path))
    }

    /// The bytes of the file `name`; `None` where there is no such file.
    ///
    /// # Errors
    /// When it is there and cannot be read.
    pub fn read(&self, name: &str) -> Result<Option<Vec<u8>>, SpillFolderError> {
        let path = self.folder.join(name);
        match fs::read(&path) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
            Err(error) => Err(failed("read", &path)(error)),
        }
    }

    /// Removes all files.
    ///
    /// # Errors
    /// When some may still be there.
    pub fn clear(&self) -> Result<(), SpillFolderError> {
        let clear = || {
            for entry in fs::read_dir(&self.folder)? {
                let entry = entry?;
                if ![LOCK, NO_LOCK].iter().any(|kept| entry.file_name() == *kept) {
                    fs::remove_file(entry.path())?;
                }
            }
            Ok(())
        };
        clear().map_err(failed("clear", &self.folder))
    }
}

impl Drop for SpillFolder {
    fn drop(&mut self) {
        // What cannot be removed now is removed by the next run.
        let _ = fs::remove_dir_all(&self.folder);
    }
}

fn failed(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> SpillFolderError {
    let path = path.to_owned();
    move |source| SpillFolderError::Failed { action, path, source }
}

/// A new file in a folder; `None` where the folder is gone.
fn created_in_folder(path: &Path) -> Result<Option<File>, SpillFolderError> {
    match File::create(path) {
        Ok(file) => Ok(Some(file)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(error) => Err(failed("make the file", path)(error)),
    }
}

/// Removes the folders of runs that have ended without doing so. One that cannot be removed, as another user's, is
/// logged and left: it only takes room.
fn remove_leftovers(parent: &Path) -> Result<(), SpillFolderError> {
    const LIST: &str = "list the folder";
    for entry in fs::read_dir(parent).map_err(failed(LIST, parent))? {
        let entry = entry.map_err(failed(LIST, parent))?;
        if !is_name_of_run(&entry.file_name().to_string_lossy()) {
            continue;
        }
        let folder = entry.path();
        match remove_if_left(&folder) {
            Ok(()) => {}
            // Another run that starts was faster.
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => tracing::warn!(
                "the files in {}, which a run that was killed has left, cannot be removed: {error}",
                folder.display()
            ),
        }
    }
    Ok(())
}

/// Whether a folder has such a name as [`SpillFolder::below`] gives: `tiles-PROCESS-NUMBER`.
fn is_name_of_run(name: &str) -> bool {
    let numbers = name.strip_prefix(PREFIX).and_then(|numbers| numbers.split_once('-'));
    numbers.is_some_and(|(process, number)| {
        process.parse::<u32>().is_ok() && number.parse::<u32>().is_ok()
    })
}

/// Removes the folder of a run if the run has ended.
fn remove_if_left(folder: &Path) -> io::Result<()> {
    let path = folder.join(LOCK);
    if !fs::symlink_metadata(&path).is_ok_and(|metadata| metadata.is_file()) {
        // Its run was killed before it made the file, or has yet to make it and will then take another folder. One with
        // files is of a run that cannot lock, or of another program.
        return match fs::remove_dir(folder) {
            Err(error) if error.kind() == ErrorKind::DirectoryNotEmpty => Ok(()),
            // Another user's, which has no files.
            Err(error) if error.kind() == ErrorKind::PermissionDenied => Ok(()),
            result => result,
        };
    }
    // Over NFS only a file that is open for writing can be locked.
    let Ok(lock) = OpenOptions::new().write(true).open(&path) else { return Ok(()) };
    if lock.try_lock().is_err() {
        return Ok(());
    }
    fs::remove_dir_all(folder)
}
