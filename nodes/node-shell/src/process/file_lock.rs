//! Locks on files: which process writes what. The system takes them from a process that ends, however it does.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use tokio::time::Instant;

use super::failure::{NodeFailure, Unusable};
use super::shutdown::Shutdown;
use super::whole_file::beside;

/// How long a process that ends may still write: one that is started in its place waits for it.
const ENDS_WITHIN: Duration = Duration::from_secs(5);
/// How often it looks.
const LOOK_AGAIN: Duration = Duration::from_millis(100);

/// A file that this process writes, and no other: another one that asks for it is told. `map.ply.lock` is there as long, locked, with the
/// number of the process. One that a killed process has left is not locked, and counts for nothing.
#[derive(Debug)]
pub struct ClaimedFile {
    lock: PathBuf,
    /// Holds the lock; none where the file system has no locks.
    file: Option<File>,
}

/// What became of a try to have a file.
enum Tried {
    Had(ClaimedFile),
    /// Another process has it, with what it has written of itself.
    Taken(String),
    /// The one that had it removes its lock.
    Again,
}

impl ClaimedFile {
    /// Has the file at this path, behind a symbolic link if it is one, from now on until it is dropped. Waits for a process that is about to
    /// end.
    ///
    /// # Errors
    /// When another process has it ([`Unusable`]: both would write it in turns), or its lock cannot be made.
    pub async fn at(path: &Path, shutdown: &Shutdown) -> Result<Self, NodeFailure> {
        Self::within(ENDS_WITHIN, path, shutdown).await
    }

    async fn within(wait: Duration, path: &Path, shutdown: &Shutdown) -> Result<Self, NodeFailure> {
        let until = Instant::now() + wait;
        loop {
            let failed = |error: io::Error| format!("cannot lock {}: {error}", path.display());
            let other = match Self::try_at(path, File::try_lock).map_err(failed)? {
                Tried::Had(claimed) => return Ok(claimed),
                Tried::Taken(other) => other,
                Tried::Again => String::new(),
            };
            if Instant::now() >= until || shutdown.is_triggered() {
                return Err(Unusable::new(format!(
                    "another process{} writes {}: each would replace what the other one saves. End it, or give this one a file of its own",
                    of_number(&other),
                    path.display()
                ))
                .into());
            }
            tokio::time::sleep(LOOK_AGAIN).await;
        }
    }

    fn try_at(path: &Path, try_lock: TryLock) -> io::Result<Tried> {
        let lock = beside(path, ".lock");
        let mut file = opened(&lock)?;
        match try_lock(&file) {
            Ok(()) if is_at(&file, &lock) => {}
            Ok(()) => return Ok(Tried::Again),
            Err(TryLockError::WouldBlock) => {
                let mut other = String::new();
                // It is said where it can be read.
                let _ = file.read_to_string(&mut other);
                return Ok(Tried::Taken(other));
            }
            Err(TryLockError::Error(error)) if has_no_locks(&error) => {
                fs::remove_file(&lock)?;
                tracing::info!(
                    "the file system of {} has no locks: a second process that writes it would not be told",
                    path.display()
                );
                return Ok(Tried::Had(Self { lock, file: None }));
            }
            Err(TryLockError::Error(error)) => return Err(error),
        }
        // Another user's file can be locked and not written; nobody needs the number.
        let _ = file.set_len(0).and_then(|()| write!(file, "{}", std::process::id()));
        Ok(Tried::Had(Self { lock, file: Some(file) }))
    }
}

impl Drop for ClaimedFile {
    fn drop(&mut self) {
        if self.file.is_some() {
            // What stays is not locked any more.
            let _ = fs::remove_file(&self.lock);
        }
    }
}

/// How a file is locked: [`File::try_lock`], but for tests.
pub(super) type TryLock = fn(&File) -> Result<(), TryLockError>;

/// The file, made if it is not there. Over NFS only one that is open for writing can be locked; another user's can be read alone.
fn opened(path: &Path) -> io::Result<File> {
    let written = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path);
    match written {
        Err(error) if error.kind() == ErrorKind::PermissionDenied => File::open(path),
        written => written,
    }
}

fn of_number(other: &str) -> String {
    other.trim().parse::<u32>().map_or(String::new(), |number| format!(" ({number})"))
}

/// Whether this is the file at the path.
pub(super) fn is_at(file: &File, path: &Path) -> bool {
    let number = |metadata: fs::Metadata| (metadata.dev(), metadata.ino());
    let (own, there) = (file.metadata().map(number), fs::symlink_metadata(path).map(number));
    own.ok().zip(there.ok()).is_some_and(|(own, there)| own == there)
}

/// Whether a file could not be locked because its file system has no locks.
pub(super) fn has_no_locks(error: &io::Error) -> bool {
    error.kind() == ErrorKind::Unsupported || is_without_lock_manager(error)
}

/// NFS without its lock manager (flock(2), fcntl_locking(2): a remote locking protocol failed).
#[cfg(target_os = "linux")]
fn is_without_lock_manager(error: &io::Error) -> bool {
    rustix::io::Errno::from_io_error(error) == Some(rustix::io::Errno::NOLCK)
}

#[cfg(not(target_os = "linux"))]
fn is_without_lock_manager(_error: &io::Error) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::super::failure::is_for_good;
    use super::*;

    fn map_in(folder: &tempfile::TempDir) -> PathBuf {
        folder.path().join("map.ply")
    }

    async fn claimed(path: &Path, wait: Duration) -> Result<ClaimedFile, NodeFailure> {
        ClaimedFile::within(wait, path, &Shutdown::new()).await
    }

    /// Two processes wrote one file in turns, each over what the other one had saved.
    #[tokio::test]
    async fn a_second_process_with_the_same_file_is_told_for_good_and_the_next_one_has_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = map_in(&folder);
        let first = claimed(&path, Duration::ZERO).await.unwrap();
        let refused = claimed(&path, Duration::ZERO).await.unwrap_err();
        assert!(is_for_good(&refused), "{refused}");
        let own = std::process::id().to_string();
        let text = refused.to_string();
        assert!(text.contains(&own) && text.contains("map.ply"), "{text}");
        drop(first);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "nothing stays");
        claimed(&path, Duration::ZERO).await.unwrap();
    }

    #[tokio::test]
    async fn a_process_that_is_started_again_waits_for_the_one_that_ends() {
        let folder = tempfile::tempdir().unwrap();
        let path = map_in(&folder);
        let first = claimed(&path, Duration::ZERO).await.unwrap();
        let ends = async {
            tokio::time::sleep(2 * LOOK_AGAIN).await;
            drop(first);
        };
        let (next, ()) = tokio::join!(claimed(&path, Duration::from_secs(60)), ends);
        next.unwrap();
    }

    #[tokio::test]
    async fn what_a_killed_process_has_left_keeps_nobody_from_starting() {
        let folder = tempfile::tempdir().unwrap();
        let path = map_in(&folder);
        fs::write(beside(&path, ".lock"), "4711").unwrap();
        claimed(&path, Duration::ZERO).await.unwrap();
    }

    #[test]
    fn a_file_system_without_locks_lets_everybody_have_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let without = |_: &File| Err(TryLockError::Error(ErrorKind::Unsupported.into()));
        for _ in 0..2 {
            let tried = ClaimedFile::try_at(&map_in(&folder), without).unwrap();
            assert!(matches!(tried, Tried::Had(ClaimedFile { file: None, .. })));
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
