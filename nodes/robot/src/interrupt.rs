//! Ctrl-C during long work: the work ends in order, and the results until then are written.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use node_shell::ending_signals;
use signal_hook::flag;

use crate::failure::Failure;

/// Whether the work is to end. Clones share the state.
#[derive(Clone, Debug, Default)]
pub struct Interrupt {
    has_come: Arc<AtomicBool>,
}

impl Interrupt {
    /// Handles the [`ending_signals`] as a request to end, from now on and for the whole process. Further signals change nothing.
    ///
    /// # Errors
    /// When the process may not handle signals.
    pub fn on_signals() -> Result<Self, Failure> {
        let interrupt = Self::default();
        for signal in ending_signals() {
            // The handler itself sets the flag: no thread and no runtime must run for it.
            flag::register(signal, Arc::clone(&interrupt.has_come))
                .map_err(|error| Failure::new(format!("cannot handle signals: {error}")))?;
        }
        Ok(interrupt)
    }

    /// Requests the end, as a signal does.
    pub fn trigger(&self) {
        self.has_come.store(true, Ordering::Relaxed);
    }

    /// Whether the end was requested.
    #[must_use]
    pub fn has_come(&self) -> bool {
        self.has_come.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use rustix::process::{Signal, getpid, kill_process};

    use super::*;

    #[test]
    fn every_clone_sees_the_signal() {
        let never = Interrupt::default();
        // Without SIGHUP where this was started by `nohup`.
        for number in ending_signals() {
            let signal = Signal::from_named_raw(number).unwrap();
            let interrupt = Interrupt::on_signals().unwrap();
            let seen = interrupt.clone();
            assert!(!seen.has_come());
            kill_process(getpid(), signal).unwrap();
            // Any thread may get it.
            while !seen.has_come() {
                std::thread::yield_now();
            }
            assert!(interrupt.has_come() && !never.has_come());
        }
    }
}
