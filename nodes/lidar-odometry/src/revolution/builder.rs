//! Packets to revolutions.

use std::sync::Arc;

use geometry::{LidarReturn, Revolution, Stamp};
use serde::{Deserialize, Serialize};

use crate::packets::{DecodedPacket, Echo, Firing, ReturnMode, Shot, elapsed_us};

/// How revolutions are cut.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RevolutionConfig {
    /// The frame that revolutions are stamped with.
    pub frame_id: String,
    /// A revolution begins where the head passes this azimuth: clockwise from forward.
    pub cut_azimuth_deg: f64,
    /// Which echo a cell holds, where packets have two.
    pub kept_echo: KeptEcho,
    /// A revolution that lasts longer is cut off: the head does not turn, or packets of more than a turn are missing.
    pub max_duration_s: f64,
}

impl Default for RevolutionConfig {
    fn default() -> Self {
        Self {
            // As velodyne_driver names it.
            frame_id: "velodyne".to_owned(),
            // Behind the vehicle, where a seam of a moving vehicle disturbs least.
            cut_azimuth_deg: 180.0,
            kept_echo: KeptEcho::Strongest,
            // The slowest turn of every model's manual, 5 a second, takes 0.2 s.
            max_duration_s: 0.3,
        }
    }
}

/// Which of two echoes is kept.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KeptEcho {
    /// The strongest: what fills most of the beam.
    Strongest,
    /// The last: what is behind leaves, rain and wires.
    Last,
}

/// Why a configuration does not serve.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum RevolutionConfigError {
    /// The cut is no azimuth.
    #[error("cut_azimuth_deg is {value}, not within 0 .. 360")]
    Cut {
        /// What it is.
        value: f64,
    },
    /// The duration is invalid.
    #[error("max_duration_s is {value}, not above 0 and at most {LONGEST_S}")]
    Duration {
        /// What it is.
        value: f64,
    },
}

/// The longest revolution that may be configured: more would be memory without a bound.
pub(crate) const LONGEST_S: f64 = 10.0;

impl RevolutionConfig {
    /// Checks the values.
    ///
    /// # Errors
    /// When the cut or the duration is invalid.
    pub fn validate(&self) -> Result<(), RevolutionConfigError> {
        if !(0.0..360.0).contains(&self.cut_azimuth_deg) {
            return Err(RevolutionConfigError::Cut { value: self.cut_azimuth_deg });
        }
        if !(self.max_duration_s > 0.0 && self.max_duration_s <= LONGEST_S) {
            return Err(RevolutionConfigError::Duration { value: self.max_duration_s });
        }
        Ok(())
    }
}

/// A revolution as far as it was received.
#[derive(Clone, PartialEq, Debug)]
pub struct BuiltRevolution {
    /// The measured revolution.
    pub revolution: Revolution,
    /// How far the head turned from its first column to its last; a part of a turn at the beginning and at the end of a
    /// recording.
    pub turned_deg: f64,
}

impl BuiltRevolution {
    /// Whether it is a whole turn, but for a degree.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.turned_deg >= 359.0
    }
}

/// Collects the packets of one scanner.
#[derive(Clone, Debug)]
pub struct RevolutionBuilder {
    config: RevolutionConfig,
    open: Option<Open>,
}

impl RevolutionBuilder {
    /// A builder without packets.
    ///
    /// # Errors
    /// When the configuration does not hold.
    pub fn new(config: RevolutionConfig) -> Result<Self, RevolutionConfigError> {
        config.validate()?;
        Ok(Self { config, open: None })
    }

    /// Takes the next packet, whose first laser fired at `stamp`; gives the revolution that it ends.
    ///
    /// Times within a revolution are those of the scanner's clock; where that was set in between, those of the stamps.
    pub fn push(&mut self, packet: &DecodedPacket, stamp: Stamp) -> Option<BuiltRevolution> {
        let mut ended = None;
        let mut shots = packet.shots.iter().peekable();
        for (index, firing) in packet.firings.iter().enumerate() {
            let ends = |open: &Open| open.ends_before(firing, packet, stamp, &self.config);
            if self.open.as_ref().is_some_and(ends) {
                // No head turns twice within a packet; if one seems to, the larger revolution stands.
                ended = larger(ended, self.open.take().and_then(Open::close));
            }
            let new = || Open::new(packet, firing, stamp, &self.config);
            let open = self.open.get_or_insert_with(new);
            let packet_s = open.packet_s(packet, stamp);
            open.begin_column(firing.azimuth_deg);
            while let Some(shot) = shots.next_if(|shot| usize::from(shot.firing) <= index) {
                if keeps(self.config.kept_echo, shot.echo, packet.return_mode) {
                    open.set(shot, packet_s);
                }
            }
        }
        ended
    }

    /// The revolution that is not complete yet; the builder starts again.
    pub fn finish(&mut self) -> Option<BuiltRevolution> {
        self.open.take().and_then(Open::close)
    }
}

fn larger(a: Option<BuiltRevolution>, b: Option<BuiltRevolution>) -> Option<BuiltRevolution> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if a.turned_deg >= b.turned_deg { a } else { b }),
        (a, b) => a.or(b),
    }
}

fn keeps(kept: KeptEcho, echo: Echo, return_mode: ReturnMode) -> bool {
    return_mode != ReturnMode::Dual
        || match kept {
            KeptEcho::Strongest => matches!(echo, Echo::Strongest | Echo::StrongestAndLast),
            KeptEcho::Last => matches!(echo, Echo::Last | Echo::StrongestAndLast),
        }
}

/// The revolution that is being measured.
#[derive(Clone, Debug)]
struct Open {
    frame_id: String,
    stamp: Stamp,
    /// The scanner's clock at the first packet, and when the first column was fired after it.
    first_timestamp_us: u32,
    first_firing_s: f64,
    elevations_rad: Arc<[f32]>,
    azimuths_rad: Vec<f32>,
    /// Column by column.
    cells: Vec<Option<LidarReturn>>,
    /// Where the head looks, from the cut on.
    from_cut_deg: f64,
    turned_deg: f64,
    last_azimuth_deg: f64,
}

/// A step forward of more than this is one backward: the encoder's jitter, not a turn of which only this is missing.
const LARGEST_STEP_DEG: f64 = 359.0;

impl Open {
    fn new(
        packet: &DecodedPacket,
        first: &Firing,
        stamp: Stamp,
        config: &RevolutionConfig,
    ) -> Self {
        Self {
            frame_id: config.frame_id.clone(),
            stamp: stamp.plus_seconds(first.time_s),
            first_timestamp_us: packet.timestamp_us,
            first_firing_s: first.time_s,
            elevations_rad: Arc::clone(&packet.elevations_rad),
            azimuths_rad: Vec::new(),
            cells: Vec::new(),
            from_cut_deg: (first.azimuth_deg - config.cut_azimuth_deg).rem_euclid(360.0),
            turned_deg: 0.0,
            last_azimuth_deg: first.azimuth_deg,
        }
    }

    /// From the first column to the first firing of a packet.
    fn packet_s(&self, packet: &DecodedPacket, stamp: Stamp) -> f64 {
        let by_scanner_us = elapsed_us(self.first_timestamp_us, packet.timestamp_us);
        if (0..=(LONGEST_S * 1e6) as i64).contains(&by_scanner_us) {
            by_scanner_us as f64 * 1e-6 - self.first_firing_s
        } else {
            stamp.seconds_since(self.stamp)
        }
    }

    /// Whether a firing belongs to the next revolution.
    fn ends_before(
        &self,
        firing: &Firing,
        packet: &DecodedPacket,
        stamp: Stamp,
        config: &RevolutionConfig,
    ) -> bool {
        let time_s = self.packet_s(packet, stamp) + firing.time_s;
        let most_columns = (config.max_duration_s / packet.model.firing_period_s()) as usize;
        // No column fits one of another scanner, or of one that was calibrated again.
        self.elevations_rad != packet.elevations_rad
            || self.from_cut_deg + self.step_deg(firing.azimuth_deg) >= 360.0
            || !(f64::MIN..=config.max_duration_s).contains(&time_s)
            // Whatever the clock says.
            || self.azimuths_rad.len() > most_columns
    }

    /// How far the head turned since the last column.
    fn step_deg(&self, azimuth_deg: f64) -> f64 {
        let step_deg = (azimuth_deg - self.last_azimuth_deg).rem_euclid(360.0);
        if step_deg > LARGEST_STEP_DEG { 0.0 } else { step_deg }
    }

    fn begin_column(&mut self, azimuth_deg: f64) {
        let step_deg = self.step_deg(azimuth_deg);
        self.turned_deg += step_deg;
        self.from_cut_deg += step_deg;
        if step_deg > 0.0 {
            self.last_azimuth_deg = azimuth_deg;
        }
        // Clockwise 0 .. 360 to counterclockwise -180 .. 180.
        let azimuth_deg = if azimuth_deg > 180.0 { 360.0 - azimuth_deg } else { -azimuth_deg };
        self.azimuths_rad.push(azimuth_deg.to_radians() as f32);
        self.cells.resize(self.azimuths_rad.len() * self.elevations_rad.len(), None);
    }

    /// Puts a shot of the packet that was fired at `packet_s` into the last column.
    fn set(&mut self, shot: &Shot, packet_s: f64) {
        let rows = self.elevations_rad.len();
        let first = self.cells.len().saturating_sub(rows);
        if let Some(cell) = self.cells.get_mut(first + usize::from(shot.row)) {
            *cell = Some(LidarReturn {
                position_m: shot.position_m,
                intensity: f32::from(shot.intensity),
                time_s: (packet_s + f64::from(shot.time_s)) as f32,
            });
        }
    }

    fn close(self) -> Option<BuiltRevolution> {
        let (rows, columns) = (self.elevations_rad.len(), self.azimuths_rad.len());
        let by_rows = (0..rows)
            .flat_map(|row| (0..columns).map(move |column| column * rows + row))
            .filter_map(|index| self.cells.get(index).copied());
        let returns = by_rows.collect();
        let revolution = Revolution::new(
            self.stamp,
            self.frame_id,
            self.elevations_rad.to_vec(),
            self.azimuths_rad,
            returns,
        );
        // There are as many cells as rows and columns.
        revolution
            .ok()
            .map(|revolution| BuiltRevolution { revolution, turned_deg: self.turned_deg })
    }
}

#[cfg(test)]
mod tests;
