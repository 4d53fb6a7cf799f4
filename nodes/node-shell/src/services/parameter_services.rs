//! The services by which others read and set a node's parameters, and `/parameter_events`, on which it publishes changes.
//!
//! Parameters are set as a whole: what the node's `validate` does not accept, or what may not change while the node runs,
//! is refused with the reason, and nothing changes. The node gets the new parameters between two of its steps.

mod descriptor;
mod store;
#[cfg(test)]
mod tests;
mod value;

use msgs::rcl_interfaces::{
    DescribeParameters, DescribeParametersResponse, GetParameterTypes, GetParameterTypesResponse,
    GetParameters, GetParametersResponse, ListParameters, ListParametersResponse, Parameter,
    ParameterDescriptor, ParameterEvent, SetParameters, SetParametersAtomically,
    SetParametersAtomicallyResponse, SetParametersResponse, SetParametersResult,
};
use tokio::sync::watch;

use crate::endpoints::publisher::Publisher;
use crate::endpoints::service::{Service, answer};
use crate::node::Node;
use crate::node::clock::NodeClock;
use crate::process::throttle::Throttle;
use crate::settings::parameters::{NodeParameters, ParameterError};
use crate::settings::qos::Qos;
use crate::wire::error::ShellError;
use store::Store;
pub use value::{of_message as parameter_from_message, to_message as message_from_parameter};

/// The topic of changes, of all nodes.
const EVENTS: &str = "/parameter_events";
/// Events that a subscriber may be behind, as ROS 2 has it.
const EVENTS_KEPT: usize = 1000;

/// The declaration of each parameter of a node, those of every node included.
///
/// # Errors
/// When the struct cannot be written as parameters.
pub fn descriptors<P: NodeParameters>() -> Result<Vec<ParameterDescriptor>, ParameterError> {
    Ok(descriptor::descriptors::<P>()?.into_values().collect())
}

/// The parameters of a running node.
#[derive(Debug)]
pub struct LiveParameters<P> {
    /// None on a node that is on no network: nothing is set there.
    changes: Option<watch::Receiver<P>>,
}

impl<P: NodeParameters> LiveParameters<P> {
    pub(crate) fn fixed() -> Self {
        Self { changes: None }
    }

    /// Waits until somebody has set parameters; returns all of them. May be dropped while waiting.
    pub async fn changed(&mut self) -> P {
        if let Some(changes) = &mut self.changes
            && changes.changed().await.is_ok()
        {
            return changes.borrow_and_update().clone();
        }
        std::future::pending().await
    }
}

impl Node {
    /// Lets others read the node's parameters and set those that may change, as long as the node runs; logs their values.
    ///
    /// # Errors
    /// When a name is invalid, or the library refuses.
    pub fn serve_parameters<P: NodeParameters>(
        &self,
        parameters: &P,
    ) -> Result<LiveParameters<P>, ShellError> {
        let Some(network) = self.network() else { return Ok(LiveParameters::fixed()) };
        let (services, live) = ParameterServices::open(self, parameters)?;
        network.spawn(|stop| services.run(stop));
        Ok(live)
    }
}

/// The services of a node's parameters.
pub(crate) struct ParameterServices<P> {
    node_name: String,
    clock: NodeClock,
    store: Store<P>,
    changes: watch::Sender<P>,
    events: Publisher<ParameterEvent>,
    describe: Service<DescribeParameters>,
    get: Service<GetParameters>,
    get_types: Service<GetParameterTypes>,
    list: Service<ListParameters>,
    set: Service<SetParameters>,
    set_atomically: Service<SetParametersAtomically>,
}

impl<P: NodeParameters> ParameterServices<P> {
    /// The services of `node`, and what its body gets of them.
    pub(crate) fn open(
        node: &Node,
        parameters: &P,
    ) -> Result<(Self, LiveParameters<P>), ShellError> {
        let (changes, receiver) = watch::channel(parameters.clone());
        let services = Self {
            node_name: node.full_name(),
            clock: node.clock(),
            store: Store::new(parameters, node.switches())?,
            changes,
            events: node.own_publisher(EVENTS, &Qos::reliable(EVENTS_KEPT))?,
            describe: node.service("~/describe_parameters")?,
            get: node.service("~/get_parameters")?,
            get_types: node.service("~/get_parameter_types")?,
            list: node.service("~/list_parameters")?,
            set: node.service("~/set_parameters")?,
            set_atomically: node.service("~/set_parameters_atomically")?,
        };
        if services.store.has_own() {
            tracing::info!("parameters: {}", services.store.line());
        }
        Ok((services, LiveParameters { changes: Some(receiver) }))
    }

    /// Answers until `stop` resolves.
    pub(crate) async fn run(self, stop: impl Future<Output = ()>) {
        let Self {
            node_name,
            clock,
            mut store,
            changes,
            events,
            describe,
            get,
            get_types,
            list,
            set,
            set_atomically,
        } = self;
        let publisher = ChangePublisher { node_name, clock, changes, events };
        publisher
            .publish(ParameterEvent { new_parameters: store.all(), ..ParameterEvent::default() });
        let failed = Throttle::for_warnings();
        futures::pin_mut!(stop);
        loop {
            tokio::select! {
                () = &mut stop => return,
                request = describe.next() => {
                    let descriptors = store.describe(&request.message.names);
                    answer(&failed, request, &DescribeParametersResponse { descriptors });
                }
                request = get.next() => {
                    let values = store.values(&request.message.names);
                    answer(&failed, request, &GetParametersResponse { values });
                }
                request = get_types.next() => {
                    let types = store.types(&request.message.names);
                    answer(&failed, request, &GetParameterTypesResponse { types });
                }
                request = list.next() => {
                    let result = store.list(&request.message);
                    answer(&failed, request, &ListParametersResponse { result });
                }
                request = set.next() => {
                    let each = request.message.parameters.iter().map(std::slice::from_ref);
                    let results = each.map(|one| publisher.set(&mut store, one)).collect();
                    answer(&failed, request, &SetParametersResponse { results });
                }
                request = set_atomically.next() => {
                    let result = publisher.set(&mut store, &request.message.parameters);
                    answer(&failed, request, &SetParametersAtomicallyResponse { result });
                }
            }
        }
    }
}

/// Informs the node and the graph of changes.
struct ChangePublisher<P> {
    node_name: String,
    clock: NodeClock,
    changes: watch::Sender<P>,
    events: Publisher<ParameterEvent>,
}

impl<P: NodeParameters> ChangePublisher<P> {
    fn set(&self, store: &mut Store<P>, wanted: &[Parameter]) -> SetParametersResult {
        match store.set(wanted) {
            Ok(none) if none.is_empty() => {
                SetParametersResult { successful: true, reason: String::new() }
            }
            Ok(changed_parameters) => {
                let names: Vec<_> = wanted.iter().map(|one| one.name.as_str()).collect();
                tracing::info!("parameters were set: {}", names.join(", "));
                self.changes.send_replace(store.parameters().clone());
                self.publish(ParameterEvent { changed_parameters, ..ParameterEvent::default() });
                SetParametersResult { successful: true, reason: String::new() }
            }
            Err(reason) => SetParametersResult { successful: false, reason },
        }
    }

    fn publish(&self, event: ParameterEvent) {
        let node = self.node_name.clone();
        self.events.publish_or_warn(ParameterEvent { stamp: self.clock.now(), node, ..event });
    }
}
