//! How many packets were lost in transit, by the timestamps and azimuths of the others.

use serde::Serialize;

use super::data_packet::HOUR_US;
use super::decoder::DecodedPacket;

/// Follows the packets of one scanner and counts what is missing between them.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Continuity {
    counts: LossCounts,
    last: Option<Last>,
}

/// Counts of received and missing packets.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub struct LossCounts {
    /// Packets that came.
    pub packets: u64,
    /// Packets that are missing by the timestamps.
    pub lost: u64,
    /// Packets that are missing by the azimuths, less than a turn at a time; of a scanner whose clock is set again it
    /// is this one that holds.
    pub lost_by_azimuth: u64,
    /// Packets that came after a later one, or twice.
    pub out_of_order: u64,
    /// Times that the scanner's clock went by more than ten seconds, or back: it was set, or the scanner restarted.
    pub clock_jumps: u64,
}

#[derive(Clone, Copy, PartialEq, Debug)]
struct Last {
    timestamp_us: u32,
    first_azimuth_deg: f64,
    last_azimuth_deg: f64,
}

/// A clock that goes by more than this between two packets was set: a network that is down for longer is noticed
/// otherwise.
const LONGEST_GAP_US: i64 = 10_000_000;
/// Packets that overtake each other on a network are no farther apart; the clock was set where they are.
const OVERTAKEN_US: i64 = 100_000;

impl Continuity {
    /// Takes the next packet.
    pub fn push(&mut self, packet: &DecodedPacket) {
        self.counts.packets += 1;
        let (Some(first), Some(end)) = (packet.firings.first(), packet.firings.last()) else {
            return;
        };
        let this = Last {
            timestamp_us: packet.timestamp_us,
            first_azimuth_deg: first.azimuth_deg,
            last_azimuth_deg: end.azimuth_deg,
        };
        let Some(last) = self.last else {
            self.last = Some(this);
            return;
        };
        let elapsed_us = elapsed_us(last.timestamp_us, this.timestamp_us);
        if (-OVERTAKEN_US..=0).contains(&elapsed_us) {
            self.counts.out_of_order += 1;
            return;
        }
        self.last = Some(this);
        if !(0..=LONGEST_GAP_US).contains(&elapsed_us) {
            self.counts.clock_jumps += 1;
        } else {
            let period_us = packet.model.packet_period_s(packet.return_mode) * 1e6;
            self.counts.lost += missing(elapsed_us as f64, period_us);
        }
        // A packet turns by this, from its first firing to the first of the next.
        let firings = packet.firings.len() as f64;
        let turned_deg = (last.last_azimuth_deg - last.first_azimuth_deg).rem_euclid(360.0);
        let packet_deg = turned_deg * firings / (firings - 1.0).max(1.0);
        let step_deg = (this.first_azimuth_deg - last.first_azimuth_deg).rem_euclid(360.0);
        self.counts.lost_by_azimuth += missing(step_deg, packet_deg);
    }

    /// The counts so far.
    #[must_use]
    pub fn counts(&self) -> LossCounts {
        self.counts
    }
}

/// From one timestamp to another in microseconds, over the end of the hour too.
pub(crate) fn elapsed_us(from_us: u32, to_us: u32) -> i64 {
    let difference_us = i64::from(to_us) - i64::from(from_us);
    let hour_us = i64::from(HOUR_US);
    if difference_us < -hour_us / 2 {
        difference_us + hour_us
    } else if difference_us > hour_us / 2 {
        difference_us - hour_us
    } else {
        difference_us
    }
}

/// How many whole steps are missing within a distance that should be one.
fn missing(distance: f64, step: f64) -> u64 {
    if step > 0.0 { ((distance / step).round() - 1.0).max(0.0) as u64 } else { 0 }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::packets::{Firing, Model, ReturnMode};

    /// The packet of a scanner at 10 turns a second, this many packets after the start.
    fn packet(index: u32, start_us: u32) -> DecodedPacket {
        let model = Model::Hdl32e;
        let period_s = model.packet_period_s(ReturnMode::Strongest);
        let time_s = f64::from(index) * period_s;
        let firings = (0..12).map(|firing| {
            let after_s = f64::from(firing) * model.firing_period_s();
            let azimuth_deg = ((time_s + after_s) * 3600.0).rem_euclid(360.0);
            Firing { azimuth_deg, time_s: after_s }
        });
        DecodedPacket {
            model,
            return_mode: ReturnMode::Strongest,
            timestamp_us: (start_us + (time_s * 1e6) as u32) % HOUR_US,
            elevations_rad: Arc::new([]),
            firings: firings.collect(),
            shots: Vec::new(),
        }
    }

    fn counts(indices: impl IntoIterator<Item = u32>) -> LossCounts {
        let mut continuity = Continuity::default();
        for index in indices {
            // Over the end of the hour.
            continuity.push(&packet(index, HOUR_US - 1000));
        }
        continuity.counts()
    }

    #[test]
    fn nothing_is_missing_where_nothing_is() {
        let expected = LossCounts { packets: 500, ..LossCounts::default() };
        assert_eq!(counts(0..500), expected);
        assert_eq!(Continuity::default().counts(), LossCounts::default());
    }

    #[test]
    fn what_is_missing_is_counted_by_time_and_by_azimuth() {
        let counts = counts((0..500).filter(|index| !(20..23).contains(index) && *index != 300));
        let expected =
            LossCounts { packets: 496, lost: 4, lost_by_azimuth: 4, ..LossCounts::default() };
        assert_eq!(counts, expected);
    }

    #[test]
    fn packets_that_overtake_or_repeat_are_not_counted_as_losses() {
        let counts = counts([0, 1, 3, 2, 4, 4, 5]);
        // The third was missing when the fourth came.
        assert_eq!((counts.lost, counts.out_of_order, counts.clock_jumps), (1, 2, 0));
    }

    #[test]
    fn a_clock_that_is_set_is_no_loss() {
        let mut continuity = Continuity::default();
        for (index, start_us) in
            [(0, 1000), (1, 1000), (2, 1_000_000_000), (3, 1_000_000_000), (4, 0)]
        {
            continuity.push(&packet(index, start_us));
        }
        let counts = continuity.counts();
        assert_eq!((counts.lost, counts.lost_by_azimuth, counts.clock_jumps), (0, 0, 2));
    }
}
