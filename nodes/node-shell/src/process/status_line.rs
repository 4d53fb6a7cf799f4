//! A line at the foot of the terminal that says how things are: it is overwritten, and the lines of the log go above it.

use std::io::{self, IsTerminal, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Whether the log goes to stdout: `1`, or `0`, which is what it is where the variable is not set.
const TO_STDOUT: &str = "RCUTILS_LOGGING_USE_STDOUT";

/// Back to the first column, and the line is empty.
const EMPTIED: &str = "\r\x1b[K";

/// What is longer than the terminal is wide is cut off, not continued on a line that would stay ...
const NO_WRAP: &str = "\x1b[?7l";
/// ... and what comes after it is not.
const WRAP: &str = "\x1b[?7h";

/// What stands at the foot now. The terminal is the process', and so is this.
static SHOWN: Mutex<String> = Mutex::new(String::new());

/// The line at the foot of the terminal, as long as this lives.
#[derive(Debug)]
pub struct StatusLine {
    _private: (),
}

impl StatusLine {
    /// `None` where stderr is no terminal: what is overwritten there would be one line after the other.
    #[must_use]
    pub fn on_terminal() -> Option<Self> {
        io::stderr().is_terminal().then(|| Self { _private: () })
    }

    /// Shows a text, in place of the one before.
    pub fn show(&self, text: &str) {
        let mut shown = shown();
        text.clone_into(&mut shown);
        // A terminal that is closed shows nothing.
        let _written = write(&mut io::stderr(), b"", &shown);
    }
}

impl Drop for StatusLine {
    fn drop(&mut self) {
        self.show("");
    }
}

/// The stream for the lines of the log.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum LogLines {
    Stderr,
    Stdout,
}

impl LogLines {
    /// That of the environment: stderr, unless it says otherwise.
    pub(super) fn of_environment() -> Self {
        Self::by(std::env::var(TO_STDOUT).ok().as_deref())
    }

    fn by(variable: Option<&str>) -> Self {
        if variable == Some("1") { Self::Stdout } else { Self::Stderr }
    }

    pub(super) fn is_terminal(self) -> bool {
        match self {
            Self::Stderr => io::stderr().is_terminal(),
            Self::Stdout => io::stdout().is_terminal(),
        }
    }

    pub(super) fn descriptor(self) -> u8 {
        match self {
            Self::Stderr => 2,
            Self::Stdout => 1,
        }
    }
}

impl Write for LogLines {
    fn write(&mut self, lines: &[u8]) -> io::Result<usize> {
        let shown = shown();
        // The line at the foot is on stderr: where that is a terminal, so is stdout, or else its lines do not meet it.
        match self {
            Self::Stdout if shown.is_empty() || !self.is_terminal() => io::stdout().write(lines),
            Self::Stdout => write(&mut io::stdout(), lines, &shown).map(|()| lines.len()),
            Self::Stderr if shown.is_empty() => io::stderr().write(lines),
            Self::Stderr => write(&mut io::stderr(), lines, &shown).map(|()| lines.len()),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Stderr => io::stderr().flush(),
            Self::Stdout => io::stdout().flush(),
        }
    }
}

fn shown() -> MutexGuard<'static, String> {
    SHOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Whole lines of the log, and the line at the foot below them.
fn write(to: &mut impl Write, lines: &[u8], foot: &str) -> io::Result<()> {
    let foot = if foot.is_empty() { String::new() } else { format!("{NO_WRAP}{foot}{WRAP}") };
    to.write_all(&[EMPTIED.as_bytes(), lines, foot.as_bytes()].concat())?;
    to.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: the variable had no effect.
    #[test]
    fn the_log_goes_to_stdout_where_the_variable_says_so() {
        assert_eq!(LogLines::by(Some("1")), LogLines::Stdout);
        for other in [None, Some(""), Some("0")] {
            assert_eq!(LogLines::by(other), LogLines::Stderr);
        }
    }

    #[test]
    fn the_log_goes_above_the_line() {
        let mut terminal = Vec::new();
        write(&mut terminal, b"", "7 cycles").unwrap();
        write(&mut terminal, b"[INFO]: saved\n", "7 cycles").unwrap();
        write(&mut terminal, b"", "").unwrap();
        let foot = format!("{NO_WRAP}7 cycles{WRAP}");
        let expected = format!("{EMPTIED}{foot}{EMPTIED}[INFO]: saved\n{foot}{EMPTIED}");
        assert_eq!(String::from_utf8(terminal).unwrap(), expected);
    }
}
