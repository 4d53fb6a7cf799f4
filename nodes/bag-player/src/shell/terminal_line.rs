//! A line on a terminal that is overwritten repeatedly; nothing where stderr is not a terminal.

use std::io::{Write, stderr};
use std::time::{Duration, Instant};

use crate::shell::is_watched;

/// The line, and the time of its next update.
pub(super) struct TerminalLine {
    watched: bool,
    next: Instant,
    period: Duration,
}

impl TerminalLine {
    /// A line with this period between updates.
    pub(super) fn every(period: Duration) -> Self {
        Self { watched: is_watched(), next: Instant::now(), period }
    }

    /// Whether the line is shown.
    pub(super) fn is_watched(&self) -> bool {
        self.watched
    }

    /// The time of the next update.
    pub(super) fn due_in(&self) -> Duration {
        self.next.saturating_duration_since(Instant::now())
    }

    /// Updates the line when it is due.
    pub(super) fn update(&mut self, line: impl FnOnce() -> String) {
        if !self.watched || !self.due_in().is_zero() {
            return;
        }
        self.next = Instant::now() + self.period;
        // stderr is closed: the line is not shown.
        let _ = write!(stderr(), "\r\x1b[K{}", line());
        let _ = stderr().flush();
    }

    /// Clears the line.
    pub(super) fn clear(&self) {
        if self.watched {
            let _ = write!(stderr(), "\r\x1b[K");
            let _ = stderr().flush();
        }
    }
}
