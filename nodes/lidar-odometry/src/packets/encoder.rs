//! Packets as a scanner would send them, written byte by byte from the manuals and not from the decoder.

use super::{Model, ReturnMode};

/// A scanner that turns evenly.
pub(crate) struct Encoder {
    pub(crate) model: Model,
    pub(crate) return_mode: ReturnMode,
    pub(crate) turn_rate_hz: f64,
    /// Clockwise from forward, at the first firing.
    pub(crate) start_azimuth_deg: f64,
    /// Of the first firing.
    pub(crate) start_us: u32,
}

/// The echoes of a laser: range and intensity of the last echo and of the other.
pub(crate) type Echoes = [Option<(f64, u8)>; 2];

impl Encoder {
    pub(crate) fn new(model: Model, return_mode: ReturnMode) -> Self {
        Self {
            model,
            return_mode,
            turn_rate_hz: 10.0,
            start_azimuth_deg: 180.0,
            start_us: 1_000_000,
        }
    }

    /// Firings of all lasers in a packet.
    pub(crate) fn firings_per_packet(&self) -> usize {
        let single = match self.model {
            Model::Vlp16 | Model::PuckHiRes => 24,
            Model::Hdl32e | Model::Vlp32c => 12,
            Model::Hdl64e => 6,
        };
        if self.return_mode == ReturnMode::Dual { single / 2 } else { single }
    }

    /// This many packets; `echoes` gives the echoes of a laser at a firing, counted from the first of all.
    pub(crate) fn packets(
        &self,
        count: usize,
        mut echoes: impl FnMut(usize, usize) -> Echoes,
    ) -> Vec<Vec<u8>> {
        (0..count).map(|packet| self.packet(packet, &mut echoes)).collect()
    }

    fn packet(&self, packet: usize, echoes: &mut impl FnMut(usize, usize) -> Echoes) -> Vec<u8> {
        let first = packet * self.firings_per_packet();
        let period_s = self.model.firing_period_s();
        let mut bytes = Vec::with_capacity(1206);
        let dual = self.return_mode == ReturnMode::Dual;
        let copies = if dual { 2 } else { 1 };
        let (banks, firings_per_block) = match self.model {
            Model::Hdl64e => (2, 1),
            Model::Vlp16 | Model::PuckHiRes => (1, 2),
            Model::Hdl32e | Model::Vlp32c => (1, 1),
        };
        let lasers = 32 / firings_per_block;
        for block in (0..self.firings_per_packet()).step_by(firings_per_block) {
            let firing = first + block;
            let turned_deg = 360.0 * self.turn_rate_hz * period_s * firing as f64;
            let azimuth = ((self.start_azimuth_deg + turned_deg) * 100.0).round() as u64 % 36_000;
            for echo in 0..copies {
                for bank in 0..banks {
                    bytes.extend([0xff, if bank == 0 { 0xee } else { 0xdd }]);
                    bytes.extend((azimuth as u16).to_le_bytes());
                    for within in 0..firings_per_block {
                        for laser in 0..lasers {
                            let seen = echoes(firing + within, bank * 32 + laser)[echo];
                            let (range_m, intensity) = seen.unwrap_or((0.0, 0));
                            let units = (range_m / self.model.range_step_m()).round() as u16;
                            bytes.extend(units.to_le_bytes());
                            bytes.push(intensity);
                        }
                    }
                }
            }
        }
        let time_us = (first as f64 * period_s * 1e6).round() as u64 + u64::from(self.start_us);
        bytes.extend(((time_us % 3_600_000_000) as u32).to_le_bytes());
        bytes.push(match self.return_mode {
            ReturnMode::Strongest => 0x37,
            ReturnMode::Last => 0x38,
            ReturnMode::Dual => 0x39,
        });
        bytes.push(match self.model {
            Model::Hdl32e => 0x21,
            Model::Vlp16 => 0x22,
            Model::PuckHiRes => 0x24,
            Model::Vlp32c => 0x28,
            // A byte of its status.
            Model::Hdl64e => 0x47,
        });
        bytes
    }
}
