//! Ctrl-C on long work: it ends in order, and what was made until then is written.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use tokio::signal::unix::{SignalKind, signal};

use crate::failure::Failure;

/// Whether the work is to end. Clones share the answer.
#[derive(Clone, Debug, Default)]
pub struct Interrupt {
    has_come: Arc<AtomicBool>,
}

impl Interrupt {
    /// Takes SIGINT and SIGTERM as asking for the end, from now on and for the whole process. Further ones change nothing.
    ///
    /// # Errors
    /// When the process may not handle signals, or has no thread for it.
    pub fn on_signals() -> Result<Self, Failure> {
        let failed =
            |error: std::io::Error| Failure::new(format!("cannot listen to signals: {error}"));
        let interrupt = Self::default();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_io().build();
        let runtime = runtime.map_err(failed)?;
        let in_runtime = runtime.enter();
        let mut int = signal(SignalKind::interrupt()).map_err(failed)?;
        let mut term = signal(SignalKind::terminate()).map_err(failed)?;
        drop(in_runtime);
        let has_come = Arc::clone(&interrupt.has_come);
        let wait = move || {
            runtime.block_on(async {
                tokio::select! {
                    _ = int.recv() => {}
                    _ = term.recv() => {}
                }
            });
            has_come.store(true, Ordering::Relaxed);
        };
        // It ends with the process.
        std::thread::Builder::new().name("signals".to_owned()).spawn(wait).map_err(failed)?;
        Ok(interrupt)
    }

    /// Asks for the end, as a signal does.
    pub fn trigger(&self) {
        self.has_come.store(true, Ordering::Relaxed);
    }

    /// Whether the end was asked for.
    #[must_use]
    pub fn has_come(&self) -> bool {
        self.has_come.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_clone_sees_the_signal() {
        let never = Interrupt::default();
        let interrupt = Interrupt::on_signals().unwrap();
        let seen = interrupt.clone();
        assert!(!seen.has_come());
        rustix::process::kill_process(rustix::process::getpid(), rustix::process::Signal::INT)
            .unwrap();
        // The signal is on its way to the thread; the test fails by the limit of the test's run.
        while !seen.has_come() {
            std::thread::yield_now();
        }
        assert!(interrupt.has_come() && !never.has_come());
    }
}
