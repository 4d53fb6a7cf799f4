//! With which part of the platform's way a voxel moves when the map is corrected.

use geometry::Stamp;

/// A tick: finer than any scanner or camera tells its cycles apart.
pub(super) const TICK_S: f64 = 0.01;

/// The moment of the way at which a voxel was seen first, in ticks since the map began, from 1 on: 497 days, and what is
/// later counts as seen then. A voxel of a map that was loaded has none, and stays where it is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub(super) struct Anchor(u32);

impl Anchor {
    /// That of a voxel that was seen first at this moment, in a map that began at `epoch`.
    pub(super) fn at(stamp: Stamp, epoch: Stamp) -> Self {
        // The cast saturates; what is before the beginning counts as seen then. Half a tick is more than what the
        // division is off by, and less than what tells two cycles apart.
        let ticks = (stamp.seconds_since(epoch) / TICK_S + 0.5) as u32;
        Self(ticks.saturating_add(1))
    }

    /// When the voxel was seen first, to a tick; `None` for one of a loaded map.
    pub(super) fn stamp(self, epoch: Stamp) -> Option<Stamp> {
        Some(epoch.plus_seconds(self.seconds()?))
    }

    /// The same in seconds since the map began.
    pub(super) fn seconds(self) -> Option<f64> {
        let ticks = self.0.checked_sub(1)?;
        Some(f64::from(ticks) * TICK_S)
    }

    /// Its number, to be written.
    pub(super) fn ticks(self) -> u32 {
        self.0
    }

    /// As it was written.
    pub(super) fn of_ticks(ticks: u32) -> Self {
        Self(ticks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moment_is_known_to_a_tick() {
        let epoch = Stamp::from_secs_nanos(1_700_000_000, 123_456_789);
        for seconds in [0.0, 0.033, 0.1, 1234.567, 3.0e6] {
            let anchor = Anchor::at(epoch.plus_seconds(seconds), epoch);
            let back_s = anchor.stamp(epoch).unwrap().seconds_since(epoch);
            assert!((back_s - seconds).abs() <= TICK_S, "{back_s} {seconds}");
        }
        assert_eq!(Anchor::default().stamp(epoch), None);
        assert_eq!(Anchor::at(epoch.plus_seconds(-5.0), epoch), Anchor::at(epoch, epoch));
        assert_eq!(Anchor::at(epoch.plus_seconds(1e9), epoch).ticks(), u32::MAX);
    }
}
