//! The moment of a packet: by when it arrived, or by the scanner's own clock.

use geometry::Stamp;

use super::decoder::DecodedPacket;

const HOUR_NS: i64 = 3_600_000_000_000;

impl DecodedPacket {
    /// When its first laser fired, by its arrival: a packet is sent when its last laser has fired.
    #[must_use]
    pub fn stamp_by_arrival(&self, arrival: Stamp) -> Stamp {
        arrival.plus_seconds(-self.model.packet_period_s(self.return_mode))
    }

    /// When its first laser fired, by the clock of a scanner that follows GPS: the scanner gives the time within the
    /// hour, the arrival gives the hour, if it is right within half of one.
    #[must_use]
    pub fn stamp_by_scanner(&self, arrival: Stamp) -> Stamp {
        let of_hour_ns = i64::from(self.timestamp_us) * 1000;
        let arrival_ns = arrival.as_nanos();
        let hour_ns = arrival_ns.saturating_sub(arrival_ns.rem_euclid(HOUR_NS));
        let nearest = [-HOUR_NS, 0, HOUR_NS]
            .map(|hours_ns| hour_ns.saturating_add(hours_ns).saturating_add(of_hour_ns))
            .into_iter()
            .min_by_key(|stamp_ns| arrival_ns.abs_diff(*stamp_ns));
        Stamp::from_nanos(nearest.unwrap_or(arrival_ns))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::packets::{Model, ReturnMode};

    fn packet(timestamp_us: u32) -> DecodedPacket {
        DecodedPacket {
            model: Model::Hdl64e,
            return_mode: ReturnMode::Strongest,
            timestamp_us,
            elevations_rad: Arc::new([]),
            firings: Vec::new(),
            shots: Vec::new(),
        }
    }

    #[test]
    fn the_hour_is_the_one_of_the_arrival() {
        for (arrival_s, of_hour_s, expected_s) in [
            (7200, 5, 7205),
            // The clocks differ by a little around the full hour.
            (7199, 1, 7201),
            (7201, 3599, 7199),
            (-1, 3, 3),
        ] {
            let stamp = packet(of_hour_s * 1_000_000)
                .stamp_by_scanner(Stamp::from_secs_nanos(arrival_s, 0));
            assert_eq!(stamp, Stamp::from_secs_nanos(expected_s, 0), "{arrival_s} {of_hour_s}");
        }
    }

    #[test]
    fn a_packet_arrives_when_its_last_laser_has_fired() {
        let arrival = Stamp::from_secs_nanos(100, 0);
        let stamp = packet(0).stamp_by_arrival(arrival);
        assert!((arrival.seconds_since(stamp) - 288e-6).abs() < 1e-9);
    }

    #[test]
    fn no_clock_overflows() {
        for nanos in [i64::MIN, i64::MAX, 0] {
            let arrival = Stamp::from_nanos(nanos);
            let _ =
                (packet(u32::MAX).stamp_by_scanner(arrival), packet(0).stamp_by_arrival(arrival));
        }
    }
}
