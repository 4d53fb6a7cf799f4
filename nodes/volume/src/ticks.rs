//! Times in 32 bits.

use geometry::Stamp;

/// Shorter than the period of any camera.
pub(crate) const TICK_S: f64 = 0.01;

/// Counts ticks of 10 ms from the first time on, beginning with 1: 497 days. Earlier times are clamped to the first tick, later
/// ones to the last.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Ticks {
    start: Option<Stamp>,
}

impl Ticks {
    pub(crate) fn at(&mut self, stamp: Stamp) -> u32 {
        let start = *self.start.get_or_insert(stamp);
        // The cast saturates.
        ((stamp.seconds_since(start) / TICK_S).round() as u32).saturating_add(1)
    }

    /// Whether a time is later than the last tick.
    pub(crate) fn are_over_at(&self, stamp: Stamp) -> bool {
        let elapsed_s = self.start.map_or(0.0, |start| stamp.seconds_since(start));
        elapsed_s >= f64::from(u32::MAX - 1) * TICK_S
    }

    /// `None` for 0, which means never.
    pub(crate) fn stamp(&self, tick: u32) -> Option<Stamp> {
        let ticks = tick.checked_sub(1)?;
        Some(self.start?.plus_seconds(f64::from(ticks) * TICK_S))
    }
}
