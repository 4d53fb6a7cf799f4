//! Services on Zenoh: a server answers queries, and a client's request is one.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::Duration;

use ::zenoh::Wait;
use ::zenoh::handlers::{RingChannel, RingChannelHandler};
use ::zenoh::liveliness::LivelinessToken;
use ::zenoh::query::{ConsolidationMode, Query, QueryTarget, Queryable};

use super::attachment::{Attachment, REFUSED};
use super::keys::{self, End, Kind};
use super::session::{Session, ZenohNode, announce, first_line, now_ns};

/// Requests that may wait; beyond, the oldest is dropped, and its client is told that there is no answer.
const MOST_WAITING: usize = 100;

/// A server.
pub(crate) struct ZenohServer {
    queries: Queryable<RingChannelHandler<Query>>,
    key: String,
    _token: LivelinessToken,
}

/// A request that waits for its response.
pub(crate) struct ZenohRequest {
    pub(crate) encoded: Vec<u8>,
    query: Query,
    attachment: Attachment,
    key: String,
}

/// A client.
pub(crate) struct ZenohClient {
    session: Arc<Session>,
    key: String,
    identity: [u8; 16],
    number: AtomicI64,
    _token: LivelinessToken,
}

impl ZenohNode {
    /// # Errors
    /// When the session is closed, or the name is none.
    pub(crate) fn server(&self, end: End) -> Result<ZenohServer, String> {
        let key = self.data_key(&end);
        let queryable = self.session.zenoh.declare_queryable(key.clone()).complete(true);
        let queries = queryable
            .with(RingChannel::new(MOST_WAITING))
            .wait()
            .map_err(|error| first_line(&*error))?;
        let announced = announce(&self.session, &self.token(Kind::Server, end))?;
        Ok(ZenohServer { queries, key, _token: announced })
    }

    /// # Errors
    /// When the session is closed, or the name is none.
    pub(crate) fn client(&self, end: End) -> Result<ZenohClient, String> {
        let key = self.data_key(&end);
        let token = self.token(Kind::Client, end);
        let announced = announce(&self.session, &token)?;
        Ok(ZenohClient {
            session: Arc::clone(&self.session),
            key,
            identity: keys::identity(&token.to_string()),
            number: AtomicI64::new(1),
            _token: announced,
        })
    }
}

impl ZenohServer {
    /// Waits for the next request. May be dropped while it waits: no request is lost by that.
    ///
    /// # Errors
    /// When it is no request of a client of ROS 2.
    pub(crate) async fn next(&self) -> Result<ZenohRequest, &'static str> {
        let Ok(query) = self.queries.recv_async().await else {
            // The session is closed: nothing comes any more.
            return std::future::pending().await;
        };
        let encoded = query.payload().ok_or("it has no message")?.to_bytes().into_owned();
        let attachment = query.attachment().map(|bytes| bytes.to_bytes().into_owned());
        let attachment = attachment.and_then(|bytes| Attachment::of_bytes(&bytes));
        let attachment = attachment.ok_or(REFUSED)?;
        Ok(ZenohRequest { encoded, query, attachment, key: self.key.clone() })
    }
}

impl ZenohRequest {
    /// # Errors
    /// When the session is closed.
    pub(crate) fn respond(self, encoded: Vec<u8>) -> Result<(), String> {
        let attachment = Attachment { sent_ns: now_ns(), ..self.attachment };
        let reply = self.query.reply(self.key, encoded).attachment(attachment.to_bytes());
        reply.wait().map_err(|error| first_line(&*error))
    }
}

impl ZenohClient {
    /// The first response, encoded; `None` when there is none within `patience`, or the server gave up.
    ///
    /// # Errors
    /// When the session is closed.
    pub(crate) async fn ask(
        &self,
        encoded: Vec<u8>,
        patience: Duration,
    ) -> Result<Option<Vec<u8>>, String> {
        let attachment = Attachment {
            number: self.number.fetch_add(1, Ordering::Relaxed),
            sent_ns: now_ns(),
            sender: self.identity,
        };
        let replies = self
            .session
            .zenoh
            .get(&self.key)
            .payload(encoded)
            .attachment(attachment.to_bytes())
            .target(QueryTarget::AllComplete)
            .consolidation(ConsolidationMode::None)
            .timeout(patience)
            .await
            .map_err(|error| first_line(&*error))?;
        while let Ok(reply) = replies.recv_async().await {
            if let Ok(sample) = reply.result() {
                return Ok(Some(sample.payload().to_bytes().into_owned()));
            }
        }
        Ok(None)
    }
}
