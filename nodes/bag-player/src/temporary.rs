//! Temporary files, for bags that are compressed as a whole and bags of ROS 1.

use std::io;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use crate::error::BagError;

/// A file in a separate folder below the system's folder for temporary files. Both are removed when the last
/// reader is dropped.
#[derive(Debug)]
pub(crate) struct Temporary {
    path: PathBuf,
    folder: TempDir,
}

impl Temporary {
    /// A path for the content of `original`; the file is not created yet.
    pub(crate) fn place_for(original: &Path) -> Result<Self, BagError> {
        let folder = tempfile::Builder::new()
            .prefix("stillmap-bag-")
            .tempdir()
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
