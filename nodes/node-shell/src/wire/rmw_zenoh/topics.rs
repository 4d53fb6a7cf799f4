//! Publishers and subscriptions on Zenoh: of bytes, whatever their type.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::Duration;

use ::zenoh::Wait;
use ::zenoh::handlers::{RingChannel, RingChannelHandler};
use ::zenoh::liveliness::LivelinessToken;
use ::zenoh::qos::{CongestionControl, Reliability};
use ::zenoh::sample::{Locality, Sample};
use zenoh_ext::{
    AdvancedPublisher, AdvancedPublisherBuilderExt, AdvancedSubscriber,
    AdvancedSubscriberBuilderExt, CacheConfig, HistoryConfig, MissDetectionConfig, RecoveryConfig,
};

use super::attachment::Attachment;
use super::keys::{self, End, Kind, Token, UNKNOWN_HASH};
use super::session::{Session, ZenohNode, announce, first_line, now_ns};

/// How often a latched publisher looks whether the number of its messages has changed, and says so if it has; as in rmw_zenoh.
const HEARTBEAT: Duration = Duration::from_millis(500);
/// The most messages that a subscription keeps, whatever its depth.
const MOST_WAITING: usize = 1 << 16;

/// A publisher.
pub(crate) struct ZenohPublisher {
    publisher: AdvancedPublisher<'static>,
    session: Arc<Session>,
    identity: [u8; 16],
    number: AtomicI64,
    // The peers that see it must find the publisher.
    _token: LivelinessToken,
}

/// A subscription.
pub(crate) struct ZenohSubscription {
    subscriber: AdvancedSubscriber<RingChannelHandler<Sample>>,
    session: Arc<Session>,
    _token: LivelinessToken,
}

/// A message as it came.
pub(crate) struct ZenohMessage {
    pub(crate) encoded: Vec<u8>,
    /// None where the sender says nothing of it.
    pub(crate) attachment: Option<Attachment>,
}

impl ZenohNode {
    /// # Errors
    /// When the session is closed, or the name is none.
    pub(crate) fn publisher(&self, end: End) -> Result<(Token, ZenohPublisher), String> {
        let qos = end.qos;
        let reliability =
            if qos.is_reliable() { Reliability::Reliable } else { Reliability::BestEffort };
        let mut builder = self
            .session
            .zenoh
            .declare_publisher(self.data_key(&end))
            // As rmw_zenoh does for topics that keep the last messages: who is too slow must not stop the others.
            .congestion_control(CongestionControl::Drop)
            .reliability(reliability)
            .advanced();
        if qos.is_transient_local() {
            builder = builder
                .cache(CacheConfig::default().max_samples(qos.depth()))
                .publisher_detection();
            if qos.is_reliable() {
                let detection = MissDetectionConfig::default().sporadic_heartbeat(HEARTBEAT);
                builder = builder.sample_miss_detection(detection);
            }
        }
        let token = self.token(Kind::Publisher, end);
        let identity = keys::identity(&token.to_string());
        self.session.enter_own(identity);
        let publisher = builder.wait().map_err(|error| first_line(&*error))?;
        let announced = announce(&self.session, &token)?;
        let publisher = ZenohPublisher {
            publisher,
            session: Arc::clone(&self.session),
            identity,
            number: AtomicI64::new(1),
            _token: announced,
        };
        Ok((token, publisher))
    }

    /// # Errors
    /// When the session is closed, or the name is none.
    pub(crate) fn subscription(&self, end: End) -> Result<(Token, ZenohSubscription), String> {
        let qos = end.qos;
        let key =
            if end.hash == UNKNOWN_HASH { self.any_data_key(&end) } else { self.data_key(&end) };
        let mut builder = self
            .session
            .zenoh
            .declare_subscriber(key)
            // What this process publishes is handed over.
            .allowed_origin(Locality::Remote)
            .with(RingChannel::new(qos.depth().clamp(1, MOST_WAITING)))
            .advanced();
        if qos.is_transient_local() {
            let history = HistoryConfig::default().detect_late_publishers();
            builder = builder
                .history(history.max_samples(qos.depth()))
                .subscriber_detection()
                .query_timeout(Duration::from_secs(u64::from(u32::MAX)));
            if qos.is_reliable() {
                builder = builder.recovery(RecoveryConfig::default().heartbeat());
            }
        }
        let token = self.token(Kind::Subscription, end);
        let subscriber = builder.wait().map_err(|error| first_line(&*error))?;
        let announced = announce(&self.session, &token)?;
        let session = Arc::clone(&self.session);
        Ok((token, ZenohSubscription { subscriber, session, _token: announced }))
    }
}

impl ZenohPublisher {
    /// # Errors
    /// When the session is closed.
    pub(crate) fn put(&self, encoded: Vec<u8>) -> Result<(), String> {
        let attachment = Attachment {
            number: self.number.fetch_add(1, Ordering::Relaxed),
            sent_ns: now_ns(),
            sender: self.identity,
        };
        let put = self.publisher.put(encoded).attachment(attachment.to_bytes());
        put.wait().map_err(|error| first_line(&*error))
    }
}

impl Drop for ZenohPublisher {
    fn drop(&mut self) {
        self.session.leave_own(&self.identity);
    }
}

impl ZenohSubscription {
    /// The next message if it is here already.
    pub(crate) fn take(&self) -> Option<ZenohMessage> {
        loop {
            let sample = self.subscriber.try_recv().ok()??;
            if let Some(message) = self.message(&sample) {
                return Some(message);
            }
        }
    }

    /// Waits for the next message. May be dropped while it waits: no message is lost by that.
    pub(crate) async fn next(&self) -> ZenohMessage {
        loop {
            let Ok(sample) = self.subscriber.recv_async().await else {
                // The session is closed: nothing comes any more.
                return std::future::pending().await;
            };
            if let Some(message) = self.message(&sample) {
                return message;
            }
        }
    }

    /// `None` for one of this process, of which the history of a topic has some.
    fn message(&self, sample: &Sample) -> Option<ZenohMessage> {
        let attachment =
            sample.attachment().and_then(|bytes| Attachment::of_bytes(&bytes.to_bytes()));
        if attachment.is_some_and(|one| self.session.is_own(&one.sender)) {
            return None;
        }
        Some(ZenohMessage { encoded: sample.payload().to_bytes().into_owned(), attachment })
    }
}
