//! The queue of messages to write, bounded by its bytes, so that the disk may pause for seconds whatever is recorded. While it is
//! full, messages wait in their subscriptions; the oldest there are lost and counted.

#[cfg(test)]
mod tests;

use std::sync::Arc;

use geometry::Stamp;
use tokio::sync::mpsc::{self, UnboundedReceiver, UnboundedSender};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::qos::OfferedQos;

/// The capacity in bytes: five seconds of clouds of 4.9 MB at 10 Hz.
pub(super) const WAITING_BYTES: usize = 256 << 20;
/// The unit of the capacity: a semaphore has fewer permits than memory has bytes.
const UNIT_BYTES: usize = 1 << 10;

/// A write job.
pub(super) enum Job {
    /// A new topic, which gets this number.
    Topic {
        number: usize,
        topic: String,
        type_name: String,
        definition: String,
        type_hash: Option<String>,
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

/// A queued job. Its permits are released when this is dropped.
pub(super) struct Waiting {
    pub(super) job: Job,
    pub(super) _room: OwnedSemaphorePermit,
}

/// The sending end.
#[derive(Clone)]
pub(super) struct Queue {
    jobs: UnboundedSender<Waiting>,
    room: Arc<Semaphore>,
    units: usize,
}

impl Queue {
    /// An empty queue with this capacity in bytes, and its receiving end.
    pub(super) fn new(bytes: usize) -> (Self, UnboundedReceiver<Waiting>) {
        let (jobs, taken) = mpsc::unbounded_channel();
        let units = bytes.div_ceil(UNIT_BYTES).clamp(1, Semaphore::MAX_PERMITS);
        (Self { jobs, room: Arc::new(Semaphore::new(units)), units }, taken)
    }

    /// Adds a job when there is room; one that is larger than the capacity waits until the queue is empty. `false` where the writer
    /// has ended.
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

    /// Waits until the writer has ended, which happens only on an error.
    pub(super) async fn closed(&self) {
        self.jobs.closed().await;
    }
}
