//! Warnings that repeat, at most once in a while.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How long a repeated warning is held back.
pub const WARNING_PERIOD: Duration = Duration::from_secs(5);

/// Lets one in a period through, and counts those held back.
#[derive(Debug)]
pub struct Throttle {
    period: Duration,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    last: Option<Instant>,
    held_back: u64,
}

impl Throttle {
    /// A throttle that lets one in `period` through.
    #[must_use]
    pub const fn new(period: Duration) -> Self {
        Self { period, state: Mutex::new(State { last: None, held_back: 0 }) }
    }

    /// A throttle for warnings, that lets one in five seconds through.
    #[must_use]
    pub const fn for_warnings() -> Self {
        Self::new(WARNING_PERIOD)
    }

    /// Whether this one goes through; if so, how many were held back since the last one.
    pub fn pass(&self) -> Option<u64> {
        self.pass_at(Instant::now())
    }

    fn pass_at(&self, now: Instant) -> Option<u64> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if state.last.is_some_and(|last| now.saturating_duration_since(last) < self.period) {
            state.held_back += 1;
            return None;
        }
        state.last = Some(now);
        Some(std::mem::take(&mut state.held_back))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_in_a_period_passes_and_the_rest_is_counted() {
        let throttle = Throttle::for_warnings();
        let start = Instant::now();
        let at = |seconds| throttle.pass_at(start + Duration::from_secs(seconds));
        assert_eq!(at(0), Some(0));
        assert_eq!(at(1), None);
        assert_eq!(at(4), None);
        assert_eq!(at(5), Some(2));
        assert_eq!(at(9), None);
        assert_eq!(at(60), Some(1));
    }
}
