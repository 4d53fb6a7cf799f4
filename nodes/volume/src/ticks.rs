//! Times in 32 bits.

use std::collections::VecDeque;

use geometry::Stamp;

/// Shorter than the period of any camera.
pub(crate) const TICK_S: f64 = 0.01;
/// A cycle is so late at most, as those of several sensors may be. What is earlier is of a clock that was set back.
const MAX_LATE_S: f64 = 1.0;
/// Settings of the clock that are remembered: of earlier ones the first times are not told apart.
const MOST_CLOCKS: usize = 64;

/// Counts ticks of 10 ms from the first time on, beginning with 1: 497 days. Earlier times are clamped to the first tick, later
/// ones to the last, but for [`Self::advance`], which begins anew with a clock that was set.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Ticks {
    clocks: VecDeque<Clock>,
}

/// The times between two settings of the clock.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Clock {
    first: u32,
    start: Stamp,
    /// The last time that was advanced to.
    until: Stamp,
}

impl Clock {
    fn starting(first: u32, start: Stamp) -> Self {
        Self { first, start, until: start }
    }

    fn at(&self, stamp: Stamp) -> u32 {
        // The cast saturates.
        ((stamp.seconds_since(self.start) / TICK_S).round() as u32).saturating_add(self.first)
    }

    /// Whether it had this time, to a tick.
    fn has_been_at(&self, stamp: Stamp) -> bool {
        self.start <= stamp && self.at(stamp) <= self.at(self.until)
    }

    fn is_over_at(&self, stamp: Stamp) -> bool {
        stamp.seconds_since(self.start) >= f64::from(u32::MAX - self.first) * TICK_S
    }
}

impl Ticks {
    /// The tick of a time: of the latest clock that had it, or may have it.
    pub(crate) fn at(&mut self, stamp: Stamp) -> u32 {
        let clock = {
            let latest = |is_it: &dyn Fn(&Clock) -> bool| {
                self.clocks.iter().rev().find(|clock| is_it(clock)).copied()
            };
            latest(&|clock| clock.has_been_at(stamp))
                .or_else(|| latest(&|clock| clock.start <= stamp))
                .or_else(|| self.clocks.front().copied())
        };
        clock.unwrap_or_else(|| self.begin(1, stamp)).at(stamp)
    }

    /// The tick of the time of a cycle, which is no earlier than that of the cycle before. A clock that is set back, or forward beyond the
    /// last tick, as one that began at 0 is, counts on from the last cycle.
    pub(crate) fn advance(&mut self, stamp: Stamp) -> u32 {
        let Some(clock) = self.clocks.back_mut() else { return self.begin(1, stamp).at(stamp) };
        let last = clock.at(clock.until);
        let is_set_back = clock.until.seconds_since(stamp) > MAX_LATE_S;
        if (is_set_back || clock.is_over_at(stamp)) && last < u32::MAX {
            return self.begin(last + 1, stamp).at(stamp);
        }
        clock.until = clock.until.max(stamp);
        clock.at(clock.until)
    }

    /// Whether a time is later than the last tick.
    pub(crate) fn are_over_at(&self, stamp: Stamp) -> bool {
        self.clocks.back().is_some_and(|clock| clock.is_over_at(stamp))
    }

    /// `None` for 0, which means never.
    pub(crate) fn stamp(&self, tick: u32) -> Option<Stamp> {
        tick.checked_sub(1)?;
        let of_tick = self.clocks.iter().rev().find(|clock| clock.first <= tick);
        let clock = of_tick.or_else(|| self.clocks.front())?;
        let ticks = tick.saturating_sub(clock.first);
        Some(clock.start.plus_seconds(f64::from(ticks) * TICK_S))
    }

    fn begin(&mut self, first: u32, start: Stamp) -> Clock {
        if self.clocks.len() == MOST_CLOCKS {
            self.clocks.pop_front();
        }
        let clock = Clock::starting(first, start);
        self.clocks.push_back(clock);
        clock
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: f64) -> Stamp {
        Stamp::default().plus_seconds(seconds)
    }

    /// Regression: after a clock that was set, each cycle had the same tick, the first or the last, and a full map kept old blocks in place
    /// of new ones.
    #[test]
    fn cycles_have_ticks_of_their_own_when_the_clock_is_set() {
        // From 1970 to now, an hour back, and late by less than a second.
        let times_s = [0.0, 0.1, 1.7e9, 1.7e9 + 0.1, 1.7e9 - 3600.0, 1.7e9 - 3599.9];
        let mut ticks = Ticks::default();
        let counted = times_s.map(|time_s| ticks.advance(at(time_s)));
        assert_eq!(counted, [1, 11, 12, 22, 23, 33]);
        for (tick, time_s) in counted.into_iter().zip(times_s) {
            let stamp = ticks.stamp(tick).unwrap();
            assert!(stamp.seconds_since(at(time_s)).abs() < TICK_S, "{tick}: {stamp:?}");
            assert_eq!(ticks.at(at(time_s)), tick, "{time_s}");
        }
        assert_eq!(ticks.advance(at(1.7e9 - 3600.5)), 33, "late");
        assert_eq!(ticks.stamp(0), None);
    }

    #[test]
    fn a_clock_that_is_set_again_and_again_takes_no_more_memory() {
        let mut ticks = Ticks::default();
        let counted: Vec<u32> =
            (0..1_000).map(|cycle| ticks.advance(at(-10.0 * f64::from(cycle)))).collect();
        assert!(counted.is_sorted_by(|a, b| a < b) && ticks.clocks.len() == MOST_CLOCKS);
        assert!(ticks.stamp(1).is_some());
    }
}
