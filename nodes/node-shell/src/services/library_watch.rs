//! Whether the DDS library still serves the node.
//!
//! RustDDS 0.15.1 ends a thread of its own for good where its wait for events is interrupted: when the process was stopped and goes on
//! (Ctrl-Z and `fg`), or a debugger took hold of it. The node would live on, deaf and mute. So it ends as one that has failed, with
//! what it saves at its end, and who started it starts it again.

use std::sync::Arc;
use std::time::Duration;

use futures::FutureExt;

use crate::process::shutdown::Shutdown;
use crate::wire::transport::LibraryThreads;

/// How often the threads are looked at.
const PERIOD: Duration = Duration::from_secs(1);

/// Looks until `stop` resolves: from then on the threads end by right.
pub(crate) async fn watch(
    threads: Arc<LibraryThreads>,
    shutdown: Shutdown,
    stop: impl Future<Output = ()>,
) {
    futures::pin_mut!(stop);
    loop {
        tokio::select! {
            () = &mut stop => return,
            () = tokio::time::sleep(PERIOD) => {}
        }
        if threads.have_ended() && stop.as_mut().now_or_never().is_none() {
            let reason = "the DDS library has ended, as it does when the process was stopped and goes on (Ctrl-Z, a debugger): the \
                          process ends, to be started again";
            tracing::error!("{reason}");
            shutdown.fail(reason.to_owned());
            return;
        }
    }
}
