//! A progress bar on a terminal.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Progress of long work on stderr; draws nothing where stderr is no terminal.
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// Work of `steps` steps under a name.
    pub fn new(name: &str, steps: u64) -> Self {
        let bar = ProgressBar::with_draw_target(Some(steps), ProgressDrawTarget::stderr());
        if let Ok(style) =
            ProgressStyle::with_template("{prefix} [{bar:40}] {pos}/{len} {msg} {eta}")
        {
            bar.set_style(style);
        }
        bar.set_prefix(name.to_owned());
        Self { bar }
    }

    /// Counts one more step as done.
    pub fn advance(&self) {
        self.bar.inc(1);
    }

    /// Sets the number of steps that are done.
    pub fn set(&self, steps: u64) {
        self.bar.set_position(steps);
    }

    /// The work is done: removes the bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
