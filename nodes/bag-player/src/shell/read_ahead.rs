//! Read-ahead: neither the decompression of a chunk nor the compression of an image delays a message.

use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;

use tokio::runtime::Handle;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};

use crate::error::{BagError, Loss};
use crate::message::BagMessage;
use crate::messages::{Messages, Skipped};
use crate::shell::compress::{CompressError, Compression};
use crate::shell::latched::Earlier;

/// The limit of the read-ahead, in KiB: three seconds of a depth camera, six of the largest clouds.
const READ_AHEAD_KIB: u32 = 64 * 1024;

/// A message that was read, with its permit of the read-ahead.
pub(super) struct Ahead {
    pub(super) message: BagMessage,
    /// Why the message could not be compressed.
    pub(super) fault: Option<CompressError>,
    /// Whether it is latched from before the played part, and due at once.
    pub(super) is_earlier: bool,
    _share: OwnedSemaphorePermit,
}

/// The reader's result after its last message.
#[derive(Default)]
pub(super) struct PassEnd {
    pub(super) losses: Vec<Loss>,
    pub(super) skipped: BTreeMap<String, Skipped>,
    pub(super) out_of_order: u64,
}

enum Item {
    Message(Ahead),
    Failed(BagError),
    End(PassEnd),
}

/// A thread that reads messages, and its queue.
pub(super) struct ReadAhead {
    queue: mpsc::UnboundedReceiver<Item>,
    share: Arc<Semaphore>,
    end: PassEnd,
}

impl ReadAhead {
    /// Starts the thread; the messages come after the last ones of `earlier`. Must be called within a tokio runtime.
    pub(super) fn start(
        earlier: Option<Earlier>,
        messages: Messages,
        compression: &Compression,
    ) -> io::Result<Self> {
        let (sender, queue) = mpsc::unbounded_channel();
        let share = Arc::new(Semaphore::new(READ_AHEAD_KIB as usize));
        let (runtime, available) = (Handle::current(), Arc::clone(&share));
        let compression = compression.clone();
        std::thread::Builder::new().name("bag-reader".to_owned()).spawn(move || {
            read((earlier, messages), &compression, &sender, &available, &runtime)
        })?;
        Ok(Self { queue, share, end: PassEnd::default() })
    }

    /// The next message; `None` at the end of the bag.
    pub(super) async fn next(&mut self) -> Result<Option<Ahead>, BagError> {
        match self.queue.recv().await {
            Some(Item::Message(message)) => Ok(Some(message)),
            Some(Item::Failed(error)) => Err(error),
            Some(Item::End(end)) => {
                self.end = end;
                Ok(None)
            }
            None => Ok(None),
        }
    }

    /// The reader's result at the end of the bag.
    pub(super) fn take_end(&mut self) -> PassEnd {
        std::mem::take(&mut self.end)
    }
}

impl Drop for ReadAhead {
    fn drop(&mut self) {
        // The reader may be waiting for a permit that will not be released.
        self.share.close();
    }
}

fn read(
    (earlier, mut messages): (Option<Earlier>, Messages),
    compression: &Compression,
    sender: &mpsc::UnboundedSender<Item>,
    available: &Arc<Semaphore>,
    runtime: &Handle,
) {
    let earlier = match earlier.map(Earlier::last).transpose() {
        Ok(earlier) => earlier.unwrap_or_default(),
        Err(error) => {
            // Without a receiver nobody needs the reason.
            let _ = sender.send(Item::Failed(error));
            return;
        }
    };
    let earlier = earlier.into_iter().map(|message| (Ok(message), true));
    for (message, is_earlier) in earlier.chain(messages.by_ref().map(|message| (message, false))) {
        let item = match message {
            Ok(mut message) => {
                let fault = compression.apply(&mut message).err();
                // A message larger than the whole read-ahead is read alone.
                let kib = (message.data.len() / 1024 + 1).min(READ_AHEAD_KIB as usize) as u32;
                let share = runtime.block_on(Arc::clone(available).acquire_many_owned(kib));
                let Ok(share) = share else { return };
                Item::Message(Ahead { message, fault, is_earlier, _share: share })
            }
            Err(error) => Item::Failed(error),
        };
        if sender.send(item).is_err() {
            return;
        }
    }
    let end = PassEnd {
        losses: messages.losses().to_vec(),
        skipped: messages.skipped().clone(),
        out_of_order: messages.out_of_order(),
    };
    // Without a receiver nobody needs the result.
    let _ = sender.send(Item::End(end));
}

#[cfg(test)]
mod tests {
    use geometry::Stamp;
    use msgs::sensor_msgs::Image;

    use super::*;
    use crate::{Bag, BagWriter, OfferedQos, Selection};

    #[tokio::test]
    async fn no_more_is_read_ahead_than_the_limit() {
        const IMAGE_BYTES: usize = 4 << 20;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("images.mcap");
        let mut bag = BagWriter::create(&path).unwrap();
        let channel = bag.channel::<Image>("/image", OfferedQos::reliable(1)).unwrap();
        let image = Image { data: vec![0; IMAGE_BYTES], ..Image::default() };
        for number in 0..20 {
            let stamp = Stamp::from_nanos(number);
            bag.write(channel, stamp, &image).unwrap();
        }
        bag.finish().unwrap();
        let messages = Bag::open(&path).unwrap().messages(&Selection::default()).unwrap();
        let mut ahead = ReadAhead::start(None, messages, &Compression::default()).unwrap();
        let kib = IMAGE_BYTES / 1024 + 1;
        let mut held = Vec::new();
        // Whoever holds a message holds its share, so that reading waits in the end.
        while ahead.share.available_permits() >= kib {
            held.push(ahead.next().await.unwrap().unwrap());
        }
        let bytes: usize = held.iter().map(|ahead| ahead.message.data.len()).sum();
        assert!(bytes <= READ_AHEAD_KIB as usize * 1024, "{bytes}");
        held.clear();
        let mut rest = 0;
        while ahead.next().await.unwrap().is_some() {
            rest += 1;
        }
        assert!(rest >= 20 - READ_AHEAD_KIB as usize / kib, "{rest}");
    }
}
