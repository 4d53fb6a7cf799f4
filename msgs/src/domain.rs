//! Values that flow between the nodes of one process as themselves, each with the message that others get.

use geometry::{Cloud, CycleTracks, DetectedCycle, SegmentedCycle};

use crate::RosMessage;
use crate::convert::{self, ConvertError};
use crate::sensor_msgs::PointCloud2;
use crate::stillmap_msgs::{ReducedCloud, SegmentedCloud, Tracks};

/// A value that is handed from node to node within a process, and leaves it as a message: the message is made only when
/// somebody wants it (as REP-2007 has it of adapted types).
pub trait Domain: Send + Sync + Sized + 'static {
    /// Its message outside of the process.
    type Message: RosMessage;

    /// The message of the value.
    fn to_message(&self) -> Self::Message;

    /// The value of a message.
    ///
    /// # Errors
    /// When the message is no such value.
    fn from_message(message: &Self::Message) -> Result<Self, ConvertError>;
}

impl Domain for DetectedCycle {
    type Message = ReducedCloud;

    fn to_message(&self) -> ReducedCloud {
        convert::message_from_detected_cycle(self)
    }

    fn from_message(message: &ReducedCloud) -> Result<Self, ConvertError> {
        convert::detected_cycle_from_message(message)
    }
}

impl Domain for SegmentedCycle {
    type Message = SegmentedCloud;

    fn to_message(&self) -> SegmentedCloud {
        convert::message_from_segmented_cycle(self)
    }

    fn from_message(message: &SegmentedCloud) -> Result<Self, ConvertError> {
        convert::segmented_cycle_from_message(message)
    }
}

impl Domain for Cloud {
    type Message = PointCloud2;

    fn to_message(&self) -> PointCloud2 {
        convert::message_from_cloud(self)
    }

    fn from_message(message: &PointCloud2) -> Result<Self, ConvertError> {
        convert::cloud_from_message(message)
    }
}

impl Domain for CycleTracks {
    type Message = Tracks;

    fn to_message(&self) -> Tracks {
        convert::message_from_tracks(self)
    }

    fn from_message(message: &Tracks) -> Result<Self, ConvertError> {
        convert::tracks_from_message(message)
    }
}
