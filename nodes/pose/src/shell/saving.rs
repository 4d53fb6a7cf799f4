//! A map that is being written while the node continues.

use msgs::std_srvs::Trigger;
use node_shell::{NodeFailure, Request};
use tokio::task::JoinHandle;

use super::map_file::MapFile;
use crate::saved_map::SavedMap;

/// A map that is being written, and the client that gets the answer. One at a time.
#[derive(Default)]
pub(super) struct Saving<'a> {
    running: Option<Running<'a>>,
}

struct Running<'a> {
    request: Request<'a, Trigger>,
    task: JoinHandle<Result<String, NodeFailure>>,
}

impl<'a> Saving<'a> {
    /// Whether another one may begin.
    pub(super) fn is_idle(&self) -> bool {
        self.running.is_none()
    }

    /// Begins to write, or answers why it is not written.
    pub(super) fn begin(
        &mut self,
        request: Request<'a, Trigger>,
        what: Result<(MapFile, SavedMap), NodeFailure>,
    ) {
        match what {
            Ok((file, map)) => {
                let task = tokio::task::spawn_blocking(move || file.save(&map));
                self.running = Some(Running { request, task });
            }
            Err(error) => request.answer(Err(error)),
        }
    }

    /// Answers when it is written. May be dropped while it waits; never returns when nothing is written.
    pub(super) async fn finish(&mut self) {
        let Some(running) = &mut self.running else { return std::future::pending().await };
        let done = (&mut running.task).await.unwrap_or_else(|error| Err(error.into()));
        if let Some(running) = self.running.take() {
            running.request.answer(done);
        }
    }
}
