//! The progress line of playback on a terminal.

use std::time::Duration;

use geometry::Stamp;

use super::terminal_line::TerminalLine;

/// The period of the line's updates.
const PERIOD: Duration = Duration::from_millis(200);

/// Cells of the bar.
const BAR_CELLS: usize = 24;

/// The line; nothing where stderr is no terminal.
pub(super) struct StatusLine {
    terminal: TerminalLine,
    keys: bool,
    start: Stamp,
    end: Stamp,
}

impl StatusLine {
    /// A line for playing from the one stamp to the other; `keys` when there are keys to name.
    pub(super) fn new((start, end): (Stamp, Stamp), keys: bool) -> Self {
        Self { terminal: TerminalLine::every(PERIOD), keys, start, end }
    }

    /// Whether the line is shown.
    pub(super) fn is_watched(&self) -> bool {
        self.terminal.is_watched()
    }

    /// The time of the next update.
    pub(super) fn due_in(&self) -> Duration {
        self.terminal.due_in()
    }

    /// Updates the line when it is due.
    pub(super) fn update(&mut self, time: Option<Stamp>, paused: bool) {
        let Self { terminal, keys, start, end } = self;
        terminal.update(|| line(*start, *end, time, paused, *keys));
    }

    /// Clears the line.
    pub(super) fn clear(&self) {
        self.terminal.clear();
    }
}

fn line(start: Stamp, end: Stamp, time: Option<Stamp>, paused: bool, keys: bool) -> String {
    let total_s = end.seconds_since(start).max(0.0);
    let done_s = time.map_or(0.0, |time| time.seconds_since(start).clamp(0.0, total_s));
    let share = if total_s > 0.0 { done_s / total_s } else { 1.0 };
    let filled = (share * BAR_CELLS as f64).round() as usize;
    let bar: String = (0..BAR_CELLS).map(|cell| if cell < filled { '#' } else { '.' }).collect();
    let state = if paused { "paused" } else { "playing" };
    let help = match (keys, paused) {
        (false, _) => "",
        (true, false) => "  [space: pause, q: quit]",
        (true, true) => "  [space: continue, s: one message, q: quit]",
    };
    format!("[{bar}] {done_s:.1} / {total_s:.1} s {state}{help}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_reports_the_progress() {
        let at = |seconds: i32| Stamp::from_secs_nanos(seconds, 0);
        assert_eq!(
            line(at(100), at(108), Some(at(102)), true, true),
            "[######..................] 2.0 / 8.0 s paused  [space: continue, s: one message, q: quit]"
        );
        assert_eq!(
            line(at(100), at(100), None, false, false),
            "[########################] 0.0 / 0.0 s playing"
        );
    }
}
