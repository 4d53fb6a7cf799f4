//! Services: requests that are answered one by one.
//!
//! Clients of Fast DDS, Connext, RustDDS (*enhanced* mapping) and Cyclone DDS are each answered in their own
//! form. Not answered are big-endian clients, Connext's *basic* mapping, and, but for Cyclone DDS, clients of a response
//! that does not fit into a datagram (some 1.4 kB): see [`wire`]. [`Request::respond_or`] tells these why. On Zenoh all clients are
//! answered.

mod answering;
#[cfg(test)]
mod tests;
mod wire;

use std::marker::PhantomData;
use std::sync::Arc;

use msgs::cdr::{self, ByteOrder};
use msgs::std_srvs::{Trigger, TriggerResponse};
use msgs::{RosMessage, RosService};
use ros2_client::dds::ServiceMapping;
use ros2_client::qos::{Durability, History, Reliability, WhenFull};
use ros2_client::{Name, QosProfile, RmwRequestId, ServiceTypeName};

use crate::endpoints::network::{Link, Network};
use crate::graph::Graph;
use crate::process::failure::NodeFailure;
use crate::process::throttle::Throttle;
use crate::settings::names;
use crate::settings::qos::Qos;
use crate::wire::error::{PublishError, ShellError};
#[cfg(feature = "zenoh")]
use crate::wire::rmw_zenoh::keys::{End, UNKNOWN_HASH};
#[cfg(feature = "zenoh")]
use crate::wire::rmw_zenoh::services::{ZenohRequest, ZenohServer};
use answering::{Ends, Outgoing};
pub(crate) use wire::Body;

/// Requests that may wait, as ROS 2 has it for services.
const DEPTH: usize = 10;

/// The body of an encoded message that nothing precedes.
pub(crate) fn body_of(encoded: &[u8]) -> Body {
    Body(answering::body(Vec::new(), encoded))
}

/// Takes the requests of one service, which come from outside of the host.
pub struct Service<S> {
    name: Arc<str>,
    /// None where the host is on no network: there are no clients.
    server: Option<Server>,
    malformed: Throttle,
    _service: PhantomData<fn(S)>,
}

/// The server on the network.
enum Server {
    Dds(Arc<Ends>),
    #[cfg(feature = "zenoh")]
    Zenoh(ZenohServer),
}

/// The type of a service as the client library has it.
///
/// # Errors
/// When its name has not three parts.
pub(crate) fn service_type<S: RosService>() -> Result<ServiceTypeName, ShellError> {
    names::dds_type_name(S::TYPE_NAME)?;
    let mut parts = S::TYPE_NAME.split('/');
    let (package, name) = (parts.next().unwrap_or_default(), parts.next_back().unwrap_or_default());
    Ok(ServiceTypeName::new(package, name))
}

/// A service as it is announced on Zenoh.
#[cfg(feature = "zenoh")]
pub(crate) fn zenoh_end<S: RosService>(name: &str) -> Result<End, ShellError> {
    Ok(End {
        name: name.to_owned(),
        dds_type: names::dds_type_name(S::TYPE_NAME)?,
        hash: S::type_hash().unwrap_or_else(|| UNKNOWN_HASH.to_owned()),
        qos: Qos::reliable(DEPTH),
    })
}

/// How requests and responses are delivered.
pub(crate) fn service_qos() -> QosProfile {
    QosProfile::default()
        .reliability(Reliability::Reliable { when_full: WhenFull::DEFAULT })
        .durability(Durability::Volatile)
        .history(History::KeepLast { depth: DEPTH })
}

impl<S: RosService> Service<S> {
    /// The service `name`, absolute, of a node that is on no network.
    pub(crate) fn unasked(name: &str) -> Self {
        Self::with(None, name)
    }

    /// The service `name`, absolute, of a node on a network.
    pub(crate) fn new(network: &Network, graph: &Graph, name: &str) -> Result<Self, ShellError> {
        let failed = |reason: String| ShellError::Endpoint {
            endpoint: "service",
            topic: name.to_owned(),
            reason,
        };
        #[cfg_attr(not(feature = "zenoh"), expect(clippy::infallible_destructuring_match))]
        let dds = match &network.link {
            Link::Dds(dds) => dds,
            #[cfg(feature = "zenoh")]
            Link::Zenoh(node) => {
                let server = node.server(zenoh_end::<S>(name)?).map_err(failed)?;
                return Ok(Self::with(Some(Server::Zenoh(server)), name));
            }
        };
        let service_type = service_type::<S>()?;
        let response_type = names::dds_type_name(<S::Response as RosMessage>::TYPE_NAME)?;
        let qos = service_qos();
        // First, so that a client that has discovered the server has discovered it as well.
        let policies = Qos::reliable(DEPTH).writer_policies(S::TYPE_NAME);
        let plain = dds.response_writer(name, &response_type, &policies).map_err(failed)?;
        let server = dds
            .for_an_endpoint()
            .create_server(
                // The one that changes nothing in the bodies.
                ServiceMapping::Enhanced,
                &Name::parse(name).map_err(|error| failed(error.to_string()))?,
                &service_type,
                qos.clone(),
                qos,
            )
            .map_err(|error| failed(error.to_string()))?;
        let largest_whole = wire::largest_whole(dds.smallest_mtu_bytes);
        let ends = Ends::new(server, plain, largest_whole, (graph, name.into()));
        Ok(Self::with(Some(Server::Dds(ends)), name))
    }

    fn with(server: Option<Server>, name: &str) -> Self {
        Self {
            name: name.into(),
            server,
            malformed: Throttle::for_warnings(),
            _service: PhantomData,
        }
    }

    /// Waits for the next request. May be dropped while waiting: no request is lost by that.
    ///
    /// A request that cannot be decoded is logged once in a while and ignored; its client gets no answer, as
    /// ROS 2 knows none for it.
    pub async fn next(&self) -> Request<'_, S> {
        let Some(server) = &self.server else { return std::future::pending().await };
        loop {
            let taken = match server {
                Server::Dds(ends) => match ends.server.async_receive_request().await {
                    Ok((client, body)) => self.decode(ends, client, body),
                    Err(error) => Err(error.to_string()),
                },
                #[cfg(feature = "zenoh")]
                Server::Zenoh(server) => match server.next().await {
                    Ok(request) => cdr::decode(&request.encoded)
                        .map(|message| Request {
                            message,
                            name: &self.name,
                            reply: Reply::Zenoh(request),
                        })
                        .map_err(|error| error.to_string()),
                    Err(reason) => Err(reason.to_owned()),
                },
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

    /// The server on DDS.
    #[cfg(test)]
    fn dds_ends(&self) -> Option<&Arc<Ends>> {
        match self.server.as_ref()? {
            Server::Dds(ends) => Some(ends),
            #[cfg(feature = "zenoh")]
            Server::Zenoh(_) => None,
        }
    }

    fn decode<'a>(
        &'a self,
        ends: &'a Arc<Ends>,
        client: RmwRequestId,
        body: Body,
    ) -> Result<Request<'a, S>, String> {
        let parts = wire::cut(client.writer_gid.to_bytes16(), body).map_err(|e| e.to_string())?;
        let message = cdr::decode_body::<S::Request>(&parts.message, ByteOrder::Little)
            .map_err(|error| error.to_string())?;
        let reply = Reply::Dds { ends, client, header: parts.header };
        Ok(Request { message, name: &self.name, reply })
    }

    fn refuse(&self, reason: &str) {
        if let Some(held_back) = self.malformed.pass() {
            tracing::warn!(
                "{}: a request is no valid {} and is ignored ({held_back} more since the last \
                 warning): {reason}",
                self.name,
                S::TYPE_NAME
            );
        }
    }
}

/// Answers a request. A response that cannot be sent is logged once in a while: clients ask again.
pub(crate) fn answer<S: RosService>(
    failed: &Throttle,
    request: Request<'_, S>,
    response: &S::Response,
) {
    if let Err(error) = request.respond(response)
        && let Some(held_back) = failed.pass()
    {
        tracing::warn!("{error} ({held_back} more since the last warning)");
    }
}

/// A request that waits for its response. Dropped without one, it leaves its client waiting.
#[must_use = "the client waits for a response"]
pub struct Request<'a, S: RosService> {
    /// The client's request.
    pub message: S::Request,
    name: &'a str,
    reply: Reply<'a>,
}

/// By what a request is answered.
enum Reply<'a> {
    Dds {
        ends: &'a Arc<Ends>,
        client: RmwRequestId,
        header: Vec<u8>,
    },
    #[cfg(feature = "zenoh")]
    Zenoh(ZenohRequest),
}

impl<S: RosService> Request<'_, S> {
    /// Answers the request: now, or when the client's reader of responses is there; 5 s later it is dropped, and the log says
    /// so. Must be called within a tokio runtime. It may take up to 0.1 s when clients are far behind.
    ///
    /// # Errors
    /// When the response cannot be encoded, is not taken, or is too large for the client's middleware.
    pub fn respond(self, response: &S::Response) -> Result<(), PublishError> {
        let encoded = self.encoded(response)?;
        match self.reply {
            Reply::Dds { ends, client, header } => {
                ends.answer(Outgoing::new(client, header, &encoded))
            }
            #[cfg(feature = "zenoh")]
            Reply::Zenoh(request) => {
                let topic = self.name;
                request
                    .respond(encoded)
                    .map_err(|reason| PublishError::Library { topic: topic.to_owned(), reason })
            }
        }
    }

    /// Answers with a response that may be too large for the client's middleware, and then with another one, which is made of
    /// that error. The rest is as of [`Request::respond`].
    ///
    /// # Errors
    /// When the response cannot be encoded or is not taken, or the other one is too large, too.
    pub fn respond_or(
        self,
        response: &S::Response,
        too_large: impl FnOnce(&PublishError) -> S::Response,
    ) -> Result<(), PublishError> {
        match &self.reply {
            Reply::Dds { ends, client, header } => {
                let outgoing = Outgoing::new(*client, header.clone(), &self.encoded(response)?);
                match ends.check_size(&outgoing) {
                    Ok(()) => ends.answer(outgoing),
                    Err(error) => self.respond(&too_large(&error)),
                }
            }
            #[cfg(feature = "zenoh")]
            Reply::Zenoh(_) => self.respond(response),
        }
    }

    fn encoded(&self, response: &S::Response) -> Result<Vec<u8>, PublishError> {
        cdr::encode(response)
            .map_err(|source| PublishError::Encode { topic: self.name.to_owned(), source })
    }
}

impl Request<'_, Trigger> {
    /// Answers with what was done, or why it was not.
    pub fn answer(self, done: Result<String, NodeFailure>) {
        let response = match done {
            Ok(message) => TriggerResponse { success: true, message },
            Err(error) => TriggerResponse { success: false, message: error.to_string() },
        };
        if let Err(error) = self.respond(&response) {
            tracing::warn!("{error}");
        }
    }
}
