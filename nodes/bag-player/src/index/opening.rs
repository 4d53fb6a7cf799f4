//! Opening a file by its recognised format.

use std::path::Path;
use std::sync::Arc;

use super::FileIndex;
use crate::compression;
use crate::error::BagError;
use crate::foreign::{self, FileKind, ForeignFile};
use crate::info::Storage;
use crate::ros1;
use crate::sqlite::{self, Database, Paths};
use crate::temporary::Temporary;

impl FileIndex {
    /// Opens a file and indexes it.
    pub(crate) fn open(path: &Path, goes_on: &dyn Fn() -> bool) -> Result<Self, BagError> {
        match kind_of(path, path)? {
            FileKind::Zstd => {
                let (temporary, loss) = compression::unpack(path, goes_on)?;
                let index = match kind_of(path, temporary.path())? {
                    FileKind::Zstd => {
                        let start = compression::ZSTD_MAGIC.to_vec();
                        let found = ForeignFile::Compressed(Box::new(ForeignFile::Unknown(start)));
                        return Err(BagError::NotABag { path: path.to_owned(), found });
                    }
                    FileKind::Foreign(found) => {
                        let found = ForeignFile::Compressed(Box::new(found));
                        return Err(BagError::NotABag { path: path.to_owned(), found });
                    }
                    kind => Self::of_kind(&kind, (path, temporary.path()), goes_on)?,
                };
                let mut index = Self { is_packed: true, ..index };
                index.losses.extend(loss);
                Ok(index.read_from(path, temporary))
            }
            FileKind::Foreign(found) => Err(BagError::NotABag { path: path.to_owned(), found }),
            kind => Self::of_kind(&kind, (path, path), goes_on),
        }
    }

    /// Opens the content of the file `named`, which may be in the temporary file `opened`.
    fn of_kind(
        kind: &FileKind,
        (named, opened): (&Path, &Path),
        goes_on: &dyn Fn() -> bool,
    ) -> Result<Self, BagError> {
        match kind {
            FileKind::Sqlite3 => match sqlite::without_cut_page(Paths { named, opened })? {
                Some(whole) => {
                    let index = Self::of_database(Paths { named, opened: whole.path() })?;
                    Ok(index.read_from(named, whole))
                }
                None => Self::of_database(Paths { named, opened }),
            },
            FileKind::Ros1 => Self::of_ros1(named, opened, goes_on),
            _ => Self::of_mcap(opened),
        }
    }

    fn of_database(paths: Paths<'_>) -> Result<Self, BagError> {
        let (database, losses) = Database::open(paths)?;
        let refused = |source| BagError::Open { path: paths.named.to_owned(), source };
        let size_bytes = std::fs::metadata(paths.named).map_err(refused)?.len();
        Ok(Self {
            profile: "ros2".to_owned(),
            library: database.writer.clone(),
            indexed: true,
            database: Some(database),
            losses,
            ..Self::empty(paths.named, size_bytes, Storage::Sqlite3)
        })
    }

    fn of_ros1(named: &Path, opened: &Path, goes_on: &dyn Fn() -> bool) -> Result<Self, BagError> {
        let (temporary, losses) = ros1::converted(opened, goes_on)?;
        let mut index = Self::of_mcap(temporary.path())?;
        index.losses.extend(losses);
        index.storage = Storage::Ros1;
        index.remark = Some(format!(
            "{path} is a bag of ROS 1 and is converted whenever it is read; `stillmap import bag {path} -o {to}` does it \
             once",
            path = named.display(),
            to = named.with_extension("mcap").display(),
        ));
        Ok(index.read_from(named, temporary))
    }

    /// The same index, of the file `named`, whose content is in a temporary file.
    fn read_from(mut self, named: &Path, temporary: Temporary) -> Self {
        for loss in &mut self.losses {
            named.clone_into(&mut loss.file);
        }
        named.clone_into(&mut self.path);
        self.size_bytes = std::fs::metadata(named).map_or(0, |metadata| metadata.len());
        // The content of a compressed file may itself have been converted: the last temporary file is read.
        self.temporary.get_or_insert(Arc::new(temporary));
        self
    }
}

/// The format of the content of the file `named`, which may be in the temporary file `opened`.
fn kind_of(named: &Path, opened: &Path) -> Result<FileKind, BagError> {
    match foreign::kind_of(opened) {
        Ok(FileKind::Empty) => Err(BagError::Empty { path: named.to_owned() }),
        Ok(kind) => Ok(kind),
        Err(source) => Err(BagError::Open { path: named.to_owned(), source }),
    }
}
