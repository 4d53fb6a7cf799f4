//! The kind of a file that is not an MCAP bag, and the fix.

use std::fmt;

/// A file that was given as a bag but is not one.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum ForeignFile {
    /// A ROS 1 bag.
    Ros1Bag,
    /// A file compressed with zstd as a whole.
    Zstd,
    /// A pointer that Git LFS left in place of the file.
    LfsPointer,
    /// Something else; its first bytes.
    Unknown(Vec<u8>),
}

/// How many bytes [`sniff`] needs to distinguish the known kinds.
pub(crate) const SNIFF_BYTES: usize = 32;

/// The kind of a file by its first bytes.
pub(crate) enum FileKind {
    Mcap,
    Sqlite3,
    Foreign(ForeignFile),
}

/// Recognises a file by its first bytes.
pub(crate) fn sniff(start: &[u8]) -> FileKind {
    if start.starts_with(mcap::MAGIC) {
        return FileKind::Mcap;
    }
    if start.starts_with(b"SQLite format 3\0") {
        return FileKind::Sqlite3;
    }
    FileKind::Foreign(if start.starts_with(b"#ROSBAG V") {
        ForeignFile::Ros1Bag
    } else if start.starts_with(&[0x28, 0xb5, 0x2f, 0xfd]) {
        ForeignFile::Zstd
    } else if start.starts_with(b"version https://git-lfs") {
        ForeignFile::LfsPointer
    } else {
        ForeignFile::Unknown(start.iter().copied().take(mcap::MAGIC.len()).collect())
    })
}

impl fmt::Display for ForeignFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ros1Bag => {
                write!(
                    f,
                    "it is a ROS 1 bag; convert it (`mcap convert in.bag out.mcap` keeps ROS 1 messages, `rosbags-convert` makes ROS 2 ones)"
                )
            }
            Self::Zstd => {
                write!(f, "it is compressed as a whole; run `zstd -d` on it first")
            }
            Self::LfsPointer => {
                write!(f, "it is only the pointer that Git LFS left here; run `git lfs pull`")
            }
            Self::Unknown(start) => {
                write!(f, "it begins with")?;
                for byte in start {
                    write!(f, " {byte:02x}")?;
                }
                write!(
                    f,
                    " where an MCAP file has 89 4d 43 41 50 30 0d 0a; give an .mcap file or a rosbag2 directory"
                )
            }
        }
    }
}
