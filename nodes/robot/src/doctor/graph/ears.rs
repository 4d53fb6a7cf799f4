//! The doctor's subscriptions.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{SystemTime, UNIX_EPOCH};

use geometry::Stamp;
use msgs::RosMessage;
use msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use msgs::geometry_msgs::PoseStamped;
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{CameraInfo, Image, Imu, LaserScan, PointCloud2};
use msgs::tf2_msgs::TFMessage;
use node_shell::{DiscoveredEndpoint, Node, Qos, Role, ShellError, Subscription};

use super::heard::Heard;
use crate::doctor::content::{Observed, TransformFacts};
use crate::run::inputs::{TF, TF_STATIC};

const DIAGNOSTICS: &str = "/diagnostics";
/// Messages that may wait between two looks.
const WAITING_SMALL: usize = 64;
/// Large messages that may wait between two looks: their memory is the bound.
const WAITING_LARGE: usize = 4;
/// Topics that are listened to at most, so that a graph of any size stays bounded.
const MOST_SMALL: usize = 64;
const MOST_LARGE: usize = 8;
/// Nodes whose reports are kept at most.
const MOST_REPORTS: usize = 1024;

/// All of them.
pub(super) struct Ears {
    own_name: String,
    diagnostics: Subscription<DiagnosticArray>,
    fixed: Subscription<TFMessage>,
    moving: Subscription<TFMessage>,
    pub(super) reports: BTreeMap<String, DiagnosticStatus>,
    pub(super) transforms: TransformFacts,
    small: Vec<Ear>,
    large: Vec<Ear>,
}

impl Ears {
    pub(super) fn open(node: &Node) -> Result<Self, ShellError> {
        Ok(Self {
            own_name: node.full_name(),
            // Best effort fits whoever reports.
            diagnostics: node.subscription(DIAGNOSTICS, &Qos::sensor(WAITING_SMALL))?,
            fixed: node.subscription(TF_STATIC, &Qos::new(true, true, WAITING_SMALL))?,
            moving: node.subscription(TF, &Qos::sensor(WAITING_SMALL))?,
            reports: BTreeMap::new(),
            transforms: TransformFacts::default(),
            small: Vec::new(),
            large: Vec::new(),
        })
    }

    /// Subscribes to what has come up of use since.
    pub(super) fn open_more(
        &mut self,
        node: &Node,
        survey: &[DiscoveredEndpoint],
        measure: bool,
    ) -> Result<(), ShellError> {
        let known: BTreeSet<String> =
            self.small.iter().chain(&self.large).map(|ear| ear.topic().to_owned()).collect();
        let mut new: Vec<_> = survey
            .iter()
            .filter(|one| one.role == Role::Publisher && !known.contains(&one.topic))
            .map(|one| (one.topic.as_str(), one.type_name.as_str()))
            .collect();
        new.dedup();
        for (topic, type_name) in new {
            // A peer may have a name that ROS 2 does not allow; such a topic is only listed.
            if node.resolve(topic).as_deref().ok() != Some(topic) {
                continue;
            }
            if self.small.len() < MOST_SMALL {
                self.small.extend(small_ear(node, topic, type_name)?);
            }
            if measure && self.large.len() < MOST_LARGE {
                self.large.extend(large_ear(node, topic, type_name)?);
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
        for ear in self.small.iter_mut().chain(&mut self.large) {
            ear.take(now);
        }
    }

    /// What came on each topic.
    pub(super) fn heard(self) -> BTreeMap<String, Heard> {
        let ears = self.small.into_iter().chain(self.large);
        ears.map(|ear| (ear.topic().to_owned(), ear.heard)).collect()
    }
}

/// By the wall clock of this machine, as drivers stamp.
fn now() -> Stamp {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Stamp::from_nanos(i64::try_from(since.as_nanos()).unwrap_or(i64::MAX))
}

/// A topic that is listened to.
struct Ear {
    subscription: Box<dyn Listen + Send>,
    heard: Heard,
}

impl Ear {
    fn open<M: Observed>(
        node: &Node,
        topic: &str,
        waiting: usize,
        bytes: fn(&M) -> usize,
    ) -> Result<Option<Self>, ShellError> {
        let subscription = node.subscription::<M>(topic, &Qos::sensor(waiting))?;
        let heard = Heard::of_type(M::TYPE_NAME);
        Ok(Some(Self { subscription: Box::new(Typed { subscription, bytes }), heard }))
    }

    fn topic(&self) -> &str {
        self.subscription.topic()
    }

    fn take(&mut self, now: Stamp) {
        self.subscription.take(now, &mut self.heard);
    }
}

/// A subscription of whatever type.
trait Listen {
    fn topic(&self) -> &str;
    fn take(&self, now: Stamp, heard: &mut Heard);
}

struct Typed<M: Observed> {
    subscription: Subscription<M>,
    /// The size of a message, of those that may be large.
    bytes: fn(&M) -> usize,
}

impl<M: Observed> Listen for Typed<M> {
    fn topic(&self) -> &str {
        self.subscription.topic()
    }

    fn take(&self, now: Stamp, heard: &mut Heard) {
        while let Some(received) = self.subscription.try_next() {
            heard.take(&*received.message, (self.bytes)(&received.message), now);
        }
    }
}

fn small_ear(node: &Node, topic: &str, type_name: &str) -> Result<Option<Ear>, ShellError> {
    match type_name {
        LaserScan::TYPE_NAME => Ear::open::<LaserScan>(node, topic, WAITING_SMALL, |_| 0),
        PoseStamped::TYPE_NAME => Ear::open::<PoseStamped>(node, topic, WAITING_SMALL, |_| 0),
        Odometry::TYPE_NAME => Ear::open::<Odometry>(node, topic, WAITING_SMALL, |_| 0),
        Imu::TYPE_NAME => Ear::open::<Imu>(node, topic, WAITING_SMALL, |_| 0),
        CameraInfo::TYPE_NAME => Ear::open::<CameraInfo>(node, topic, WAITING_SMALL, |_| 0),
        _ => Ok(None),
    }
}

fn large_ear(node: &Node, topic: &str, type_name: &str) -> Result<Option<Ear>, ShellError> {
    match type_name {
        Image::TYPE_NAME => Ear::open::<Image>(node, topic, WAITING_LARGE, |one| one.data.len()),
        PointCloud2::TYPE_NAME => {
            Ear::open::<PointCloud2>(node, topic, WAITING_LARGE, |one| one.data.len())
        }
        _ => Ok(None),
    }
}
