//! Position packets: the scanner's clock, and what its GPS receiver said last.

use super::gprmc::{Gprmc, GprmcError};

/// Bytes of a position packet.
pub const POSITION_PACKET_BYTES: usize = 512;

/// Where the timestamp is (VLP-16 user's manual, section 9.3.3); the HDL-32E has the readings of its gyroscopes before.
const TIMESTAMP_AT: usize = 198;
const PPS_AT: usize = 202;
const SENTENCE_AT: usize = 206;

/// A position packet.
#[derive(Clone, PartialEq, Debug)]
pub struct PositionPacket {
    /// When it was made, in microseconds since the hour, by the same clock as data packets.
    pub timestamp_us: u32,
    /// Whether that clock follows GPS.
    pub pps: PpsStatus,
    /// The sentence of the receiver; `None` without a receiver.
    pub gprmc: Option<Gprmc>,
}

/// The pulse per second of the GPS receiver, as the scanner sees it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum PpsStatus {
    /// No pulse.
    Absent,
    /// The clock is being set by it.
    Synchronizing,
    /// The clock follows it.
    Locked,
    /// The pulse is there, but not regular.
    Error,
    /// A status of newer firmware.
    Unknown(u8),
}

/// Why bytes are no position packet.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum PositionPacketError {
    /// The datagram has another length.
    #[error("a position packet has {POSITION_PACKET_BYTES} bytes, not {found}")]
    Length {
        /// Its length in bytes.
        found: usize,
    },
    /// The sentence in it is broken.
    #[error(transparent)]
    Sentence(#[from] GprmcError),
}

impl PositionPacket {
    /// The packet in the payload of a datagram.
    ///
    /// # Errors
    /// When the length is another, or the receiver's sentence cannot be read.
    pub fn parse(bytes: &[u8]) -> Result<Self, PositionPacketError> {
        if bytes.len() != POSITION_PACKET_BYTES {
            return Err(PositionPacketError::Length { found: bytes.len() });
        }
        let mut timestamp_us = [0; 4];
        timestamp_us.copy_from_slice(bytes.get(TIMESTAMP_AT..PPS_AT).unwrap_or(&[0; 4]));
        let pps = match bytes.get(PPS_AT).copied().unwrap_or_default() {
            0 => PpsStatus::Absent,
            1 => PpsStatus::Synchronizing,
            2 => PpsStatus::Locked,
            3 => PpsStatus::Error,
            other => PpsStatus::Unknown(other),
        };
        let sentence = bytes.get(SENTENCE_AT..).unwrap_or_default();
        let end = sentence.iter().position(|&byte| matches!(byte, 0 | b'\r' | b'\n'));
        let sentence = sentence.get(..end.unwrap_or(sentence.len())).unwrap_or_default();
        let gprmc = if sentence.is_empty() { None } else { Some(Gprmc::parse(sentence)?) };
        Ok(Self { timestamp_us: u32::from_le_bytes(timestamp_us), pps, gprmc })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn with_sentence(sentence: &str) -> Vec<u8> {
        let mut bytes = vec![0; POSITION_PACKET_BYTES];
        bytes[198..202].copy_from_slice(&1_082_341_000_u32.to_le_bytes());
        bytes[202] = 2;
        bytes[206..206 + sentence.len()].copy_from_slice(sentence.as_bytes());
        bytes
    }

    #[test]
    fn clock_pulse_and_sentence_are_read() {
        let sentence =
            "$GPRMC,081802.00,A,3649.7478558,N,00224.4542928,W,0.034,212.5,210116,0.0,E,A*2E\r\n";
        let packet = PositionPacket::parse(&with_sentence(sentence)).unwrap();
        assert_eq!((packet.timestamp_us, packet.pps), (1_082_341_000, PpsStatus::Locked));
        assert!((packet.gprmc.unwrap().latitude_deg.unwrap() - 36.829_130_93).abs() < 1e-8);
        assert_eq!(PositionPacket::parse(&with_sentence("")).unwrap().gprmc, None);
    }

    #[test]
    fn what_is_wrong_is_said() {
        let error = PositionPacket::parse(&[0; 1206]).unwrap_err();
        assert_eq!(error.to_string(), "a position packet has 512 bytes, not 1206");
        let error = PositionPacket::parse(&with_sentence("$GPRMC,1*00")).unwrap_err();
        assert!(matches!(error, PositionPacketError::Sentence(_)), "{error}");
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(bytes in proptest::collection::vec(any::<u8>(), 512), sentence in ".{0,60}") {
            let _ = PositionPacket::parse(&bytes);
            let _ = PositionPacket::parse(&with_sentence(&sentence));
        }
    }
}
