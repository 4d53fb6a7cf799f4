//! From the bytes of a packet to what the lasers saw.

mod config;
mod echo;

use std::sync::Arc;

use nalgebra::Point3;

use super::calibration::{Calibration, CalibrationError};
use super::data_packet::{Block, BlockLayout, DataPacket};
use super::error::PacketError;
use super::laser::Laser;
use super::model::{BLOCKS, Model, ReturnMode, SHOTS};
use echo::Echoes;

pub use config::{DecoderConfig, DecoderConfigError};
pub use echo::Echo;

/// A decoded packet.
#[derive(Clone, PartialEq, Debug)]
pub struct DecodedPacket {
    /// The model that sent it.
    pub model: Model,
    /// Which echoes it holds.
    pub return_mode: ReturnMode,
    /// When the first laser of the first firing fired, in microseconds since the hour, by the scanner's clock.
    pub timestamp_us: u32,
    /// The elevations of the rows, the highest first.
    pub elevations_rad: Arc<[f32]>,
    /// The firings of all lasers, in the order of time.
    pub firings: Vec<Firing>,
    /// The returns, firing by firing; without a return there is no shot.
    pub shots: Vec<Shot>,
}

/// One firing of all lasers.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Firing {
    /// Where the head looked when the first laser fired: clockwise from forward, within 0 .. 360.
    pub azimuth_deg: f64,
    /// When the first laser fired, since the first firing of the packet.
    pub time_s: f64,
}

/// A return of a laser.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Shot {
    /// Which firing of the packet, from 0.
    pub firing: u16,
    /// The laser's place by elevation: 0 is the highest.
    pub row: u16,
    /// Which echo.
    pub echo: Echo,
    /// As the packet reports it.
    pub intensity: u8,
    /// When the laser fired, since the first firing of the packet.
    pub time_s: f32,
    /// The corrected range.
    pub range_m: f32,
    /// In the scanner's frame: x forward, y left, z up.
    pub position_m: Point3<f32>,
}

/// Decodes the packets of one scanner.
#[derive(Clone, Debug)]
pub struct PacketDecoder {
    config: DecoderConfig,
    /// From the first packet on.
    table: Option<Table>,
}

#[derive(Clone, Debug)]
struct Table {
    model: Model,
    range_step_m: f64,
    elevations_rad: Arc<[f32]>,
    /// In the order of the packet, each with its row.
    lasers: Vec<(Laser, u16)>,
}

/// Why a packet gives nothing.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum DecodeError {
    /// The packet is at fault.
    #[error(transparent)]
    Packet(#[from] PacketError),
    /// The calibration is not one of the model that the packet is of.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
}

impl PacketDecoder {
    /// A decoder for the packets of one scanner; the first packet names the model.
    ///
    /// # Errors
    /// When the configuration does not hold.
    pub fn new(config: DecoderConfig) -> Result<Self, DecoderConfigError> {
        config.validate()?;
        Ok(Self { config, table: None })
    }

    /// Decodes the payload of a datagram.
    ///
    /// # Errors
    /// When it is no data packet, not one of the scanner that the ones before came from, or the configured
    /// calibration is not one of its model. The decoder can go on with the next.
    pub fn decode(&mut self, bytes: &[u8]) -> Result<DecodedPacket, DecodeError> {
        let packet = DataPacket::parse(bytes)?;
        let model = self.model_of(&packet)?;
        let return_mode = match self.config.return_mode {
            Some(return_mode) => return_mode,
            None => packet.return_mode()?,
        };
        let table = match &self.table {
            Some(table) => table,
            None => self.table.insert(Table::new(model, self.config.calibration.as_ref())?),
        };
        if model != table.model {
            return Err(PacketError::OtherModel { expected: table.model, found: model }.into());
        }
        Ok(table.decode(&packet, return_mode, &self.config)?)
    }

    fn model_of(&self, packet: &DataPacket<'_>) -> Result<Model, PacketError> {
        let Some(stated) = self.config.model else { return packet.model() };
        let two_banks = stated == Model::Hdl64e;
        if two_banks == (packet.layout() == BlockLayout::TwoBanks) {
            return Ok(stated);
        }
        Err(PacketError::OtherModel { expected: stated, found: packet.model()? })
    }
}

/// Blocks that were measured at one azimuth.
#[derive(Clone, Copy)]
struct BlockGroup {
    first: usize,
    azimuth_deg: f64,
}

impl Table {
    fn new(model: Model, calibration: Option<&Calibration>) -> Result<Self, CalibrationError> {
        let of_data_sheet;
        let calibration = match calibration {
            Some(calibration) => calibration,
            None => {
                of_data_sheet = Calibration::of_data_sheet(model);
                &of_data_sheet
            }
        };
        calibration.validate(model)?;
        let elevations_deg = calibration.row_elevations_deg();
        Ok(Self {
            model,
            range_step_m: calibration.range_step_m,
            elevations_rad: elevations_deg.iter().map(|deg| deg.to_radians() as f32).collect(),
            lasers: calibration.lasers.iter().map(Laser::new).zip(calibration.rows()).collect(),
        })
    }

    fn decode(
        &self,
        packet: &DataPacket<'_>,
        return_mode: ReturnMode,
        config: &DecoderConfig,
    ) -> Result<DecodedPacket, PacketError> {
        let (groups, rate_deg_per_s) =
            self.groups(packet.blocks(), return_mode, config.max_turn_rate_hz)?;
        let mut firings = Vec::with_capacity(self.model.firings(return_mode));
        let mut shots = Vec::with_capacity(BLOCKS * SHOTS);
        let period_s = self.model.firing_period_s();
        for group in &groups {
            for within in 0..self.firings_per_block() {
                let after_s = within as f64 * period_s;
                let turned_deg = rate_deg_per_s * after_s;
                let head = Head {
                    firing: firings.len() as u16,
                    time_s: firings.len() as f64 * period_s,
                    azimuth_deg: group.azimuth_deg + turned_deg,
                    rate_deg_per_s,
                };
                firings.push(Firing {
                    azimuth_deg: head.azimuth_deg.rem_euclid(360.0),
                    time_s: head.time_s,
                });
                for bank in 0..self.banks() {
                    let block =
                        |echo: usize| packet.blocks().get(group.first + bank + echo * self.banks());
                    let first_laser = bank * SHOTS;
                    let range = self.shots_of(within);
                    let Some(main) = block(0) else { continue };
                    let other = block(1).filter(|_| return_mode == ReturnMode::Dual);
                    let echoes = Echoes { main, other, return_mode };
                    for (laser, echo, raw) in echoes.read(range) {
                        let shot = self.shot(&head, first_laser + laser, echo, raw);
                        shots.extend(shot.filter(|shot| {
                            (config.range_min_m..=config.range_max_m)
                                .contains(&f64::from(shot.range_m))
                        }));
                    }
                }
            }
        }
        Ok(DecodedPacket {
            model: self.model,
            return_mode,
            timestamp_us: packet.timestamp_us(),
            elevations_rad: Arc::clone(&self.elevations_rad),
            firings,
            shots,
        })
    }

    /// Blocks that a firing of all lasers takes.
    fn banks(&self) -> usize {
        if self.model == Model::Hdl64e { 2 } else { 1 }
    }

    /// Firings of all lasers that a block holds.
    fn firings_per_block(&self) -> usize {
        (SHOTS / self.model.lasers()).max(1)
    }

    /// Which shots of a block belong to a firing.
    fn shots_of(&self, firing: usize) -> std::ops::Range<usize> {
        let lasers = self.model.lasers().min(SHOTS);
        firing * lasers..(firing + 1) * lasers
    }

    /// The blocks by azimuths, and how fast the head turns in degrees a second.
    ///
    /// The manuals take that from one block to the next (VLP-16, section 9.5). Azimuths are rounded to hundredths, so
    /// that such steps differ by a tenth where the head, in half a millisecond, turns evenly: the whole packet determines
    /// it better.
    fn groups(
        &self,
        blocks: &[Block<'_>; BLOCKS],
        return_mode: ReturnMode,
        max_turn_rate_hz: f64,
    ) -> Result<(Vec<BlockGroup>, f64), PacketError> {
        let echoes = if return_mode == ReturnMode::Dual { 2 } else { 1 };
        let group_blocks = echoes * self.banks();
        let group_s = self.firings_per_block() as f64 * self.model.firing_period_s();
        let limit_deg = max_turn_rate_hz * 360.0 * group_s;
        let mut groups: Vec<BlockGroup> = Vec::with_capacity(BLOCKS);
        let mut turned_deg = 0.0;
        for (index, of_group) in blocks.chunks_exact(group_blocks).enumerate() {
            let first = index * group_blocks;
            let Some(azimuth_deg) = of_group.first().map(Block::azimuth_deg) else { continue };
            let jump = |block: usize, from_deg: f64, to_deg: f64| PacketError::AzimuthJump {
                block,
                from_deg,
                to_deg,
                limit_deg,
            };
            for (within, block) in of_group.iter().enumerate() {
                let step_deg = (block.azimuth_deg() - azimuth_deg).rem_euclid(360.0);
                if step_deg > limit_deg {
                    return Err(jump(first + within, azimuth_deg, block.azimuth_deg()));
                }
            }
            if let Some(before) = groups.last() {
                let step_deg = (azimuth_deg - before.azimuth_deg).rem_euclid(360.0);
                if step_deg > limit_deg {
                    return Err(jump(first, before.azimuth_deg, azimuth_deg));
                }
                turned_deg += step_deg;
            }
            groups.push(BlockGroup { first, azimuth_deg });
        }
        let turned_s = group_s * groups.len().saturating_sub(1).max(1) as f64;
        Ok((groups, turned_deg / turned_s))
    }

    fn shot(&self, head: &Head, laser: usize, echo: Echo, raw: (u16, u8)) -> Option<Shot> {
        let (units, intensity) = raw;
        if units == 0 {
            return None;
        }
        let (calibrated, row) = self.lasers.get(laser)?;
        let delay_s = self.model.laser_delay_s(laser);
        let raw_range_m = f64::from(units) * self.range_step_m;
        let range_m = raw_range_m + calibrated.range_offset_m();
        let azimuth_deg = head.azimuth_deg + head.rate_deg_per_s * delay_s;
        Some(Shot {
            firing: head.firing,
            row: *row,
            echo,
            intensity,
            time_s: (head.time_s + delay_s) as f32,
            range_m: range_m as f32,
            position_m: calibrated.point_m(raw_range_m, azimuth_deg),
        })
    }
}

/// The head at a firing.
struct Head {
    firing: u16,
    time_s: f64,
    azimuth_deg: f64,
    rate_deg_per_s: f64,
}

#[cfg(test)]
mod tests;
