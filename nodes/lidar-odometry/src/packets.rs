//! The packets of a Velodyne: UDP payloads to returns of lasers (Road LiDAR, section 2.3; the user's manuals).
//!
//! | file | what |
//! |---|---|
//! | `data_packet` | the layout of the 1206 bytes |
//! | `model` | which model, when its lasers fire, which echoes it reports |
//! | `calibration` | the direction of each laser: by the data sheet, or by the scanner's own file |
//! | `laser` | from range and azimuth to a point |
//! | `decoder` | all of these: a packet to shots |
//! | `clock` | the moment of a packet |
//! | `position_packet`, `gprmc` | the other packets: time, and the sentence of a GPS receiver |
//! | `continuity` | how many packets were lost in transit |
//!
//! # Angles
//!
//! As the scanner reports it, `azimuth_deg` is clockwise seen from above, 0 forward. Points are in the frame of REP-103:
//! x forward, y left, z up. An elevation is above the horizon.
#![cfg_attr(not(test), deny(clippy::indexing_slicing))]

mod calibration;
mod clock;
mod continuity;
mod data_packet;
mod decoder;
#[cfg(test)]
pub(crate) mod encoder;
mod error;
mod gprmc;
mod laser;
mod model;
mod position_packet;

pub use calibration::{Calibration, CalibrationError, CalibrationFileError, LaserCalibration};
pub(crate) use continuity::elapsed_us;
pub use continuity::{Continuity, LossCounts};
pub use data_packet::DataPacket;
pub use decoder::{
    DecodeError, DecodedPacket, DecoderConfig, DecoderConfigError, Echo, Firing, PacketDecoder,
    Shot,
};
pub use error::PacketError;
pub use gprmc::{Gprmc, GprmcError};
pub use model::{Model, PACKET_BYTES, ReturnMode};
pub use position_packet::{POSITION_PACKET_BYTES, PositionPacket, PositionPacketError, PpsStatus};

/// The UDP port that data packets are sent to, unless the scanner is configured otherwise.
pub const DATA_PORT: u16 = 2368;
/// The UDP port of position packets.
pub const POSITION_PORT: u16 = 8308;
