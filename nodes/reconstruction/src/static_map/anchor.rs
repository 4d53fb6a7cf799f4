//! With which part of the trajectory a voxel moves when the map is corrected.

use geometry::Stamp;

use crate::correction::TICK_S;

/// The time at which a voxel was seen first, in ticks since the map began, from 1 on: 497 days, and what is
/// later counts as seen then. A voxel of a map that was loaded has none, and stays where it is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub(super) struct Anchor(u32);

impl Anchor {
    /// That of a voxel that was seen first at this time, in a map that began at `epoch`.
    pub(super) fn at(stamp: Stamp, epoch: Stamp) -> Self {
        // The cast saturates; what is before the beginning counts as seen then. Half a tick is more than what the
        // division is off by, and less than the time between two cycles.
        let ticks = (stamp.seconds_since(epoch) / TICK_S + 0.5) as u32;
        Self(ticks.saturating_add(1))
    }

    /// When the voxel was seen first, to a tick; `None` for one of a loaded map.
    pub(super) fn stamp(self, epoch: Stamp) -> Option<Stamp> {
        let ticks = self.0.checked_sub(1)?;
        Some(epoch.plus_seconds(f64::from(ticks) * TICK_S))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_known_to_a_tick() {
        let epoch = Stamp::from_secs_nanos(1_700_000_000, 123_456_789);
        for seconds in [0.0, 0.033, 0.1, 1234.567, 3.0e6] {
            let anchor = Anchor::at(epoch.plus_seconds(seconds), epoch);
            let back_s = anchor.stamp(epoch).unwrap().seconds_since(epoch);
            assert!((back_s - seconds).abs() <= TICK_S, "{back_s} {seconds}");
        }
        assert_eq!(Anchor::default().stamp(epoch), None);
        assert_eq!(Anchor::at(epoch.plus_seconds(-5.0), epoch), Anchor::at(epoch, epoch));
        assert_eq!(Anchor::at(epoch.plus_seconds(1e9), epoch), Anchor(u32::MAX));
    }
}
