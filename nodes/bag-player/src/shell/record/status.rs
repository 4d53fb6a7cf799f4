//! The progress line of the recorder on a terminal.

use std::time::{Duration, Instant};

use super::writing::Written;
use crate::shell::terminal_line::TerminalLine;

/// How often the line changes.
const PERIOD: Duration = Duration::from_millis(500);

/// The line; nothing where stderr is no terminal.
pub(super) struct StatusLine {
    terminal: TerminalLine,
    started: Instant,
}

impl StatusLine {
    pub(super) fn new(started: Instant) -> Self {
        Self { terminal: TerminalLine::every(PERIOD), started }
    }

    /// Writes the line when it is due.
    pub(super) fn update(&mut self, written: Written) {
        let started = self.started;
        self.terminal.update(|| line(started.elapsed(), written));
    }

    /// Clears the line.
    pub(super) fn clear(&self) {
        self.terminal.clear();
    }
}

fn line(elapsed: Duration, Written { messages, bytes }: Written) -> String {
    let (elapsed_s, megabytes) = (elapsed.as_secs_f64(), bytes as f64 * 1e-6);
    format!("recording  {elapsed_s:.1} s  {messages} messages  {megabytes:.1} MB  [Ctrl-C ends it]")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_says_how_much_there_is() {
        let line = line(Duration::from_millis(12_340), Written { messages: 7, bytes: 2_500_000 });
        assert_eq!(line, "recording  12.3 s  7 messages  2.5 MB  [Ctrl-C ends it]");
    }
}
