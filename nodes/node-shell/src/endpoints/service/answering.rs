//! How a response goes out: not before its client can hear it.
//!
//! A client asks as soon as it has found the service; by then the service need not have found the client's reader of
//! responses, and a response sent to no reader is lost. So a response is held until the reader is there, as rmw_fastrtps and rmw_cyclonedds do
//! for 0.1 s (`rmw_response.cpp`, `rmw_node.cpp`).

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::{Duration, Instant};

use ros2_client::RmwRequestId;
use ros2_client::dds::Server;
use rustdds::GUID;

use super::wire::{self, Body};
use crate::graph::{Client, Graph};
use crate::process::throttle::Throttle;
use crate::wire::error::PublishError;

/// How long a response is held: fifty times what the implementations of ROS 2 wait, since on a busy machine discovery takes
/// seconds.
const LONGEST_HOLD: Duration = Duration::from_secs(5);

/// How many responses of one service may be held: as many as its requests that may wait, for ten clients.
const MOST_HELD: usize = 100;

/// After this long the first response to a reader of Cyclone DDS goes out again. Such a reader takes what the first heartbeat
/// announces after it has found the writer for history, which it does not want; the response may be that. Clients ignore a
/// response that they have.
const AGAIN: Duration = Duration::from_millis(100);

/// A reader is past that this long after its first response: another client of its participant may be answered meanwhile.
const SETTLED: Duration = Duration::from_secs(1);

/// The network part of a service.
pub(super) struct Ends {
    /// Takes all requests, and sends responses that say beside the message what they belong to.
    pub(super) server: Server<Body, Body>,
    /// Sends responses to clients that recognise them by the bytes in front of the message.
    plain: ros2_client::Publisher<Body>,
    /// The largest message that `server` can send.
    pub(super) largest_whole: usize,
    graph: Graph,
    name: Arc<str>,
    /// The readers that a response has gone out to, and when the first did.
    answered: Mutex<BTreeMap<GUID, Instant>>,
    held: Arc<()>,
    failed: Throttle,
}

/// A response to be sent.
#[derive(Clone)]
pub(super) struct Outgoing {
    /// The request that it answers.
    pub(super) client: RmwRequestId,
    /// Whether the client knows its response by the bytes in front of the message.
    pub(super) has_header: bool,
    pub(super) body: Vec<u8>,
}

impl Outgoing {
    /// The response `encoded` to `client`, behind the `header` that the client wants back.
    pub(super) fn new(client: RmwRequestId, header: Vec<u8>, encoded: &[u8]) -> Self {
        Self { client, has_header: !header.is_empty(), body: body(header, encoded) }
    }

    /// The client. Others than Cyclone DDS may name their reader.
    fn asked_by(&self) -> Client {
        let guid = GUID::from_bytes(self.client.writer_gid.to_bytes16());
        Client { guid, is_writer: self.has_header }
    }
}

impl Ends {
    pub(super) fn new(
        server: Server<Body, Body>,
        plain: ros2_client::Publisher<Body>,
        largest_whole: usize,
        (graph, name): (&Graph, Arc<str>),
    ) -> Arc<Self> {
        Arc::new(Self {
            server,
            plain,
            largest_whole,
            graph: graph.clone(),
            name,
            answered: Mutex::default(),
            held: Arc::new(()),
            failed: Throttle::for_warnings(),
        })
    }

    /// Whether a response reaches its client.
    pub(super) fn check_size(&self, outgoing: &Outgoing) -> Result<(), PublishError> {
        let bytes = outgoing.body.len() + msgs::cdr::HEADER_BYTES;
        if outgoing.has_header || bytes <= self.largest_whole {
            return Ok(());
        }
        let (service, largest) = (self.name.to_string(), self.largest_whole);
        Err(PublishError::ResponseTooLarge { service, bytes, largest })
    }

    /// Sends a response, now or when its client can hear it.
    pub(super) fn answer(self: &Arc<Self>, outgoing: Outgoing) -> Result<(), PublishError> {
        self.check_size(&outgoing)?;
        let readers = self.graph.readers_of_client(&self.name, outgoing.asked_by());
        if let Some(readers) = &readers
            && !(outgoing.has_header && self.has_new(readers))
        {
            self.note(readers);
            return self.send(outgoing);
        }
        if Arc::strong_count(&self.held) > MOST_HELD {
            self.log_loss(&outgoing, "too many responses wait for their clients");
            return Ok(());
        }
        tokio::spawn(hold(Arc::downgrade(self), Arc::clone(&self.held), outgoing));
        Ok(())
    }

    fn send(&self, Outgoing { client, has_header, body }: Outgoing) -> Result<(), PublishError> {
        let sent = if has_header {
            self.plain.publish(Body(body)).map_err(|error| error.to_string())
        } else {
            self.server.send_response(client, Body(body)).map_err(|error| error.to_string())
        };
        sent.map_err(|reason| PublishError::Library { topic: self.name.to_string(), reason })
    }

    fn has_new(&self, readers: &BTreeSet<GUID>) -> bool {
        let answered = self.answered.lock().unwrap_or_else(PoisonError::into_inner);
        let is_settled = |first: &Instant| first.elapsed() > SETTLED;
        !readers.iter().all(|reader| answered.get(reader).is_some_and(is_settled))
    }

    /// Notes the answered clients, and forgets those that have gone.
    fn note(&self, readers: &BTreeSet<GUID>) {
        let mut answered = self.answered.lock().unwrap_or_else(PoisonError::into_inner);
        for reader in readers {
            answered.entry(*reader).or_insert_with(Instant::now);
        }
        let mut known = answered.keys().copied().collect();
        self.graph.retain_clients(&mut known);
        answered.retain(|reader, _| known.contains(reader));
    }

    fn send_or_log(&self, outgoing: Outgoing) {
        if let Err(error) = self.send(outgoing)
            && let Some(held_back) = self.failed.pass()
        {
            tracing::warn!("{error} ({held_back} more since the last warning)");
        }
    }

    fn log_loss(&self, outgoing: &Outgoing, reason: &str) {
        if let Some(held_back) = self.failed.pass() {
            tracing::warn!(
                "{}: a response to {:?} is dropped: {reason} ({held_back} more since the last warning)",
                self.name,
                outgoing.asked_by().guid
            );
        }
    }
}

/// Sends a response once its client can hear it, or logs that it could not. The service may end meanwhile.
async fn hold(ends: Weak<Ends>, _held: Arc<()>, outgoing: Outgoing) {
    let Some(graph) = ends.upgrade().map(|ends| (ends.graph.clone(), Arc::clone(&ends.name)))
    else {
        return;
    };
    let (graph, name) = graph;
    let found = graph.wait_for_client(&name, outgoing.asked_by());
    let found = tokio::time::timeout(LONGEST_HOLD, found).await;
    let Some(service) = ends.upgrade() else { return };
    let Ok(readers) = found else {
        let reason = format!("its reader was not found within {LONGEST_HOLD:?}");
        return service.log_loss(&outgoing, &reason);
    };
    let is_first = service.has_new(&readers);
    service.note(&readers);
    service.send_or_log(outgoing.clone());
    drop(service);
    if outgoing.has_header && is_first {
        tokio::time::sleep(AGAIN).await;
        if let Some(service) = ends.upgrade() {
            service.send_or_log(outgoing);
        }
    }
}

/// The response's body on the wire, behind what its client wants back.
pub(super) fn body(mut header: Vec<u8>, encoded: &[u8]) -> Vec<u8> {
    header.extend_from_slice(encoded.get(msgs::cdr::HEADER_BYTES..).unwrap_or_default());
    header.resize(header.len().next_multiple_of(wire::PADDED_TO), 0);
    header
}
