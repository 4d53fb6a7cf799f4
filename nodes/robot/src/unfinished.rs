//! Files that are written under a temporary name.

use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};

/// A temporary file, which is removed unless it has got its name: on a full disk half a file helps nobody, and takes the last room.
pub(crate) struct Unfinished(PathBuf);

impl Unfinished {
    /// A file of this path.
    pub(crate) fn at(path: PathBuf) -> Self {
        Self(path)
    }

    /// One beside the file that it is to become, with `.part` behind its name.
    pub(crate) fn beside(path: &Path) -> Self {
        Self(
            [path.as_os_str(), OsStr::new(".part")]
                .into_iter()
                .collect::<std::ffi::OsString>()
                .into(),
        )
    }

    /// The temporary file.
    pub(crate) fn path(&self) -> &Path {
        &self.0
    }

    /// Gives it its name.
    pub(crate) fn becomes(self, path: &Path) -> io::Result<()> {
        std::fs::rename(&self.0, path)
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        // A finished file was renamed, and this one does not exist.
        let _ = std::fs::remove_file(&self.0);
    }
}
