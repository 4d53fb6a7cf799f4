//! Recognition of a file by its content.

use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use crate::compression::ZSTD_MAGIC;

/// A file that is not a bag.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum ForeignFile {
    /// The pointer that Git LFS puts in place of a file.
    LfsPointer,
    /// A file compressed with zstd as a whole whose content is not a bag.
    Compressed(Box<ForeignFile>),
    /// Another file, with its first bytes.
    Unknown(Vec<u8>),
}

/// The number of bytes that distinguish the known kinds.
const SNIFF_BYTES: u64 = 32;

/// The kind of a file by its first bytes.
#[derive(PartialEq, Eq, Debug)]
pub(crate) enum FileKind {
    /// Empty.
    Empty,
    Mcap,
    Sqlite3,
    Ros1,
    /// Compressed as a whole.
    Zstd,
    Foreign(ForeignFile),
}

/// Whether a file begins like one of the formats that [`crate::Bag::open`] reads.
///
/// # Errors
/// When it cannot be read.
pub fn begins_as_a_bag(path: &Path) -> io::Result<bool> {
    Ok(!matches!(kind_of(path)?, FileKind::Empty | FileKind::Foreign(_)))
}

/// The kind of a file by its content.
pub(crate) fn kind_of(path: &Path) -> io::Result<FileKind> {
    // Opening a pipe waits for who writes into it.
    if !std::fs::metadata(path)?.is_file() {
        let what =
            "it is no file; a bag is read more than once, which a pipe or a device does not allow";
        return Err(io::Error::new(io::ErrorKind::Unsupported, what));
    }
    let mut start = Vec::new();
    File::open(path)?.take(SNIFF_BYTES).read_to_end(&mut start)?;
    Ok(if start.is_empty() { FileKind::Empty } else { sniff(&start) })
}

/// Recognises a file by its first bytes.
fn sniff(start: &[u8]) -> FileKind {
    if start.starts_with(mcap::MAGIC) {
        FileKind::Mcap
    } else if start.starts_with(b"SQLite format 3\0") {
        FileKind::Sqlite3
    } else if start.starts_with(b"#ROSBAG V") {
        FileKind::Ros1
    } else if start.starts_with(&ZSTD_MAGIC) {
        FileKind::Zstd
    } else if start.starts_with(b"version https://git-lfs") {
        FileKind::Foreign(ForeignFile::LfsPointer)
    } else {
        let start = start.iter().copied().take(mcap::MAGIC.len()).collect();
        FileKind::Foreign(ForeignFile::Unknown(start))
    }
}

impl fmt::Display for ForeignFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LfsPointer => {
                write!(f, "it is only the pointer that Git LFS left here; run `git lfs pull`")
            }
            Self::Compressed(content) => {
                write!(f, "it is compressed with zstd, and within it {content}")
            }
            Self::Unknown(start) => {
                write!(f, "it begins with")?;
                for byte in start {
                    write!(f, " {byte:02x}")?;
                }
                write!(
                    f,
                    ", not as a bag: MCAP has 89 4d 43 41 50 30 0d 0a, sqlite3 `SQLite format 3`, ROS 1 `#ROSBAG V2.0`; \
                     give such a file or a rosbag2 folder"
                )
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: a program that was given a pipe waited for ever, without a word.
    #[test]
    fn a_pipe_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pipe.mcap");
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        assert_eq!(kind_of(&path).unwrap_err().kind(), io::ErrorKind::Unsupported);
        let said = crate::Bag::open(&path).map(drop).unwrap_err().to_string();
        assert!(said.contains("it is no file"), "{said}");
    }
}
