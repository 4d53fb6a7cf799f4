//! The writer of the bag, on a separate thread, since a disk may be slow.

use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::{self, JoinHandle};

use node_shell::Throttle;
use tokio::sync::mpsc::UnboundedReceiver;

use super::error::RecordError;
use super::options::RecordOptions;
use super::queue::{Job, Queue, WAITING_BYTES, Waiting};
use crate::error::BagError;
use crate::writer::{BagSummary, BagWriter, ChannelId};

/// The written amount.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Written {
    pub(super) messages: u64,
    /// The bytes of the messages, before compression.
    pub(super) bytes: u64,
}

/// The thread that writes the bag.
pub(super) struct Writing {
    queue: Queue,
    behind: Throttle,
    written: Arc<Counts>,
    thread: JoinHandle<Result<BagSummary, BagError>>,
}

#[derive(Default)]
struct Counts {
    messages: AtomicU64,
    bytes: AtomicU64,
}

impl Writing {
    /// Creates a bag.
    pub(super) fn start(options: &RecordOptions) -> Result<Self, RecordError> {
        let writer = BagWriter::create(&options.output)?;
        let (queue, jobs) = Queue::new(WAITING_BYTES);
        let written = Arc::<Counts>::default();
        let counts = Arc::clone(&written);
        let thread = thread::Builder::new()
            .name("bag_writer".to_owned())
            .spawn(move || write_all(writer, jobs, &counts))
            .map_err(RecordError::Thread)?;
        Ok(Self { queue, behind: Throttle::for_warnings(), written, thread })
    }

    /// The queue of write jobs.
    pub(super) fn queue(&self) -> Queue {
        self.queue.clone()
    }

    /// Warns when messages arrive faster than they are written, before any are lost.
    pub(super) fn warn_if_behind(&mut self) {
        if self.queue.is_full()
            && let Some(held_back) = self.behind.pass()
        {
            tracing::warn!(
                "messages come faster than the bag is written: {} MB wait for the disk; when no more can wait, the oldest are \
                 lost and counted. Record fewer topics (--topics, --exclude), or to a faster disk ({held_back} more since the \
                 last warning)",
                WAITING_BYTES / 1_000_000
            );
        }
    }

    /// Waits until the writer has ended, which happens only on an error.
    pub(super) async fn has_failed(&self) {
        self.queue.closed().await;
    }

    pub(super) fn written(&self) -> Written {
        Written {
            messages: self.written.messages.load(Ordering::Relaxed),
            bytes: self.written.bytes.load(Ordering::Relaxed),
        }
    }

    /// Writes the queued messages, and closes the bag. All other senders must have been dropped.
    pub(super) async fn finish(self) -> Result<BagSummary, RecordError> {
        drop(self.queue);
        let joined = tokio::task::spawn_blocking(move || self.thread.join()).await;
        match joined.map_err(io::Error::other).map_err(RecordError::Thread)? {
            Ok(finished) => Ok(finished?),
            Err(_) => Err(RecordError::Thread(io::Error::other("the thread panicked"))),
        }
    }
}

/// Writes until all senders are dropped.
fn write_all(
    mut writer: BagWriter,
    mut jobs: UnboundedReceiver<Waiting>,
    counts: &Counts,
) -> Result<BagSummary, BagError> {
    let mut channels: BTreeMap<usize, ChannelId> = BTreeMap::new();
    // Its permits are released after it is written.
    while let Some(Waiting { job, _room }) = jobs.blocking_recv() {
        match job {
            Job::Topic { number, topic, type_name, definition, type_hash, offered } => {
                let offered = offered.to_yaml();
                let described = (type_name.as_str(), definition.as_str());
                let hash = type_hash.as_deref();
                let channel = writer.hashed_channel(&topic, described, hash, &offered)?;
                channels.insert(number, channel);
            }
            Job::Message { number, log_time, publish_time, encoded } => {
                // Its topic was written before.
                let Some(channel) = channels.get(&number) else { continue };
                writer.write_raw(*channel, log_time, publish_time, &encoded)?;
                counts.messages.fetch_add(1, Ordering::Relaxed);
                counts.bytes.fetch_add(encoded.len() as u64, Ordering::Relaxed);
            }
        }
    }
    writer.finish()
}
