//! The schedule of playback: a state machine whose time is an input.

use std::time::Duration;

use geometry::Stamp;

/// Plays stamped messages at a rate, with pause, step and loop.
///
/// It reads no clock and holds no message: the player passes the time of a monotonic clock (of any
/// origin) and the log time of the next message, and carries out the [`Decision`]. The first message
/// of a pass is due at once. The others are due at their time after it divided by the rate: one that
/// is published late does not delay those after it.
#[derive(Clone, PartialEq, Debug)]
pub struct Schedule {
    rate: f64,
    looping: bool,
    state: State,
    /// Steps requested while paused and not yet taken.
    steps: u32,
    /// Whether this pass has published anything: a loop over an empty bag must end.
    published_in_pass: bool,
}

/// The state of the bag's time.
#[derive(Clone, Copy, PartialEq, Debug)]
enum State {
    /// It starts at the next message.
    Unset { paused: bool },
    /// It runs: at time `at` of the clock the bag's time was `bag`.
    Running { bag: Stamp, at: Duration },
    /// Paused.
    Paused { bag: Stamp },
}

/// The next action of the player.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Decision {
    /// Publish the message now; it was due `late` ago.
    Publish {
        /// Zero for a message on time.
        late: Duration,
    },
    /// Nothing is due for this duration; call again after it, or when a key is pressed.
    Wait(Duration),
    /// Nothing is due before playback continues or a step is requested.
    Paused,
    /// The bag is at its end and starts again: pass its first message next.
    Rewind,
    /// Everything has been published.
    Finished,
}

/// The rate is not a positive number.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
#[error("the rate must be a positive number, not {rate}; 1 is real time, 0.5 half as fast")]
pub struct RateError {
    /// The rate that was requested.
    pub rate: f64,
}

impl Schedule {
    /// A schedule at `rate` seconds of the bag per second of the clock.
    ///
    /// # Errors
    /// When the rate is not a positive finite number.
    pub fn new(rate: f64, looping: bool) -> Result<Self, RateError> {
        if !(rate.is_finite() && rate > 0.0) {
            return Err(RateError { rate });
        }
        Ok(Self {
            rate,
            looping,
            state: State::Unset { paused: false },
            steps: 0,
            published_in_pass: false,
        })
    }

    /// The action at `now` for `next`, the log time of the next message; `None` at the bag's end.
    pub fn decide(&mut self, now: Duration, next: Option<Stamp>) -> Decision {
        let Some(next) = next else { return self.end_of_pass() };
        match self.state {
            State::Unset { paused: false } => {
                self.state = State::Running { bag: next, at: now };
                self.publish(Duration::ZERO)
            }
            State::Running { bag, at } => {
                let elapsed_s = now.saturating_sub(at).as_secs_f64();
                let wait_s = next.seconds_since(bag) / self.rate - elapsed_s;
                if wait_s > 0.0 {
                    // A wait longer than the longest duration is unlimited.
                    let wait = Duration::try_from_secs_f64(wait_s).unwrap_or(Duration::MAX);
                    // A wait that is rounded to 0 would still be too early: the clock has no finer tick.
                    Decision::Wait(wait.max(Duration::from_nanos(1)))
                } else {
                    self.publish(Duration::try_from_secs_f64(-wait_s).unwrap_or(Duration::MAX))
                }
            }
            State::Unset { paused: true } | State::Paused { .. } if self.steps > 0 => {
                self.steps -= 1;
                // A message that was late at the pause must not set the time back.
                let bag = self.bag_time(now).map_or(next, |time| time.max(next));
                self.state = State::Paused { bag };
                self.publish(Duration::ZERO)
            }
            State::Unset { paused: true } | State::Paused { .. } => Decision::Paused,
        }
    }

    fn publish(&mut self, late: Duration) -> Decision {
        self.published_in_pass = true;
        Decision::Publish { late }
    }

    fn end_of_pass(&mut self) -> Decision {
        if !self.looping || !self.published_in_pass {
            return Decision::Finished;
        }
        self.state = State::Unset { paused: self.is_paused() };
        self.published_in_pass = false;
        Decision::Rewind
    }

    /// Whether playback is paused.
    #[must_use]
    pub fn is_paused(&self) -> bool {
        matches!(self.state, State::Paused { .. } | State::Unset { paused: true })
    }

    /// Stops the time of the bag at `now`.
    pub fn pause(&mut self, now: Duration) {
        self.state = match (self.state, self.bag_time(now)) {
            (State::Running { .. }, Some(bag)) => State::Paused { bag },
            (State::Unset { .. }, _) => State::Unset { paused: true },
            (state, _) => state,
        };
    }

    /// Delays the bag's time by this duration, up to now.
    pub fn stand(&mut self, lasting: Duration) {
        if let State::Running { at, .. } = &mut self.state {
            *at = at.saturating_add(lasting);
        }
    }

    /// Continues the bag's time from its current value.
    pub fn resume(&mut self, now: Duration) {
        self.steps = 0;
        self.state = match self.state {
            State::Paused { bag } => State::Running { bag, at: now },
            State::Unset { .. } => State::Unset { paused: false },
            running @ State::Running { .. } => running,
        };
    }

    /// Publishes one message while paused; nothing while playing.
    pub fn step(&mut self) {
        if self.is_paused() {
            self.steps = self.steps.saturating_add(1);
        }
    }

    /// The time of the bag at `now`; `None` before the first message.
    #[must_use]
    pub fn bag_time(&self, now: Duration) -> Option<Stamp> {
        match self.state {
            State::Unset { .. } => None,
            State::Paused { bag } => Some(bag),
            State::Running { bag, at } => {
                Some(bag.plus_seconds(now.saturating_sub(at).as_secs_f64() * self.rate))
            }
        }
    }
}

#[cfg(test)]
mod tests;
