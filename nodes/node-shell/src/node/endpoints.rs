//! The ends of topics and services that a node has.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Weak};

use msgs::{Domain, RosMessage, RosService};

use super::Node;
use crate::endpoints::gate::Gate;
use crate::endpoints::network::Link;
use crate::endpoints::publisher::{Outlet, Publisher, RawPublisher, ValuePublisher};
use crate::endpoints::raw_subscription::RawSubscription;
use crate::endpoints::reader::{self, MakeReader, Reader};
use crate::endpoints::service::Service;
use crate::endpoints::service_client::ServiceClient;
use crate::endpoints::subscription::{Subscription, ValueSubscription};
use crate::endpoints::writer::{self, MakeWriter, Writer};
use crate::graph::exchange::TopicKey;
use crate::graph::inbox::Queue;
use crate::graph::value::Incoming;
use crate::graph::{OpenEndpoint, Role};
use crate::settings::names;
use crate::settings::qos::Qos;
use crate::wire::error::ShellError;
#[cfg(feature = "zenoh")]
use crate::wire::rmw_zenoh::keys::{self, End, Token, UNKNOWN_HASH};

/// The type of messages that are encoded already.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct RawType<'a> {
    /// As `sensor_msgs/msg/LaserScan`.
    pub name: &'a str,
    /// Its text and that of all types in it, as bags have it, where it need not be known here.
    pub definition: Option<&'a str>,
    /// The hash of its definition (REP-2011), for one that is not known at all.
    pub hash: Option<&'a str>,
}

impl<'a> RawType<'a> {
    fn named(name: &'a str) -> Self {
        Self { name, definition: None, hash: None }
    }
}

impl Node {
    /// The absolute name of a topic, after remapping.
    ///
    /// # Errors
    /// When the name breaks the rules for topic names.
    pub fn resolve(&self, topic: &str) -> Result<String, ShellError> {
        Ok(self.identity.resolve(&self.arguments.remappings, topic)?)
    }

    /// A publisher of messages of one type.
    ///
    /// # Errors
    /// When the name is none, or the library refuses.
    pub fn publisher<M: RosMessage>(
        &self,
        topic: &str,
        qos: &Qos,
    ) -> Result<Publisher<M>, ShellError> {
        Ok(Publisher::new(self.outlet(topic, M::TYPE_NAME, qos, self.life.gate())?))
    }

    /// A publisher of values, which are messages only for those who want them.
    ///
    /// # Errors
    /// When the name is none, or the library refuses.
    pub fn value_publisher<T: Domain>(
        &self,
        topic: &str,
        qos: &Qos,
    ) -> Result<ValuePublisher<T>, ShellError> {
        let type_name = T::Message::TYPE_NAME;
        Ok(ValuePublisher::new(self.outlet(topic, type_name, qos, self.life.gate())?))
    }

    /// A publisher of what the node says of itself, whether it works or not.
    pub(crate) fn own_publisher<M: RosMessage>(
        &self,
        topic: &str,
        qos: &Qos,
    ) -> Result<Publisher<M>, ShellError> {
        Ok(Publisher::new(self.outlet(topic, M::TYPE_NAME, qos, Gate::default())?))
    }

    /// A publisher of messages that are encoded already; `type_name` as `sensor_msgs/msg/LaserScan`.
    ///
    /// # Errors
    /// When a name is none, or the library refuses.
    pub fn raw_publisher(
        &self,
        topic: &str,
        type_name: &str,
        qos: &Qos,
    ) -> Result<RawPublisher, ShellError> {
        self.raw_publisher_of(topic, RawType::named(type_name), qos)
    }

    /// The same, of a type that need not be known here. On Zenoh none hears messages of a type with neither definition nor hash.
    ///
    /// # Errors
    /// As [`Node::raw_publisher`].
    pub fn raw_publisher_of(
        &self,
        topic: &str,
        kind: RawType<'_>,
        qos: &Qos,
    ) -> Result<RawPublisher, ShellError> {
        Ok(RawPublisher::new(self.outlet_of(topic, kind, qos, self.life.gate())?))
    }

    /// A subscription to messages of one type. Messages that arrive while the node is inactive are ignored, except on a topic
    /// whose last messages are latched: they come once.
    ///
    /// # Errors
    /// When the name is none, or the library refuses.
    pub fn subscription<M: RosMessage>(
        &self,
        topic: &str,
        qos: &Qos,
    ) -> Result<Subscription<M>, ShellError> {
        self.subscription_behind(self.gate_for(qos), (topic, M::TYPE_NAME), qos)
    }

    /// A subscription to values: as they were published in this process, or as messages.
    ///
    /// # Errors
    /// When the name is none, or the library refuses.
    pub fn value_subscription<T: Domain>(
        &self,
        topic: &str,
        qos: &Qos,
    ) -> Result<ValueSubscription<T>, ShellError> {
        self.subscription_behind(self.gate_for(qos), (topic, T::Message::TYPE_NAME), qos)
    }

    /// A subscription to messages that are handed on as they are; `type_name` as `sensor_msgs/msg/LaserScan`.
    ///
    /// # Errors
    /// When a name is none, or the library refuses.
    pub fn raw_subscription(
        &self,
        topic: &str,
        type_name: &str,
        qos: &Qos,
    ) -> Result<RawSubscription, ShellError> {
        let messages = self.subscription_behind(self.gate_for(qos), (topic, type_name), qos)?;
        Ok(RawSubscription::new(messages))
    }

    /// A latched message comes once, and so at any time.
    fn gate_for(&self, qos: &Qos) -> Gate {
        if qos.is_transient_local() { Gate::default() } else { self.life.gate() }
    }

    pub(crate) fn subscription_behind<I: Incoming>(
        &self,
        gate: Gate,
        (topic, type_name): (&str, &str),
        qos: &Qos,
    ) -> Result<Subscription<I>, ShellError> {
        let absolute = self.resolve(topic)?;
        let dds_type = names::dds_type_name(type_name)?;
        let queue = Arc::new(Queue::new(qos.depth()));
        let key = TopicKey { topic: absolute.clone(), dds_type: dds_type.clone() };
        let id = self.host.exchange().enter_subscription(key, qos, queue.clone());
        let endpoint = OpenEndpoint::new(id, &self.graph);
        let place = (Role::Subscription, absolute.as_str(), dds_type.as_str());
        let failed = |reason| endpoint_error("subscription", &absolute, reason);
        let reader = match self.network.as_ref().map(|network| &network.link) {
            None => self.graph.enter(id, place, || Ok::<_, ShellError>(None))?,
            Some(Link::Dds(dds)) => {
                let make = dds.reader_maker::<I::Message>(&absolute, &dds_type, qos);
                let first = self.graph.enter(id, place, || make().map(Some)).map_err(failed)?;
                let graph = self.graph.clone();
                let remake: MakeReader<I::Message> = Box::new(move || graph.renew(id, &make));
                first.map(|first| {
                    let reader =
                        Reader::new((&absolute, type_name), first, qos.is_reliable(), remake);
                    self.graph.renew_with(id, reader.renewal());
                    reader::Outside::Dds(reader)
                })
            }
            #[cfg(feature = "zenoh")]
            Some(Link::Zenoh(node)) => {
                let end = topic_end(&absolute, &dds_type, RawType::named(type_name), qos);
                let hash = end.hash.clone();
                let make = || node.subscription(end).map(|(token, one)| Some((guid(&token), one)));
                let made = self.graph.enter(id, place, make).map_err(failed)?;
                self.graph.enter_hash(id, &hash);
                made.map(reader::Outside::Zenoh)
            }
        };
        let counters = self.counters.of_subscription(&absolute);
        Ok(Subscription::new((&absolute, qos.depth()), queue, reader, endpoint, (counters, gate)))
    }

    /// A service, for those outside; it must be dropped before the node is closed.
    ///
    /// # Errors
    /// When the name is none, or the library refuses.
    pub fn service<S: RosService>(&self, name: &str) -> Result<Service<S>, ShellError> {
        let absolute = self.identity.resolve_service(&self.arguments.remappings, name)?;
        match &self.network {
            None => Ok(Service::unasked(&absolute)),
            Some(network) => Service::new(network, &self.graph, &absolute),
        }
    }

    /// A client of a service; it must be dropped before the node is closed. A node keeps one client of a service: the server is taken
    /// to know a second one as soon as it knows the first.
    ///
    /// # Errors
    /// When the name is none, or the library refuses.
    pub fn service_client<S: RosService>(
        &self,
        name: &str,
    ) -> Result<ServiceClient<S>, ShellError> {
        let absolute = self.identity.resolve_service(&self.arguments.remappings, name)?;
        match &self.network {
            None => Ok(ServiceClient::of_nobody(&absolute)),
            Some(network) => ServiceClient::new(network, &self.graph, &absolute),
        }
    }

    fn outlet(
        &self,
        topic: &str,
        type_name: &str,
        qos: &Qos,
        gate: Gate,
    ) -> Result<Outlet, ShellError> {
        self.outlet_of(topic, RawType::named(type_name), qos, gate)
    }

    fn outlet_of(
        &self,
        topic: &str,
        kind: RawType<'_>,
        qos: &Qos,
        gate: Gate,
    ) -> Result<Outlet, ShellError> {
        let absolute = self.resolve(topic)?;
        let dds_type = names::dds_type_name(kind.name)?;
        let key = TopicKey { topic: absolute.clone(), dds_type: dds_type.clone() };
        let id = self.host.exchange().enter_publisher(key, qos);
        let endpoint = OpenEndpoint::new(id, &self.graph);
        let keeps = if qos.is_transient_local() { qos.depth() } else { 0 };
        let place = (Role::Publisher, absolute.as_str(), dds_type.as_str());
        let failed = |reason| endpoint_error("publisher", &absolute, reason);
        let writer = match self.network.as_ref().map(|network| &network.link) {
            None => self.graph.enter(id, place, || Ok::<_, ShellError>(None))?,
            Some(Link::Dds(dds)) => {
                let make = dds.writer_maker(&absolute, &dds_type, qos.writer_policies(kind.name));
                let first = self.graph.enter(id, place, || make().map(Some)).map_err(failed)?;
                let graph = self.graph.clone();
                let remake: MakeWriter = Box::new(move || graph.renew(id, &make));
                first.map(|first| {
                    let writer = Writer::new(&absolute, first, keeps, remake);
                    let link: Weak<Writer> = Arc::downgrade(&writer);
                    self.graph.renew_with(id, link);
                    writer::Outside::Dds(writer)
                })
            }
            #[cfg(feature = "zenoh")]
            Some(Link::Zenoh(node)) => {
                let end = topic_end(&absolute, &dds_type, kind, qos);
                let hash = end.hash.clone();
                let make = || node.publisher(end).map(|(token, one)| Some((guid(&token), one)));
                let made = self.graph.enter(id, place, make).map_err(failed)?;
                self.graph.enter_hash(id, &hash);
                made.map(|one| writer::Outside::Zenoh(Box::new(one)))
            }
        };
        Ok(Outlet {
            topic: absolute.as_str().into(),
            exchange: Arc::clone(self.host.exchange()),
            endpoint,
            writer,
            keeps: qos.is_transient_local(),
            granted: self.granted_buffer(),
            warned_of_size: AtomicBool::new(false),
            published: self.counters.of_publisher(&absolute),
            gate,
        })
    }
}

/// A topic as it is announced on Zenoh.
#[cfg(feature = "zenoh")]
fn topic_end(absolute: &str, dds_type: &str, kind: RawType<'_>, qos: &Qos) -> End {
    let hash_by = |schema: &str| msgs::type_hash_of(kind.name, schema);
    // A definition of ROS 1 gives none.
    let hash = kind
        .definition
        .and_then(hash_by)
        .or_else(|| msgs::schema_of(kind.name).as_deref().and_then(hash_by))
        .or_else(|| kind.hash.filter(|hash| keys::is_hash(hash)).map(str::to_owned))
        .unwrap_or_else(|| UNKNOWN_HASH.to_owned());
    End { name: absolute.to_owned(), dds_type: dds_type.to_owned(), hash, qos: *qos }
}

#[cfg(feature = "zenoh")]
fn guid(token: &Token) -> rustdds::GUID {
    rustdds::GUID::from_bytes(token.guid_bytes())
}

fn endpoint_error(endpoint: &'static str, topic: &str, reason: String) -> ShellError {
    ShellError::Endpoint { endpoint, topic: topic.to_owned(), reason }
}
