//! How long the steps of a cycle take.

use std::time::{Duration, Instant};

/// Times one step after the other.
#[derive(Clone, Debug)]
pub struct StepTimer {
    since: Instant,
    steps: Vec<(&'static str, Duration)>,
}

impl StepTimer {
    /// The first step starts now.
    #[must_use]
    pub fn start() -> Self {
        Self { since: Instant::now(), steps: Vec::new() }
    }

    /// The step that runs ends now, and the next one starts.
    pub fn end_of(&mut self, step: &'static str) {
        let now = Instant::now();
        self.steps.push((step, now - self.since));
        self.since = now;
    }

    /// The steps so far, in order.
    #[must_use]
    pub fn steps(&self) -> &[(&'static str, Duration)] {
        &self.steps
    }
}
