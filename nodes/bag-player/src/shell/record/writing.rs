//! The bag as it is written: on a thread of its own, since a disk may take its time.

use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::{self, JoinHandle};

use geometry::Stamp;
use tokio::sync::mpsc::{self, Receiver, Sender};

use super::error::RecordError;
use super::options::RecordOptions;
use crate::error::BagError;
use crate::qos::OfferedQos;
use crate::writer::{BagSummary, BagWriter, ChannelId};

/// Messages that may wait for the disk; more wait in their subscriptions, and then the oldest are lost.
const WAITING: usize = 64;

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

/// How much has been written.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Written {
    pub(super) messages: u64,
    /// Of the messages, before compression.
    pub(super) bytes: u64,
}

/// The thread that writes the bag.
pub(super) struct Writing {
    queue: Sender<Job>,
    written: Arc<Counts>,
    thread: JoinHandle<Result<BagSummary, BagError>>,
}

#[derive(Default)]
struct Counts {
    messages: AtomicU64,
    bytes: AtomicU64,
}

impl Writing {
    /// Begins a bag.
    pub(super) fn start(options: &RecordOptions) -> Result<Self, RecordError> {
        if options.output.exists() && !options.overwrite {
            return Err(RecordError::Exists { path: options.output.clone() });
        }
        let writer = BagWriter::create(&options.output)?;
        let (queue, jobs) = mpsc::channel(WAITING);
        let written = Arc::<Counts>::default();
        let counts = Arc::clone(&written);
        let thread = thread::Builder::new()
            .name("bag_writer".to_owned())
            .spawn(move || write_all(writer, jobs, &counts))
            .map_err(RecordError::Thread)?;
        Ok(Self { queue, written, thread })
    }

    /// Where to put what is to be written.
    pub(super) fn queue(&self) -> Sender<Job> {
        self.queue.clone()
    }

    /// Waits until nothing more can be written; for ever where all is well.
    pub(super) async fn has_failed(&self) {
        self.queue.closed().await;
    }

    pub(super) fn written(&self) -> Written {
        Written {
            messages: self.written.messages.load(Ordering::Relaxed),
            bytes: self.written.bytes.load(Ordering::Relaxed),
        }
    }

    /// Writes what waits still, and closes the bag. All other senders must be dropped by then.
    pub(super) async fn finish(self) -> Result<BagSummary, RecordError> {
        drop(self.queue);
        let joined = tokio::task::spawn_blocking(move || self.thread.join()).await;
        match joined.map_err(io::Error::other).map_err(RecordError::Thread)? {
            Ok(finished) => Ok(finished?),
            Err(_) => Err(RecordError::Thread(io::Error::other("it ended badly"))),
        }
    }
}

/// Writes until nobody has anything more to write.
fn write_all(
    mut writer: BagWriter,
    mut jobs: Receiver<Job>,
    counts: &Counts,
) -> Result<BagSummary, BagError> {
    let mut channels: BTreeMap<usize, ChannelId> = BTreeMap::new();
    while let Some(job) = jobs.blocking_recv() {
        match job {
            Job::Topic { number, topic, type_name, definition, offered } => {
                let offered = offered.to_yaml();
                let channel = writer.raw_channel(&topic, &type_name, &definition, &offered)?;
                channels.insert(number, channel);
            }
            Job::Message { number, log_time, publish_time, encoded } => {
                // Its topic was told before it.
                let Some(channel) = channels.get(&number) else { continue };
                writer.write_raw(*channel, log_time, publish_time, &encoded)?;
                counts.messages.fetch_add(1, Ordering::Relaxed);
                counts.bytes.fetch_add(encoded.len() as u64, Ordering::Relaxed);
            }
        }
    }
    writer.finish()
}
