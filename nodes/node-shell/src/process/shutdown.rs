//! The end of a node: asked for by a signal or by the program, seen by every task.

use std::sync::Arc;

use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::watch;

/// Exit code of a process that was told twice to end (128 + SIGINT, as shells have it).
const IMPATIENT_EXIT_CODE: i32 = 130;

/// Whether the node is to end. Clones share the answer.
#[derive(Clone, Debug)]
pub struct Shutdown {
    asked: Arc<watch::Sender<bool>>,
}

impl Default for Shutdown {
    fn default() -> Self {
        Self::new()
    }
}

impl Shutdown {
    /// One that nobody has asked for yet.
    #[must_use]
    pub fn new() -> Self {
        Self { asked: Arc::new(watch::Sender::new(false)) }
    }

    /// Asks for the end.
    pub fn trigger(&self) {
        self.asked.send_replace(true);
    }

    /// Whether the end was asked for.
    #[must_use]
    pub fn is_triggered(&self) -> bool {
        *self.asked.borrow()
    }

    /// Waits until the end is asked for; returns at once when it was.
    pub async fn wait(&self) {
        // The sender lives in `self`, so the channel cannot close under the wait.
        let _ = self.asked.subscribe().wait_for(|asked| *asked).await;
    }

    /// Takes SIGINT and SIGTERM as asking for the end, from now on and for the whole process. A second
    /// signal ends the process at once.
    ///
    /// # Errors
    /// When the process may not handle signals.
    pub(crate) fn trigger_on_signals(&self) -> std::io::Result<()> {
        let mut interrupt = signal(SignalKind::interrupt())?;
        let mut terminate = signal(SignalKind::terminate())?;
        let shutdown = self.clone();
        tokio::spawn(async move {
            loop {
                tokio::select! {
                    _ = interrupt.recv() => {}
                    _ = terminate.recv() => {}
                }
                if shutdown.is_triggered() {
                    tracing::warn!("told again to end: ending at once");
                    std::process::exit(IMPATIENT_EXIT_CODE);
                }
                shutdown.trigger();
            }
        });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn every_clone_sees_the_end_before_and_after() {
        let shutdown = Shutdown::new();
        let waiting = shutdown.clone();
        let task = tokio::spawn(async move { waiting.wait().await });
        assert!(!shutdown.is_triggered());
        shutdown.trigger();
        task.await.unwrap();
        shutdown.wait().await;
        assert!(shutdown.clone().is_triggered());
    }
}
