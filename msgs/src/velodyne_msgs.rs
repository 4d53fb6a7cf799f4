//! `velodyne_msgs`: what `velodyne_driver` publishes before anything is decoded.

use serde::{Deserialize, Serialize};

use crate::builtin_interfaces::Time;
use crate::fixed_array;
use crate::std_msgs::Header;

/// A data packet of a Velodyne scanner.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct VelodynePacket {
    /// When it arrived.
    pub stamp: Time,
    /// As it came.
    #[serde(with = "fixed_array")]
    pub data: [u8; Self::BYTES],
}
ros_message!(VelodynePacket, "velodyne_msgs");

impl VelodynePacket {
    /// Bytes of every data packet.
    pub const BYTES: usize = 1206;
}

impl Default for VelodynePacket {
    fn default() -> Self {
        Self { stamp: Time::default(), data: [0; Self::BYTES] }
    }
}

/// The data packets of about one revolution of a Velodyne scanner.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct VelodyneScan {
    /// The frame of the scanner, and when the first of the packets arrived.
    pub header: Header,
    /// In the order in which they came.
    pub packets: Vec<VelodynePacket>,
}
ros_message!(VelodyneScan, "velodyne_msgs");
