//! What waits for the disk: bounded by its bytes, so that a disk may pause for seconds whatever is recorded. Who has more to
//! write waits; then messages wait in their subscriptions, and the oldest there are lost and counted.

#[cfg(test)]
mod tests;

use std::sync::Arc;

use geometry::Stamp;
use tokio::sync::mpsc::{self, UnboundedReceiver, UnboundedSender};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::qos::OfferedQos;

/// Bytes that may wait: five seconds of clouds of 4.9 MB at 10 Hz.
pub(super) const WAITING_BYTES: usize = 256 << 20;
/// What is counted in: a semaphore has fewer permits than memory has bytes.
const UNIT_BYTES: usize = 1 << 10;

/// What is to be written.
pub(super) enum Job {
    /// A topic has come up, and gets this number.
    Topic {
        number: usize,
        topic: String,
        type_name: String,
        definition: String,
        offered: OfferedQos,
    },
    /// A message of the topic of this number.
    Message { number: usize, log_time: Stamp, publish_time: Stamp, encoded: Vec<u8> },
}

impl Job {
    fn bytes(&self) -> usize {
        match self {
            Self::Topic { definition, .. } => definition.len(),
            Self::Message { encoded, .. } => encoded.len(),
        }
    }
}

/// A job that waits. The room that it takes is free when this is dropped.
pub(super) struct Waiting {
    pub(super) job: Job,
    pub(super) _room: OwnedSemaphorePermit,
}

/// Where jobs are put.
#[derive(Clone)]
pub(super) struct Queue {
    jobs: UnboundedSender<Waiting>,
    room: Arc<Semaphore>,
    units: usize,
}

impl Queue {
    /// An empty queue for so many bytes, and where the jobs come out.
    pub(super) fn new(bytes: usize) -> (Self, UnboundedReceiver<Waiting>) {
        let (jobs, taken) = mpsc::unbounded_channel();
        let units = bytes.div_ceil(UNIT_BYTES).clamp(1, Semaphore::MAX_PERMITS);
        (Self { jobs, room: Arc::new(Semaphore::new(units)), units }, taken)
    }

    /// Puts a job in when there is room; one that is larger than all of it waits until it is alone. `false` where nothing is
    /// written any more.
    pub(super) async fn put(&self, job: Job) -> bool {
        let units = job.bytes().div_ceil(UNIT_BYTES).clamp(1, self.units);
        let Ok(units) = u32::try_from(units) else { return false };
        let room = Arc::clone(&self.room).acquire_many_owned(units).await;
        room.is_ok_and(|room| self.jobs.send(Waiting { job, _room: room }).is_ok())
    }

    /// Whether a job of the largest messages would have to wait.
    pub(super) fn is_full(&self) -> bool {
        self.room.available_permits() * 16 < self.units
    }

    /// Waits until nothing is written any more; for ever where all is well.
    pub(super) async fn closed(&self) {
        self.jobs.closed().await;
    }
}
