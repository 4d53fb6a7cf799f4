//! The end of a publisher on the network: on Zenoh a publisher, and on DDS a writer of its library, which may be replaced by
//! a new one under the publisher's hands.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ros2_client::WriteError;

use crate::graph::Renew;
use crate::wire::error::PublishError;
use crate::wire::payload::Payload;
#[cfg(feature = "zenoh")]
use crate::wire::rmw_zenoh::topics::ZenohPublisher;

type LibraryWriter = ros2_client::Publisher<Payload>;

/// Makes the next writer; the graph knows it by then.
pub(crate) type MakeWriter = Box<dyn Fn() -> Result<LibraryWriter, String> + Send + Sync>;

/// The end of a publisher on the network.
pub(crate) enum Outside {
    Dds(Arc<Writer>),
    #[cfg(feature = "zenoh")]
    Zenoh(Box<ZenohPublisher>),
}

impl Outside {
    /// Sends a message of `topic`, which may wait for room where delivery is reliable.
    pub(crate) fn send(&self, topic: &str, payload: Payload) -> Result<(), PublishError> {
        let topic = || topic.to_owned();
        match self {
            Self::Dds(writer) => writer.write(payload).map_err(|error| match error {
                WriteError::WouldBlock { .. } => PublishError::NotAcknowledged { topic: topic() },
                error => PublishError::Library { topic: topic(), reason: error.to_string() },
            }),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(publisher) => publisher
                .put(payload.into_encoded())
                .map_err(|reason| PublishError::Library { topic: topic(), reason }),
        }
    }
}

/// A writer, and what is needed to replace it.
pub(crate) struct Writer {
    topic: Arc<str>,
    make: MakeWriter,
    /// How many messages late subscribers still get.
    keeps: usize,
    state: Mutex<State>,
}

struct State {
    current: Arc<LibraryWriter>,
    kept: VecDeque<Payload>,
}

impl Writer {
    /// `keeps` is the number of messages kept for late subscribers.
    pub(crate) fn new(
        topic: &str,
        first: LibraryWriter,
        keeps: usize,
        make: MakeWriter,
    ) -> Arc<Self> {
        let state = State { current: Arc::new(first), kept: VecDeque::new() };
        Arc::new(Self { topic: topic.into(), make, keeps, state: Mutex::new(state) })
    }

    /// Hands a message to the library, which may wait for room where delivery is reliable.
    fn write(&self, payload: Payload) -> Result<(), WriteError<()>> {
        let mut state = self.lock();
        if self.keeps > 0 {
            state.kept.push_back(payload.clone());
            let surplus = state.kept.len().saturating_sub(self.keeps);
            state.kept.drain(..surplus);
        }
        let current = Arc::clone(&state.current);
        drop(state);
        current.publish(payload).map_err(|error| error.forget_data())
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Renew for Writer {
    fn renew(&self) {
        let mut state = self.lock();
        let next = match (self.make)() {
            Ok(next) => next,
            Err(reason) => return tracing::warn!("{}: {reason}", self.topic),
        };
        for payload in &state.kept {
            if let Err(error) = next.publish(payload.clone()) {
                tracing::warn!("{}: {error}", self.topic);
            }
        }
        state.current = Arc::new(next);
    }
}
