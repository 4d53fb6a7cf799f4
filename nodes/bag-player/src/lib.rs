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
//!
//! ```
//! use bag_player::{Bag, BagWriter, OfferedQos, Selection};
//! use geometry::Stamp;
//! use msgs::sensor_msgs::LaserScan;
//!
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("scans.mcap");
//! let mut writer = BagWriter::create(&path)?;
//! let channel = writer.channel::<LaserScan>("/scan", OfferedQos::sensor(5))?;
//! let scan = LaserScan { ranges: vec![1.0, 2.0], ..LaserScan::default() };
//! writer.write(channel, Stamp::from_secs_nanos(1, 0), &scan)?;
//! writer.finish()?;
//!
//! // A rosbag2 folder, a sqlite3 file or a bag of ROS 1 alike.
//! let bag = Bag::open(&path)?;
//! let mut messages = bag.messages(&Selection::default())?;
//! for message in &mut messages {
//!     let message = message?;
//!     let scan: LaserScan = message.decode()?;
//!     assert_eq!((&*message.topic, scan.ranges.len()), ("/scan", 2));
//! }
//! assert!(messages.losses().is_empty(), "what was damaged is left out, and told");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
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
