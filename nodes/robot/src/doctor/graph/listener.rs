//! The doctor's subscriptions.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{SystemTime, UNIX_EPOCH};

use geometry::Stamp;
use msgs::RosMessage;
use msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use msgs::geometry_msgs::{PoseStamped, PoseWithCovarianceStamped};
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{CameraInfo, Image, Imu, LaserScan, PointCloud2};
use msgs::tf2_msgs::TFMessage;
use node_shell::{DiscoveredEndpoint, Node, Qos, Role, ShellError, Subscription};

use super::received::ReceivedTopic;
use super::results;
use crate::doctor::content::{Observed, TransformFacts};
use crate::run::inputs::{TF, TF_STATIC};

const DIAGNOSTICS: &str = "/diagnostics";
/// Messages that may wait from one poll to the next.
const WAITING_SMALL: usize = 64;
/// Large messages that may wait from one poll to the next: their memory is the bound.
const WAITING_LARGE: usize = 4;
/// Topics that are subscribed to at most, so that the memory is bounded in a graph of any size.
const MOST_SMALL: usize = 64;
const MOST_LARGE: usize = 8;
/// Nodes whose reports are kept at most.
const MOST_REPORTS: usize = 1024;

/// All subscriptions of the doctor, and what they received.
pub(super) struct GraphListener {
    own_name: String,
    diagnostics: Subscription<DiagnosticArray>,
    fixed: Subscription<TFMessage>,
    moving: Subscription<TFMessage>,
    pub(super) reports: BTreeMap<String, DiagnosticStatus>,
    pub(super) transforms: TransformFacts,
    small: Vec<TopicListener>,
    large: Vec<TopicListener>,
    /// The graph for which all that is wanted is subscribed to.
    seen: Vec<DiscoveredEndpoint>,
}

impl GraphListener {
    pub(super) fn open(node: &Node) -> Result<Self, ShellError> {
        Ok(Self {
            own_name: node.full_name(),
            // Best effort is compatible with every publisher.
            diagnostics: node.subscription(DIAGNOSTICS, &Qos::sensor(WAITING_SMALL))?,
            fixed: node.subscription(TF_STATIC, &Qos::new(true, true, WAITING_SMALL))?,
            moving: node.subscription(TF, &Qos::sensor(WAITING_SMALL))?,
            reports: BTreeMap::new(),
            transforms: TransformFacts::default(),
            small: Vec::new(),
            large: Vec::new(),
            seen: Vec::new(),
        })
    }

    /// Subscribes to what has come into the graph since the last call. Returns whether the graph has changed.
    pub(super) fn follow(
        &mut self,
        node: &Node,
        survey: Vec<DiscoveredEndpoint>,
        measure: bool,
    ) -> Result<bool, ShellError> {
        if survey == self.seen {
            return Ok(false);
        }
        self.subscribe_to_new(node, &survey, measure)?;
        self.seen = survey;
        Ok(true)
    }

    fn subscribe_to_new(
        &mut self,
        node: &Node,
        survey: &[DiscoveredEndpoint],
        measure: bool,
    ) -> Result<(), ShellError> {
        let known: BTreeSet<String> = self
            .small
            .iter()
            .chain(&self.large)
            .map(|listener| listener.topic().to_owned())
            .collect();
        let results = results::of_suite(survey);
        let is_input = |topic: &str| !known.contains(topic) && !results.contains(topic);
        let mut new: Vec<_> = survey
            .iter()
            .filter(|one| one.role == Role::Publisher && is_input(&one.topic))
            .map(|one| (one.topic.as_str(), one.type_name.as_str()))
            .collect();
        new.dedup();
        for (topic, type_name) in new {
            // A peer may have a name that ROS 2 does not allow; such a topic is only listed.
            if node.resolve(topic).as_deref().ok() != Some(topic) {
                continue;
            }
            if self.small.len() < MOST_SMALL {
                self.small.extend(small_topic(node, topic, type_name)?);
            }
            if measure && self.large.len() < MOST_LARGE {
                self.large.extend(large_topic(node, topic, type_name)?);
            }
        }
        Ok(())
    }

    pub(super) fn take(&mut self) {
        while let Some(received) = self.diagnostics.try_next() {
            for status in &received.message.status {
                let is_known = self.reports.contains_key(&status.name);
                if status.name != self.own_name && (is_known || self.reports.len() < MOST_REPORTS) {
                    self.reports.insert(status.name.clone(), status.clone());
                }
            }
        }
        while let Some(received) = self.fixed.try_next() {
            self.transforms.take(&received.message, true);
        }
        while let Some(received) = self.moving.try_next() {
            self.transforms.take(&received.message, false);
        }
        let now = now();
        for listener in self.small.iter_mut().chain(&mut self.large) {
            listener.take(now);
        }
    }

    /// What was received on each topic.
    pub(super) fn into_received(self) -> BTreeMap<String, ReceivedTopic> {
        let listeners = self.small.into_iter().chain(self.large);
        listeners.map(|listener| (listener.topic().to_owned(), listener.received)).collect()
    }
}

/// The wall clock of this machine, which drivers use for their stamps.
fn now() -> Stamp {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Stamp::from_nanos(i64::try_from(since.as_nanos()).unwrap_or(i64::MAX))
}

/// The subscription to one topic, and what it received.
struct TopicListener {
    subscription: Box<dyn AnySubscription + Send>,
    received: ReceivedTopic,
}

impl TopicListener {
    fn open<M: Observed>(
        node: &Node,
        topic: &str,
        waiting: usize,
        bytes: fn(&M) -> usize,
    ) -> Result<Option<Self>, ShellError> {
        let subscription = node.subscription::<M>(topic, &Qos::sensor(waiting))?;
        let received = ReceivedTopic::of_type(M::TYPE_NAME);
        Ok(Some(Self {
            subscription: Box::new(TypedSubscription { subscription, bytes }),
            received,
        }))
    }

    fn topic(&self) -> &str {
        self.subscription.topic()
    }

    fn take(&mut self, now: Stamp) {
        self.subscription.take(now, &mut self.received);
    }
}

/// A subscription of any message type.
trait AnySubscription {
    fn topic(&self) -> &str;
    fn take(&self, now: Stamp, topic: &mut ReceivedTopic);
}

struct TypedSubscription<M: Observed> {
    subscription: Subscription<M>,
    /// The size of a message, of those that may be large.
    bytes: fn(&M) -> usize,
}

impl<M: Observed> AnySubscription for TypedSubscription<M> {
    fn topic(&self) -> &str {
        self.subscription.topic()
    }

    fn take(&self, now: Stamp, topic: &mut ReceivedTopic) {
        while let Some(received) = self.subscription.try_next() {
            topic.take(&*received.message, (self.bytes)(&received.message), now);
        }
    }
}

fn small_topic(
    node: &Node,
    topic: &str,
    type_name: &str,
) -> Result<Option<TopicListener>, ShellError> {
    match type_name {
        LaserScan::TYPE_NAME => TopicListener::open::<LaserScan>(node, topic, WAITING_SMALL, |_| 0),
        PoseStamped::TYPE_NAME => {
            TopicListener::open::<PoseStamped>(node, topic, WAITING_SMALL, |_| 0)
        }
        PoseWithCovarianceStamped::TYPE_NAME => {
            TopicListener::open::<PoseWithCovarianceStamped>(node, topic, WAITING_SMALL, |_| 0)
        }
        Odometry::TYPE_NAME => TopicListener::open::<Odometry>(node, topic, WAITING_SMALL, |_| 0),
        Imu::TYPE_NAME => TopicListener::open::<Imu>(node, topic, WAITING_SMALL, |_| 0),
        CameraInfo::TYPE_NAME => {
            TopicListener::open::<CameraInfo>(node, topic, WAITING_SMALL, |_| 0)
        }
        _ => Ok(None),
    }
}

fn large_topic(
    node: &Node,
    topic: &str,
    type_name: &str,
) -> Result<Option<TopicListener>, ShellError> {
    match type_name {
        Image::TYPE_NAME => {
            TopicListener::open::<Image>(node, topic, WAITING_LARGE, |one| one.data.len())
        }
        PointCloud2::TYPE_NAME => {
            TopicListener::open::<PointCloud2>(node, topic, WAITING_LARGE, |one| one.data.len())
        }
        _ => Ok(None),
    }
}

#[cfg(test)]
mod tests {
    use node_shell::{Host, RosArguments};

    use super::super::synthetic::{healthy, publisher};
    use super::*;

    /// Regression: what the suite publishes was looked for in the whole graph 20 times a second.
    #[test]
    fn a_graph_that_has_not_changed_is_not_looked_through_again() {
        let host = Host::in_process();
        let arguments = RosArguments::parse([] as [String; 0]).unwrap();
        let node = host.node("listener", &arguments).unwrap();
        let mut listener = GraphListener::open(&node).unwrap();
        let mut follow = |survey| listener.follow(&node, survey, true).unwrap();
        assert!(follow(healthy()));
        assert!(!follow(healthy()));
        let mut more = healthy();
        more.push(publisher("/rear/scan", LaserScan::TYPE_NAME, "/driver"));
        assert!(follow(more));
        assert!(listener.into_received().contains_key("/rear/scan"));
    }
}
