//! Recorded bags: reading MCAP, rosbag2's sqlite3 and bags of ROS 1, writing MCAP, rosbag2 directories, and the
//! schedule of their playback.
//!
//! Without the feature `ros` this is a library of files: [`Bag`] reads, [`BagWriter`] writes,
//! [`Schedule`] decides when each message is published. With it, the module `shell` plays a bag over DDS.
//!
//! The reader streams: of a file it keeps the index and the chunks of the current time in memory. The checksum
//! of a chunk is checked before any of its messages is returned; chunks are decompressed by the reader of the
//! mcap crate. Chunks are ordered here, since the indexed reader of that crate checks no checksum and cannot
//! continue after a damaged chunk.
#![cfg_attr(not(test), deny(clippy::indexing_slicing))]

mod bag;
mod catalogue;
mod compression;
mod error;
mod foreign;
mod index;
mod info;
mod message;
mod messages;
mod qos;
mod record;
mod ros1;
mod rosbag2;
mod schedule;
mod segment;
#[cfg(feature = "ros")]
pub mod shell;
mod source;
mod sqlite;
mod summary;
mod temporary;
mod writer;

pub use bag::{Bag, DEFAULT_MERGE_WINDOW_BYTES};
pub use error::{BagError, Loss, LossKind};
pub use foreign::{ForeignFile, begins_as_a_bag};
pub use info::{BagInfo, FileInfo, Storage, TopicInfo};
pub use message::{BagMessage, CDR, Selection};
pub use messages::{Messages, Skipped};
pub use qos::{Durability, OfferedQos, Reliability};
pub use ros1::{
    DefinitionError, LeftOut, Ros1Conversion, Ros1Error, TranscodeError, convert_ros1, is_ros1,
};
pub use schedule::{Decision, RateError, Schedule};
pub use temporary::TemporaryFolder;
pub use writer::{BagSummary, BagWriter, ChannelId};

#[cfg(test)]
mod tests;
