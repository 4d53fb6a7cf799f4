//! A line on a terminal that is written over again and again; nothing where stderr is no terminal.

use std::io::{Write, stderr};
use std::time::{Duration, Instant};

use crate::shell::is_watched;

/// The line, and when it is to be written again.
pub(super) struct TerminalLine {
    watched: bool,
    next: Instant,
    period: Duration,
}

impl TerminalLine {
    /// A line that changes no more often than this.
    pub(super) fn every(period: Duration) -> Self {
        Self { watched: is_watched(), next: Instant::now(), period }
    }

    /// Whether somebody is looking.
    pub(super) fn is_watched(&self) -> bool {
        self.watched
    }

    /// When the line is to be written again.
    pub(super) fn due_in(&self) -> Duration {
        self.next.saturating_duration_since(Instant::now())
    }

    /// Writes the line when it is due.
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
