//! Clients of services: a request, and the response to it.

use std::marker::PhantomData;
use std::time::Duration;

use msgs::RosService;
use msgs::cdr::{self, ByteOrder};
use ros2_client::Name;
use ros2_client::dds::{Client, ServiceMapping};
use tokio::sync::Mutex;

use crate::endpoints::network::{Link, Network};
#[cfg(feature = "zenoh")]
use crate::endpoints::service::zenoh_end;
use crate::endpoints::service::{Body, body_of, service_qos, service_type};
use crate::graph::Graph;
use crate::wire::error::ShellError;
#[cfg(feature = "zenoh")]
use crate::wire::rmw_zenoh::services::ZenohClient;

/// Asks one service of another node, of the same process or not, over the network.
///
/// On DDS it asks in the *enhanced* mapping of DDS-RPC, which the servers of this suite and of Fast DDS know; one of Cyclone DDS is not
/// found to answer.
pub struct ServiceClient<S> {
    name: String,
    /// None where the host is on no network: there are no servers.
    ends: Option<(Mutex<Asker>, Graph)>,
    _service: PhantomData<fn(S)>,
}

/// The client on the network.
enum Asker {
    Dds(Box<Client<Body, Body>>),
    #[cfg(feature = "zenoh")]
    Zenoh(ZenohClient),
}

impl Asker {
    /// The response; `None` when there is none within `patience`.
    async fn ask<S: RosService>(
        &self,
        encoded: Vec<u8>,
        patience: Duration,
    ) -> Result<Option<S::Response>, String> {
        match self {
            Self::Dds(client) => {
                let response = async {
                    let id = client
                        .async_send_request(body_of(&encoded))
                        .await
                        .map_err(|error| error.to_string())?;
                    client.async_receive_response(id).await.map_err(|error| error.to_string())
                };
                let Ok(body) = tokio::time::timeout(patience, response).await else {
                    return Ok(None);
                };
                let response = cdr::decode_body(body?.bytes(), ByteOrder::Little);
                response.map(Some).map_err(|error| error.to_string())
            }
            #[cfg(feature = "zenoh")]
            Self::Zenoh(client) => {
                let Some(response) = client.ask(encoded, patience).await? else { return Ok(None) };
                cdr::decode(&response).map(Some).map_err(|error| error.to_string())
            }
        }
    }
}

/// A service did not answer.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum AskError {
    /// Nobody offers it.
    #[error("{service} was not found within {waited:?}: is its node running?")]
    NoServer {
        /// The service.
        service: String,
        /// How long it was waited for.
        waited: Duration,
    },
    /// It is there, and gave no response.
    #[error("{service} did not answer within {waited:?}")]
    NoAnswer {
        /// The service.
        service: String,
        /// How long it was waited for.
        waited: Duration,
    },
    /// The request or the response cannot be read or sent.
    #[error("{service}: {reason}")]
    Failed {
        /// The service.
        service: String,
        /// The library's error.
        reason: String,
    },
}

impl<S: RosService> ServiceClient<S> {
    /// A client of the service `name`, absolute, of a node that is on no network.
    pub(crate) fn of_nobody(name: &str) -> Self {
        Self { name: name.to_owned(), ends: None, _service: PhantomData }
    }

    /// A client of the service `name`, absolute, of a node on a network.
    pub(crate) fn new(network: &Network, graph: &Graph, name: &str) -> Result<Self, ShellError> {
        let failed = |reason: String| ShellError::Endpoint {
            endpoint: "client",
            topic: name.to_owned(),
            reason,
        };
        #[cfg_attr(not(feature = "zenoh"), expect(clippy::infallible_destructuring_match))]
        let dds = match &network.link {
            Link::Dds(dds) => dds,
            #[cfg(feature = "zenoh")]
            Link::Zenoh(node) => {
                let client = node.client(zenoh_end::<S>(name)?).map_err(failed)?;
                let ends = Some((Mutex::new(Asker::Zenoh(client)), graph.clone()));
                return Ok(Self { name: name.to_owned(), ends, _service: PhantomData });
            }
        };
        let service_type = service_type::<S>()?;
        let qos = service_qos();
        let client = dds
            .for_an_endpoint()
            .create_client(
                ServiceMapping::Enhanced,
                &Name::parse(name).map_err(|error| failed(error.to_string()))?,
                &service_type,
                qos.clone(),
                qos,
            )
            .map_err(|error| failed(error.to_string()))?;
        let ends = Some((Mutex::new(Asker::Dds(Box::new(client))), graph.clone()));
        Ok(Self { name: name.to_owned(), ends, _service: PhantomData })
    }

    /// The service, by its absolute name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Asks once, and waits up to `patience` for a server and as long again for its response. Requests go one after the other.
    ///
    /// # Errors
    /// When there is no server, no response, or either cannot be read.
    pub async fn ask(
        &self,
        request: &S::Request,
        patience: Duration,
    ) -> Result<S::Response, AskError> {
        let service = || self.name.clone();
        let failed = |reason: String| AskError::Failed { service: service(), reason };
        let Some((client, graph)) = &self.ends else {
            return Err(AskError::NoServer { service: service(), waited: Duration::ZERO });
        };
        let encoded = cdr::encode(request).map_err(|error| failed(error.to_string()))?;
        let client = client.lock().await;
        if tokio::time::timeout(patience, graph.wait_for_server(&self.name)).await.is_err() {
            return Err(AskError::NoServer { service: service(), waited: patience });
        }
        match client.ask::<S>(encoded, patience).await {
            Ok(Some(response)) => Ok(response),
            Ok(None) => Err(AskError::NoAnswer { service: service(), waited: patience }),
            Err(reason) => Err(failed(reason)),
        }
    }
}

#[cfg(test)]
mod tests {
    use free_domain::FreeDomain;
    use msgs::std_srvs::{SetBool, SetBoolRequest, SetBoolResponse};

    use super::*;
    use crate::{Host, Node, RosArguments, Transport};

    /// Longer than anything takes on a busy machine.
    const PATIENCE: Duration = Duration::from_secs(120);
    /// In which nobody comes.
    const SHORT: Duration = Duration::from_millis(50);

    fn arguments() -> RosArguments {
        RosArguments::parse(["--ros-args", "-r", "__ns:=/service_client_test"]).unwrap()
    }

    /// Nodes of one process reach each other's services, too.
    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn a_node_asks_a_sibling_and_says_why_there_is_no_answer() {
        let transport = Transport::on_domain(FreeDomain::of_this_process().number()).unwrap();
        let host = Host::on(transport).unwrap();
        let node = |name: &str| -> Node { host.node(name, &arguments()).unwrap() };
        let (server, asker) = (node("server"), node("asker"));
        {
            let client = asker.service_client::<SetBool>("server/switch").unwrap();
            let missing = client.ask(&SetBoolRequest::default(), SHORT).await.unwrap_err();
            assert!(matches!(missing, AskError::NoServer { .. }), "{missing}");

            let service = server.service::<SetBool>("~/switch").unwrap();
            let serve = async {
                loop {
                    let request = service.next().await;
                    let data = request.message.data;
                    let message = format!("it is {data}");
                    request.respond(&SetBoolResponse { success: data, message }).unwrap();
                }
            };
            let ask = async {
                for data in [true, false] {
                    let answer = client.ask(&SetBoolRequest { data }, PATIENCE).await.unwrap();
                    assert_eq!((answer.success, answer.message), (data, format!("it is {data}")));
                }
            };
            tokio::select! {
                () = serve => {}
                () = ask => {}
            }
            let silent = client.ask(&SetBoolRequest::default(), SHORT).await.unwrap_err();
            assert!(matches!(silent, AskError::NoAnswer { .. }), "{silent}");
        }
        server.close().await;
        asker.close().await;
    }

    #[tokio::test]
    async fn without_a_network_there_are_no_servers() {
        let node = Host::in_process().node("asker", &arguments()).unwrap();
        let client = node.service_client::<SetBool>("server/switch").unwrap();
        let error = client.ask(&SetBoolRequest::default(), SHORT).await.unwrap_err();
        assert!(
            matches!(error, AskError::NoServer { .. }) && client.name().ends_with("/server/switch")
        );
    }
}
