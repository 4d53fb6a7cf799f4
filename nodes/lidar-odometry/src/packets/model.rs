//! The models whose packets are decoded: how they number their lasers, and when these fire.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::{data_packet::BlockLayout, error::PacketError};

/// Bytes of every data packet (the UDP payload; a frame of 1248 bytes with 42 of headers, Road LiDAR section 2.3).
pub const PACKET_BYTES: usize = 1206;
/// Blocks of a data packet.
pub(super) const BLOCKS: usize = 12;
/// Shots of a block.
pub(super) const SHOTS: usize = 32;

/// A model of Velodyne.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Model {
    /// 32 lasers from -30.67 to 10.67 degrees.
    Hdl32e,
    /// 16 lasers from -15 to 15 degrees; the Puck and the Puck LITE.
    Vlp16,
    /// 16 lasers from -10 to 10 degrees.
    PuckHiRes,
    /// 32 lasers from -25 to 15 degrees, close together at the horizon; the Ultra Puck.
    Vlp32c,
    /// 64 lasers from -24.33 to 2 degrees in two banks; S2 and S3. Times within a packet are those of the S2; an S3
    /// that fires every 57.6 us in place of 48 us is late by up to 50 us.
    Hdl64e,
}

impl fmt::Display for Model {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Hdl32e => "HDL-32E",
            Self::Vlp16 => "VLP-16",
            Self::PuckHiRes => "Puck Hi-Res",
            Self::Vlp32c => "VLP-32C",
            Self::Hdl64e => "HDL-64E",
        })
    }
}

impl Model {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Hdl32e, Self::Vlp16, Self::PuckHiRes, Self::Vlp32c, Self::Hdl64e];

    /// Lasers.
    #[must_use]
    pub fn lasers(self) -> usize {
        match self {
            Self::Vlp16 | Self::PuckHiRes => 16,
            Self::Hdl32e | Self::Vlp32c => 32,
            Self::Hdl64e => 64,
        }
    }

    /// Seconds from one firing of all lasers to the next. From the user's manuals; of the HDL-64E S2
    /// and S3 by their 3472 packets of six firings a second.
    #[must_use]
    pub fn firing_period_s(self) -> f64 {
        match self {
            Self::Hdl32e => 46.08e-6,
            Self::Vlp16 | Self::PuckHiRes | Self::Vlp32c => 55.296e-6,
            Self::Hdl64e => 48.0e-6,
        }
    }

    /// Seconds from the first laser of a firing to this one; the same manuals.
    #[must_use]
    pub fn laser_delay_s(self, laser: usize) -> f64 {
        match self {
            Self::Hdl32e => 1.152e-6 * laser as f64,
            Self::Vlp16 | Self::PuckHiRes => 2.304e-6 * laser as f64,
            // Two at a time.
            Self::Vlp32c => 2.304e-6 * (laser / 2) as f64,
            Self::Hdl64e => {
                // Both banks at once, each in groups of four.
                const GROUP_S: f64 = 6.0e-6;
                const WITHIN_GROUP_S: [f64; 4] = [0.0, 1.26e-6, 2.46e-6, 3.66e-6];
                let in_bank = laser % SHOTS;
                let within = WITHIN_GROUP_S.get(in_bank % 4).copied().unwrap_or(0.0);
                GROUP_S * (in_bank / 4) as f64 + within
            }
        }
    }

    /// The range of one unit of a packet.
    #[must_use]
    pub fn range_step_m(self) -> f64 {
        match self {
            Self::Vlp32c => 0.004,
            Self::Hdl32e | Self::Vlp16 | Self::PuckHiRes | Self::Hdl64e => 0.002,
        }
    }

    /// Firings of all lasers in a packet.
    #[must_use]
    pub fn firings(self, return_mode: ReturnMode) -> usize {
        let single = match self {
            Self::Vlp16 | Self::PuckHiRes => 2 * BLOCKS,
            Self::Hdl32e | Self::Vlp32c => BLOCKS,
            Self::Hdl64e => BLOCKS / 2,
        };
        if return_mode == ReturnMode::Dual { single / 2 } else { single }
    }

    /// Seconds from one packet to the next.
    #[must_use]
    pub fn packet_period_s(self, return_mode: ReturnMode) -> f64 {
        self.firing_period_s() * self.firings(return_mode) as f64
    }

    /// The model that a packet is of: of an HDL-64E by its two banks, of all others by the product id.
    pub(super) fn detect(layout: BlockLayout, product: u8) -> Result<Self, PacketError> {
        let unsupported = |name| Err(PacketError::UnsupportedProduct { id: product, name });
        match (layout, product) {
            (BlockLayout::TwoBanks, _) => Ok(Self::Hdl64e),
            // VLP-16 user's manual, table 9-2; the VLS-128 says 0xa1 in its own.
            (BlockLayout::OneBank, 0x21) => Ok(Self::Hdl32e),
            (BlockLayout::OneBank, 0x22) => Ok(Self::Vlp16),
            (BlockLayout::OneBank, 0x24) => Ok(Self::PuckHiRes),
            (BlockLayout::OneBank, 0x28) => Ok(Self::Vlp32c),
            (BlockLayout::OneBank, 0x31) => unsupported("Velarray"),
            (BlockLayout::OneBank, 0x63 | 0xa1) => unsupported(VLS_128),
            (BlockLayout::OneBank, id) => Err(PacketError::UnknownProduct { id }),
        }
    }
}

/// The name of the model with four banks.
pub(super) const VLS_128: &str = "VLS-128";

/// Which of the echoes of a shot a packet contains.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReturnMode {
    /// The strongest.
    Strongest,
    /// The last.
    Last,
    /// The strongest and the last; the second strongest where these are one.
    Dual,
}

impl ReturnMode {
    /// From the last byte but one of a packet (VLP-16 user's manual, table 9-2).
    pub(super) fn detect(byte: u8) -> Result<Self, PacketError> {
        match byte {
            0x37 => Ok(Self::Strongest),
            0x38 => Ok(Self::Last),
            0x39 => Ok(Self::Dual),
            mode => Err(PacketError::UnknownReturnMode { mode }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_firing_ends_before_the_next_and_its_lasers_follow_each_other() {
        for model in Model::ALL {
            let delays_s: Vec<f64> =
                (0..model.lasers()).map(|laser| model.laser_delay_s(laser)).collect();
            let bank = delays_s.len().min(SHOTS);
            assert!(delays_s[..bank].windows(2).all(|pair| pair[0] <= pair[1]), "{model}");
            assert!(delays_s.iter().all(|delay_s| *delay_s < model.firing_period_s()), "{model}");
        }
    }

    #[test]
    fn packets_come_at_the_rates_of_the_manuals() {
        let rate_hz = |model: Model, mode| (1.0 / model.packet_period_s(mode)).round() as u32;
        assert_eq!(rate_hz(Model::Hdl64e, ReturnMode::Strongest), 3472);
        assert_eq!(rate_hz(Model::Hdl32e, ReturnMode::Strongest), 1808);
        assert_eq!(rate_hz(Model::Vlp16, ReturnMode::Last), 754);
        assert_eq!(rate_hz(Model::Vlp16, ReturnMode::Dual), 1507);
        assert_eq!(rate_hz(Model::Vlp32c, ReturnMode::Strongest), 1507);
    }

    #[test]
    fn products_that_are_not_decoded_are_named() {
        let error = Model::detect(BlockLayout::OneBank, 0xa1).unwrap_err();
        assert_eq!(error.to_string(), "packets of the VLS-128 (product id 0xa1) are not decoded");
        let error = Model::detect(BlockLayout::OneBank, 7).unwrap_err();
        assert!(matches!(error, PacketError::UnknownProduct { id: 7 }));
        assert!(error.to_string().starts_with("the product id 0x07 is not known"));
    }
}
