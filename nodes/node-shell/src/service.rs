//! Services: requests that are answered one by one.
//!
//! Clients of Fast DDS, Connext, RustDDS (*enhanced* mapping) and Cyclone DDS are all answered in their own
//! way. Not answered are big-endian clients, and Connext's *basic* mapping.

#[cfg(test)]
mod tests;
mod wire;

use std::marker::PhantomData;
use std::sync::Arc;

use msgs::RosService;
use msgs::cdr::{self, ByteOrder};
use ros2_client::dds::{Server, ServiceMapping};
use ros2_client::qos::{Durability, History, Reliability, WhenFull};
use ros2_client::{Name, QosProfile, RmwRequestId, ServiceTypeName};

use crate::error::{PublishError, ShellError};
use crate::names;
use crate::throttle::Throttle;
use wire::Body;

/// Requests that may wait, as ROS 2 has it for services.
const DEPTH: usize = 10;

/// Takes the requests of one service, which come from outside of the host.
pub struct Service<S> {
    name: Arc<str>,
    /// None where the host is on no network: nobody asks there.
    server: Option<Server<Body, Body>>,
    malformed: Throttle,
    _service: PhantomData<fn(S)>,
}

impl<S: RosService> Service<S> {
    /// The service `name`, absolute, of a node that is on no network.
    pub(crate) fn unasked(name: &str) -> Self {
        Self::with(None, name)
    }

    /// The service `name`, absolute, on a node of the library.
    pub(crate) fn new(node: &mut ros2_client::Node, name: &str) -> Result<Self, ShellError> {
        let failed = |reason: String| ShellError::Endpoint {
            endpoint: "service",
            topic: name.to_owned(),
            reason,
        };
        // Refuses what has not three parts.
        names::dds_type_name(S::TYPE_NAME)?;
        let mut parts = S::TYPE_NAME.split('/');
        let (package, type_name) =
            (parts.next().unwrap_or_default(), parts.next_back().unwrap_or_default());
        let qos = QosProfile::default()
            .reliability(Reliability::Reliable { when_full: WhenFull::DEFAULT })
            .durability(Durability::Volatile)
            .history(History::KeepLast { depth: DEPTH });
        let server = node
            .create_server(
                // The one that changes nothing in the bodies.
                ServiceMapping::Enhanced,
                &Name::parse(name).map_err(|error| failed(error.to_string()))?,
                &ServiceTypeName::new(package, type_name),
                qos.clone(),
                qos,
            )
            .map_err(|error| failed(error.to_string()))?;
        Ok(Self::with(Some(server), name))
    }

    fn with(server: Option<Server<Body, Body>>, name: &str) -> Self {
        Self {
            name: name.into(),
            server,
            malformed: Throttle::for_warnings(),
            _service: PhantomData,
        }
    }

    /// Waits for the next request. May be dropped while waiting: no request is lost by that.
    ///
    /// What cannot be decoded is told of once in a while and passed over; its client gets no answer, as
    /// ROS 2 knows none for it.
    pub async fn next(&self) -> Request<'_, S> {
        let Some(server) = &self.server else { return std::future::pending().await };
        loop {
            let taken = match server.async_receive_request().await {
                Ok((client, body)) => self.decode(server, client, body),
                Err(error) => Err(error.to_string()),
            };
            match taken {
                Ok(request) => return request,
                Err(reason) => self.refuse(&reason),
            }
        }
    }

    /// The service, by its absolute name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    fn decode<'a>(
        &'a self,
        server: &'a Server<Body, Body>,
        client: RmwRequestId,
        body: Body,
    ) -> Result<Request<'a, S>, String> {
        let parts = wire::cut(client.writer_gid.to_bytes16(), body).map_err(|e| e.to_string())?;
        let message = cdr::decode_body::<S::Request>(&parts.message, ByteOrder::Little)
            .map_err(|error| error.to_string())?;
        Ok(Request { message, name: &self.name, server, client, header: parts.header })
    }

    fn refuse(&self, reason: &str) {
        if let Some(held_back) = self.malformed.pass() {
            tracing::warn!(
                "{}: a request is no valid {} and is passed over ({held_back} more since the last \
                 warning): {reason}",
                self.name,
                S::TYPE_NAME
            );
        }
    }
}

/// A request that waits for its response. Dropped without one, it leaves its client waiting.
#[must_use = "the client waits for a response"]
pub struct Request<'a, S: RosService> {
    /// What the client sent.
    pub message: S::Request,
    name: &'a str,
    server: &'a Server<Body, Body>,
    client: RmwRequestId,
    header: Vec<u8>,
}

impl<S: RosService> Request<'_, S> {
    /// Answers the request. Returns once the response is queued; this may take up to 0.1 s when clients
    /// are far behind.
    ///
    /// # Errors
    /// When the response cannot be encoded, or is not taken.
    pub fn respond(self, response: &S::Response) -> Result<(), PublishError> {
        let Self { name, server, client, header: mut body, .. } = self;
        let topic = || name.to_owned();
        let encoded = cdr::encode(response)
            .map_err(|source| PublishError::Encode { topic: topic(), source })?;
        body.extend_from_slice(encoded.get(cdr::HEADER_BYTES..).unwrap_or_default());
        body.resize(body.len().next_multiple_of(wire::PADDED_TO), 0);
        server
            .send_response(client, Body(body))
            .map_err(|error| PublishError::Library { topic: topic(), reason: error.to_string() })
    }
}
