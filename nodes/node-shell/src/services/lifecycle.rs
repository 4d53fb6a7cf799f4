//! Managed nodes: others bring a node up, let it pause, and end it.
//!
//! An inactive node keeps its endpoints. Messages that arrive meanwhile are ignored, except on topics that keep their
//! last message for late subscribers: these deliver it once. Nothing is published but the node's own state:
//! `/diagnostics`, `/parameter_events`, `/rosout`, its transitions. Publishers and subscriptions see to that; the node's
//! body has to say only how it drops its state, and must leave alone what it does by a timer.

mod services;
#[cfg(test)]
mod tests;

use std::time::Duration;

use tokio::sync::{mpsc, oneshot};

pub(crate) use services::LifecycleServices;

use crate::node::Node;
use crate::node::life::Life;
use crate::wire::error::ShellError;

/// A node that has ended answers for this long before its process ends: who manages it asks for its state, and ends the other nodes of
/// the process.
const FAREWELL: Duration = Duration::from_secs(2);

impl Node {
    /// Lets others manage the node as long as it runs; see [`Lifecycle`]. The node is active from the start unless its
    /// parameter `autostart` is false.
    ///
    /// # Errors
    /// When a name is none, or the library refuses.
    pub fn manage(&self) -> Result<Lifecycle, ShellError> {
        self.manage_with(FAREWELL)
    }

    fn manage_with(&self, farewell: Duration) -> Result<Lifecycle, ShellError> {
        let Some(network) = self.network() else { return Ok(Lifecycle::unmanaged()) };
        let (services, lifecycle) =
            LifecycleServices::open(self, self.life(), self.switches().autostart)?;
        network.spawn(move |stop| services.run(farewell, stop));
        Ok(lifecycle)
    }
}

/// The life of a node, as its body sees it.
#[derive(Debug)]
pub struct Lifecycle {
    life: Life,
    /// None on a node that is on no network: it is not managed there.
    resets: Option<mpsc::Receiver<Reset>>,
}

impl Lifecycle {
    pub(crate) fn unmanaged() -> Self {
        Self { life: Life::default(), resets: None }
    }

    /// Whether the node is to work. What it receives and publishes goes by that already; this is for what it does by
    /// itself, as by a timer.
    #[must_use]
    pub fn is_active(&self) -> bool {
        self.life.gate().is_open()
    }

    /// Waits until the node is to drop what it holds, and be as it was at its start. The transition ends when the value that is
    /// returned is dropped. May be dropped while waiting.
    pub async fn reset(&mut self) -> Reset {
        if let Some(resets) = &mut self.resets
            && let Some(reset) = resets.recv().await
        {
            return reset;
        }
        std::future::pending().await
    }
}

/// The node is to drop what it holds. To be dropped when it has.
#[derive(Debug)]
#[must_use = "the node is taken to have dropped its state when this is dropped"]
pub struct Reset {
    done: Option<oneshot::Sender<()>>,
}

impl Drop for Reset {
    fn drop(&mut self) {
        if let Some(done) = self.done.take() {
            // The client may have gone.
            let _ = done.send(());
        }
    }
}
