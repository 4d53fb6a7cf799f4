//! The end of a subscription on the network: on Zenoh a subscription, and on DDS a reader of its library, which may be replaced
//! by a new one under the subscription's hands.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

use msgs::RosMessage;
#[cfg(feature = "zenoh")]
use ros2_client::{Gid, ROSTime};
use ros2_client::{MessageInfo, ReadError};

use crate::endpoints::assembly::AssemblyWatch;
use crate::graph::Renew;
use crate::process::memory::resident_bytes;
use crate::process::throttle::Throttle;
use crate::settings::qos::is_bulk;
#[cfg(feature = "zenoh")]
use crate::wire::rmw_zenoh::attachment::REFUSED;
#[cfg(feature = "zenoh")]
use crate::wire::rmw_zenoh::topics::{ZenohMessage, ZenohSubscription};

/// How often a reader that waits looks after its memory.
const LOOK_AFTER: Duration = Duration::from_millis(100);

/// A message with its metadata, or why it is invalid.
pub(crate) type Taken<M> = Result<(M, MessageInfo), ReadError>;

type LibraryReader<M> = ros2_client::Subscription<M>;

/// Makes the next reader; the graph knows it by then.
pub(crate) type MakeReader<M> = Box<dyn Fn() -> Result<LibraryReader<M>, String> + Send + Sync>;

/// The end of a subscription on the network.
pub(crate) enum Outside<M> {
    Dds(Reader<M>),
    #[cfg(feature = "zenoh")]
    Zenoh(ZenohSubscription),
}

impl<M: RosMessage> Outside<M> {
    /// The next message if it is here already.
    pub(crate) fn take(&self) -> Option<Taken<M>> {
        match self {
            Self::Dds(reader) => reader.take(),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(subscription) => subscription.take().map(decoded),
        }
    }

    /// Waits for the next message. May be dropped while it waits: no message is lost by that.
    pub(crate) async fn next(&self, has_publishers: impl Fn() -> bool) -> Taken<M> {
        match self {
            Self::Dds(reader) => reader.next(has_publishers).await,
            #[cfg(feature = "zenoh")]
            Self::Zenoh(subscription) => decoded(subscription.next().await),
        }
    }

    /// Notes a message that came, and how many were lost before it.
    pub(crate) fn heard(&self, message: &M, lost: u64) {
        match self {
            Self::Dds(reader) => reader.heard(message, lost),
            // Zenoh keeps no part of a message that does not become whole.
            #[cfg(feature = "zenoh")]
            Self::Zenoh(_) => {}
        }
    }

    /// The reader of DDS.
    #[cfg(test)]
    pub(crate) fn dds(&self) -> Option<&Reader<M>> {
        match self {
            Self::Dds(reader) => Some(reader),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(_) => None,
        }
    }
}

#[cfg(feature = "zenoh")]
fn decoded<M: RosMessage>(message: ZenohMessage) -> Taken<M> {
    let refused = || ReadError::Deserialization { reason: REFUSED.to_owned() };
    let attachment = message.attachment.ok_or_else(refused)?;
    let decoded = msgs::cdr::decode(&message.encoded)
        .map_err(|error| ReadError::Deserialization { reason: error.to_string() })?;
    let sent = ROSTime::from_nanos(attachment.sent_ns);
    let sender = Gid::from(attachment.sender);
    Ok((decoded, MessageInfo::new(None, Some(sent), attachment.number, sender, None)))
}

/// A reader, and what is needed to replace it.
pub(crate) struct Reader<M> {
    link: Arc<Link<M>>,
    /// None for a reliable reader: the library never drops a message that such a reader has begun.
    assembly: Option<Assembly>,
    /// Lives longer than one wait, which its owner may cut short again and again.
    next_look: Mutex<tokio::time::Instant>,
}

/// The library's reader of the moment.
struct Link<M> {
    topic: Arc<str>,
    current: Mutex<Arc<LibraryReader<M>>>,
    make: MakeReader<M>,
}

/// Watches over incomplete messages.
struct Assembly {
    watch: Mutex<AssemblyWatch>,
    warnings: Throttle,
}

impl<M> Link<M> {
    /// Replaces the reader by a new one; `false` where that is refused.
    fn renew(&self) -> bool {
        match (self.make)() {
            Ok(reader) => {
                *self.lock() = Arc::new(reader);
                true
            }
            Err(reason) => {
                tracing::warn!("{}: {reason}", self.topic);
                false
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, Arc<LibraryReader<M>>> {
        self.current.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<M: RosMessage> Renew for Link<M> {
    fn renew(&self) {
        self.renew();
    }
}

impl Assembly {
    fn new(is_bulk: bool) -> Self {
        let watch = AssemblyWatch::new(is_bulk, Instant::now(), resident_bytes());
        Self { watch: Mutex::new(watch), warnings: Throttle::for_warnings() }
    }

    fn lock(&self) -> MutexGuard<'_, AssemblyWatch> {
        self.watch.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<M: RosMessage> Reader<M> {
    /// `type_name` as `sensor_msgs/msg/Image`.
    pub(crate) fn new(
        (topic, type_name): (&str, &str),
        first: LibraryReader<M>,
        reliable: bool,
        make: MakeReader<M>,
    ) -> Self {
        let link = Link { topic: topic.into(), current: Mutex::new(Arc::new(first)), make };
        let next_look = Mutex::new(tokio::time::Instant::now() + LOOK_AFTER);
        let assembly = (!reliable).then(|| Assembly::new(is_bulk(type_name)));
        Self { link: Arc::new(link), assembly, next_look }
    }

    /// Creates the reader again.
    pub(crate) fn renewal(&self) -> Weak<dyn Renew> {
        let link: Weak<Link<M>> = Arc::downgrade(&self.link);
        link
    }

    /// The next message if it is here already.
    pub(crate) fn take(&self) -> Option<Taken<M>> {
        self.current().take().transpose()
    }

    /// Waits for the next message. May be dropped while it waits: no message is lost by that.
    pub(crate) async fn next(&self, has_publishers: impl Fn() -> bool) -> Taken<M> {
        loop {
            let reader = self.current();
            let next_look = *self.lock_next_look();
            match tokio::time::timeout_at(next_look, reader.async_take()).await {
                Ok(taken) => return taken,
                Err(_) => self.look_after_silence(has_publishers()),
            }
        }
    }

    /// Notes a message that came while it was waited for, and how many were lost before it: those were not
    /// displaced by later ones, but never whole.
    pub(crate) fn heard(&self, message: &M, lost: u64) {
        let Some(assembly) = &self.assembly else { return };
        let now = Instant::now();
        let mut watch = assembly.lock();
        watch.heard(now);
        if lost == 0 {
            return;
        }
        // The lost ones are taken to be as long as this one.
        let bytes_each = msgs::cdr::encoded_len(message).map_or(0, |bytes| bytes as u64);
        watch.lost(now, lost, bytes_each);
        let too_much = watch.lost_too_much(now);
        drop(watch);
        if too_much {
            self.start_anew(assembly);
        }
    }

    fn look_after_silence(&self, has_publishers: bool) {
        *self.lock_next_look() = tokio::time::Instant::now() + LOOK_AFTER;
        let (Some(assembly), Some(resident)) = (&self.assembly, resident_bytes()) else { return };
        let grows = assembly.lock().grows_in_silence(Instant::now(), resident, has_publishers);
        if grows {
            self.start_anew(assembly);
        }
    }

    fn start_anew(&self, assembly: &Assembly) {
        if self.link.renew()
            && let Some(held_back) = assembly.warnings.pass()
        {
            tracing::warn!(
                "{}: incomplete messages filled the memory; they \
                 are dropped ({held_back} more such since the last warning)",
                self.link.topic
            );
        }
        let mut watch = assembly.lock();
        *watch = watch.anew(Instant::now(), resident_bytes());
    }

    /// Distinguishes the library's readers.
    #[cfg(test)]
    pub(crate) fn in_use(&self) -> usize {
        Arc::as_ptr(&self.link.lock()) as usize
    }

    fn current(&self) -> Arc<LibraryReader<M>> {
        Arc::clone(&self.link.lock())
    }

    fn lock_next_look(&self) -> MutexGuard<'_, tokio::time::Instant> {
        self.next_look.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
