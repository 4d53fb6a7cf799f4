//! The end of a subscription on the network: a reader of the DDS library, which may be replaced by a new
//! one under the subscription's hands.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use msgs::RosMessage;
use ros2_client::{MessageInfo, ReadError};

use crate::assembly::{AssemblyWatch, resident_bytes};
use crate::throttle::Throttle;

/// How often a reader that waits looks after its memory.
const LOOK_AFTER: Duration = Duration::from_millis(100);

/// A message with what came along, or why it is none.
pub(crate) type Taken<M> = Result<(M, MessageInfo), ReadError>;

type LibraryReader<M> = ros2_client::Subscription<M>;

/// Makes the next reader; the graph knows it by then.
pub(crate) type MakeReader<M> = Box<dyn Fn() -> Result<LibraryReader<M>, String> + Send + Sync>;

/// A reader, and what is needed to replace it.
pub(crate) struct Reader<M> {
    topic: Arc<str>,
    current: Mutex<Arc<LibraryReader<M>>>,
    renewal: Option<Renewal<M>>,
    /// Lives longer than one wait, which its owner may cut short again and again.
    next_look: Mutex<tokio::time::Instant>,
}

/// None for a reliable reader: the library never gives up what such a one has begun.
pub(crate) struct Renewal<M> {
    make: MakeReader<M>,
    watch: Mutex<AssemblyWatch>,
    warnings: Throttle,
}

impl<M> Renewal<M> {
    pub(crate) fn new(make: MakeReader<M>) -> Self {
        let watch = AssemblyWatch::new(Instant::now(), resident_bytes());
        Self { make, watch: Mutex::new(watch), warnings: Throttle::for_warnings() }
    }

    fn watch(&self) -> MutexGuard<'_, AssemblyWatch> {
        self.watch.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<M: RosMessage> Reader<M> {
    pub(crate) fn new(topic: &str, reader: LibraryReader<M>, renewal: Option<Renewal<M>>) -> Self {
        let next_look = Mutex::new(tokio::time::Instant::now() + LOOK_AFTER);
        Self { topic: topic.into(), current: Mutex::new(Arc::new(reader)), renewal, next_look }
    }

    /// The next message if it is here already.
    pub(crate) fn take(&self) -> Option<Taken<M>> {
        self.current().take().transpose()
    }

    /// Waits for the next message. May be dropped while it waits: no message is lost by that.
    pub(crate) async fn next(&self) -> Taken<M> {
        loop {
            let reader = self.current();
            let next_look = *self.lock_next_look();
            match tokio::time::timeout_at(next_look, reader.async_take()).await {
                Ok(taken) => return taken,
                Err(_) => self.look_after_silence(),
            }
        }
    }

    /// Notes a message that came while it was waited for, and how many were lost before it: those were not
    /// displaced by later ones, but never whole.
    pub(crate) fn heard(&self, message: &M, lost: u64) {
        let Some(renewal) = &self.renewal else { return };
        let now = Instant::now();
        let mut watch = renewal.watch();
        watch.heard(now);
        if lost == 0 {
            return;
        }
        // The lost ones are taken to be as long as this one.
        let bytes_each = msgs::cdr::encode(message).map_or(0, |encoded| encoded.len() as u64);
        watch.lost(now, lost, bytes_each);
        let too_much = watch.lost_too_much(now);
        drop(watch);
        if too_much {
            self.renew(renewal);
        }
    }

    fn look_after_silence(&self) {
        *self.lock_next_look() = tokio::time::Instant::now() + LOOK_AFTER;
        let (Some(renewal), Some(resident)) = (&self.renewal, resident_bytes()) else { return };
        let grows = renewal.watch().grows_in_silence(Instant::now(), resident);
        if grows {
            self.renew(renewal);
        }
    }

    /// Replaces the reader by a new one.
    #[cfg(test)]
    pub(crate) fn renew_now(&self) {
        if let Some(renewal) = &self.renewal {
            self.renew(renewal);
        }
    }

    fn renew(&self, renewal: &Renewal<M>) {
        match (renewal.make)() {
            Ok(reader) => {
                *self.lock() = Arc::new(reader);
                if let Some(held_back) = renewal.warnings.pass() {
                    tracing::warn!(
                        "{}: so many messages came in part only that their rests filled the memory; \
                         they are dropped ({held_back} more such since the last warning)",
                        self.topic
                    );
                }
            }
            Err(reason) => tracing::warn!("{}: {reason}", self.topic),
        }
        *renewal.watch() = AssemblyWatch::new(Instant::now(), resident_bytes());
    }

    fn current(&self) -> Arc<LibraryReader<M>> {
        Arc::clone(&self.lock())
    }

    fn lock_next_look(&self) -> MutexGuard<'_, tokio::time::Instant> {
        self.next_look.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn lock(&self) -> MutexGuard<'_, Arc<LibraryReader<M>>> {
        self.current.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
