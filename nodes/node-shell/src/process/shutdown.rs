//! The end of a node: requested by a signal or by the program, seen by every task.

use std::sync::{Arc, OnceLock, Weak};

use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::watch;

/// Whether the node is to end. Clones share the answer.
#[derive(Clone, Debug)]
pub struct Shutdown {
    state: Arc<State>,
}

#[derive(Debug)]
struct State {
    asked: watch::Sender<bool>,
    failure: OnceLock<String>,
}

/// Asks for the end of what may have ended already.
#[derive(Debug)]
pub(crate) struct WeakShutdown(Weak<State>);

impl WeakShutdown {
    /// `None` once nothing is left to end.
    pub(crate) fn upgrade(&self) -> Option<Shutdown> {
        Some(Shutdown { state: self.0.upgrade()? })
    }
}

impl Default for Shutdown {
    fn default() -> Self {
        Self::new()
    }
}

impl Shutdown {
    /// One that is not requested yet.
    #[must_use]
    pub fn new() -> Self {
        Self {
            state: Arc::new(State { asked: watch::Sender::new(false), failure: OnceLock::new() }),
        }
    }

    /// Asks for the end.
    pub fn trigger(&self) {
        self.state.asked.send_replace(true);
    }

    pub(crate) fn downgrade(&self) -> WeakShutdown {
        WeakShutdown(Arc::downgrade(&self.state))
    }

    /// Asks for the end, which is then a failure of the process. The first reason counts.
    pub(crate) fn fail(&self, reason: String) {
        // There may be one already.
        let _ = self.state.failure.set(reason);
        self.trigger();
    }

    /// Why the process has failed, where the end is a failure.
    #[must_use]
    pub fn failure(&self) -> Option<&str> {
        self.state.failure.get().map(String::as_str)
    }

    /// Whether the end was requested.
    #[must_use]
    pub fn is_triggered(&self) -> bool {
        *self.state.asked.borrow()
    }

    /// Waits until the end is requested; returns at once when it was.
    pub async fn wait(&self) {
        // The sender lives in `self`, so the channel cannot close under the wait.
        let _ = self.state.asked.subscribe().wait_for(|asked| *asked).await;
    }

    /// Takes the [`ending_signals`] as asking for the end, from now on and for the whole process. Further ones change nothing: on
    /// Ctrl-C under `ros2 launch` a node gets one from the terminal and one from launch, some milliseconds later, and it is to
    /// finish what it saves. SIGKILL ends it at once.
    ///
    /// # Errors
    /// When the process may not handle signals.
    pub(crate) fn trigger_on_signals(&self) -> std::io::Result<()> {
        for number in ending_signals() {
            let mut signals = signal(SignalKind::from_raw(number))?;
            let shutdown = self.clone();
            tokio::spawn(async move {
                while signals.recv().await.is_some() {
                    if shutdown.is_triggered() {
                        tracing::info!("asked again to end: it is ending; SIGKILL cuts it off");
                    }
                    shutdown.trigger();
                }
            });
        }
        Ok(())
    }
}

/// The signals that ask a process for its end: SIGINT, SIGTERM, and SIGHUP, which comes when the terminal or the connection that it was
/// started from is closed. Whoever starts it with `nohup` wants it to live on: then SIGHUP is ignored, and stays so.
#[must_use]
pub fn ending_signals() -> Vec<i32> {
    let hangup = SignalKind::hangup().as_raw_value();
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mut signals = vec![SignalKind::interrupt(), SignalKind::terminate()];
    signals.extend((!is_ignored(&status, hangup)).then(SignalKind::hangup));
    signals.into_iter().map(|kind| kind.as_raw_value()).collect()
}

/// Whether a process ignores a signal, by its `/proc/PID/status`: the mask `SigIgn` has a bit for each, from 1 on.
fn is_ignored(status: &str, signal: i32) -> bool {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    let bit = u32::try_from(signal).ok().and_then(|signal| signal.checked_sub(1));
    let is_set =
        |mask: u64| bit.and_then(|bit| mask.checked_shr(bit)).is_some_and(|rest| rest & 1 == 1);
    mask.is_some_and(is_set)
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
        assert_eq!(shutdown.failure(), None);
    }

    #[test]
    fn a_process_of_nohup_ignores_the_hangup() {
        let status =
            |mask: &str| format!("Name:\tstillmap\nSigBlk:\t0000000000000001\nSigIgn:\t{mask}\n");
        assert!(is_ignored(&status("0000000000000001"), 1));
        assert!(
            is_ignored(&status("0000000000001001"), 1)
                && is_ignored(&status("0000000000001001"), 13)
        );
        for status in [status("0000000000001000"), status("0"), status("none"), String::new()] {
            assert!(!is_ignored(&status, 1), "{status}");
        }
    }

    #[test]
    fn the_first_reason_of_a_failure_counts() {
        let shutdown = Shutdown::new();
        shutdown.fail("memory".to_owned());
        shutdown.clone().fail("another".to_owned());
        assert!(shutdown.is_triggered());
        assert_eq!(shutdown.failure(), Some("memory"));
    }
}
