//! The topics that viewers may subscribe to, each subscribed to while somebody wants it.

use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use msgs::builtin_interfaces::Time;
use msgs::diagnostic_msgs::DiagnosticArray;
use msgs::geometry_msgs::PoseStamped;
use msgs::map_msgs::OccupancyGridUpdate;
use msgs::nav_msgs::{OccupancyGrid, Odometry, Path};
use msgs::rcl_interfaces::Log;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, LaserScan, PointCloud2};
use msgs::stillmap_msgs::{DynamicZones, Tracks};
use msgs::tf2_msgs::TFMessage;
use msgs::visualization_msgs::MarkerArray;
use msgs::{RosMessage, cdr};
use node_shell::{Node, NodeFailure, Qos, Throttle};
use tokio::sync::{mpsc, watch};

use super::GraphOf;
use crate::foxglove::Advertised;

/// A message for a subscription of a viewer.
pub(super) struct Delivery {
    pub(super) subscription: u32,
    pub(super) at_ns: u64,
    pub(super) encoded: Arc<[u8]>,
}

/// A topic for viewers.
struct Channel {
    advertised: Advertised,
    is_latched: bool,
    subscribers: Mutex<Subscribers>,
    /// How many there are.
    count: watch::Sender<usize>,
}

#[derive(Default)]
struct Subscribers {
    next_key: u64,
    all: Vec<Subscriber>,
    /// The last message of a latched topic, for those that come later.
    last: Option<(u64, Arc<[u8]>)>,
}

struct Subscriber {
    key: u64,
    subscription: u32,
    sender: mpsc::Sender<Delivery>,
}

/// The topics, by their number.
pub(super) struct Channels(Vec<Arc<Channel>>);

/// A subscription of a viewer, as long as the value lives.
pub(super) struct Subscribed {
    channel: Arc<Channel>,
    key: u64,
}

/// What follows a topic while somebody wants it.
type Feed = Pin<Box<dyn Future<Output = Result<(), NodeFailure>> + Send>>;

/// All topics, and what is to run so that they have messages.
pub(super) fn of(node: &Arc<Node>, graph: GraphOf) -> (Channels, Vec<Feed>) {
    let mut topics = Topics { node, channels: Vec::new(), feeds: Vec::new() };
    // As the live view has them: within the process a latched map comes without being sent.
    let latched = Qos::new(graph == GraphOf::OtherProcesses, true, 1);
    let (sensor, events) = (Qos::sensor(5), Qos::reliable(20));
    topics.add::<PointCloud2>("static_map", latched, true);
    topics.add::<PointCloud2>("static_map_updates", events, false);
    topics.add::<PointCloud2>("static_map_removals", events, false);
    topics.add::<MarkerArray>("mesh", events, false);
    topics.add::<OccupancyGrid>("map", latched, true);
    topics.add::<OccupancyGridUpdate>("map_updates", events, false);
    topics.add::<PointCloud2>("static_cloud", sensor, false);
    topics.add::<PointCloud2>("dynamic_cloud", sensor, false);
    topics.add::<DynamicZones>("dynamic_zones", sensor, false);
    topics.add::<Tracks>("tracks", sensor, false);
    topics.add::<MarkerArray>("track_markers", events, false);
    topics.add::<LaserScan>("scan", sensor, false);
    topics.add::<LaserScan>("static_scan", events, false);
    topics.add::<Image>("depth/image", sensor, false);
    topics.add::<CompressedImage>("depth/image/compressedDepth", sensor, false);
    topics.add::<CameraInfo>("depth/camera_info", sensor, false);
    topics.add::<Image>("static_depth/image", sensor, false);
    topics.add::<Image>("rgb/image", sensor, false);
    topics.add::<CompressedImage>("rgb/image/compressed", sensor, false);
    topics.add::<PoseStamped>("pose", sensor, false);
    topics.add::<Odometry>("odom", sensor, false);
    topics.add::<Path>("path", sensor, false);
    topics.add::<Path>("map_path", latched, true);
    topics.add::<PointCloud2>("local_map", sensor, false);
    topics.add::<TFMessage>("/tf", Qos::sensor(100), false);
    topics.add::<TFMessage>("/tf_static", Qos::new(true, true, 100), true);
    topics.add::<DiagnosticArray>("/diagnostics", Qos::sensor(32), false);
    topics.add::<Log>("/rosout", Qos::sensor(100), false);
    (Channels(topics.channels), topics.feeds)
}

struct Topics<'a> {
    node: &'a Arc<Node>,
    channels: Vec<Arc<Channel>>,
    feeds: Vec<Feed>,
}

impl Topics<'_> {
    /// A topic by the suite's name, which viewers see whatever it is remapped to: a layout fits every robot.
    fn add<M: RosMessage>(&mut self, name: &'static str, qos: Qos, is_latched: bool) {
        let channel = Arc::new(Channel {
            advertised: Advertised {
                id: self.channels.len() as u32 + 1,
                topic: format!("/{}", name.trim_start_matches('/')),
                type_name: M::TYPE_NAME,
                schema: M::schema(),
            },
            is_latched,
            subscribers: Mutex::default(),
            count: watch::Sender::new(0),
        });
        self.channels.push(Arc::clone(&channel));
        self.feeds.push(Box::pin(follow::<M>(Arc::clone(self.node), name, qos, channel)));
    }
}

/// Hands the messages of a topic to its subscribers, while there are any.
async fn follow<M: RosMessage>(
    node: Arc<Node>,
    name: &'static str,
    qos: Qos,
    channel: Arc<Channel>,
) -> Result<(), NodeFailure> {
    let mut count = channel.count.subscribe();
    let bad_output = Throttle::for_warnings();
    loop {
        // The sender lives as long as the channel.
        let _ = count.wait_for(|count| *count > 0).await;
        let messages = node.subscription::<M>(name, &qos)?;
        node.counters().note_optional(messages.topic());
        loop {
            let received = tokio::select! {
                received = messages.next() => received,
                _ = count.wait_for(|count| *count == 0) => break,
            };
            match cdr::encode(&*received.message) {
                Ok(encoded) => channel.deliver(nanos(node.clock().now()), encoded.into()),
                Err(error) => {
                    if let Some(held_back) = bad_output.pass() {
                        tracing::warn!(
                            "a message of {name} is not sent to viewers: {error} ({held_back} more since the last warning)"
                        );
                    }
                }
            }
        }
        channel.subscribers().last = None;
    }
}

/// Nanoseconds since 1970; the time of a simulation may begin at 0.
fn nanos(time: Time) -> u64 {
    u64::try_from(time.sec).unwrap_or(0) * 1_000_000_000 + u64::from(time.nanosec)
}

impl Channel {
    fn subscribers(&self) -> MutexGuard<'_, Subscribers> {
        self.subscribers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Gives a message to each subscriber that has room for it.
    fn deliver(&self, at_ns: u64, encoded: Arc<[u8]>) {
        let mut subscribers = self.subscribers();
        for Subscriber { subscription, sender, .. } in &subscribers.all {
            let encoded = Arc::clone(&encoded);
            // One that is full, or has gone, gets none.
            let _ = sender.try_send(Delivery { subscription: *subscription, at_ns, encoded });
        }
        if self.is_latched {
            subscribers.last = Some((at_ns, encoded));
        }
    }
}

impl Channels {
    /// What viewers are told of them.
    pub(super) fn advertised(&self) -> Vec<Advertised> {
        self.0.iter().map(|channel| channel.advertised.clone()).collect()
    }

    /// Lets a viewer's subscription have the messages of a channel; none where there is no such channel.
    pub(super) fn subscribe(
        &self,
        channel: u32,
        subscription: u32,
        sender: &mpsc::Sender<Delivery>,
    ) -> Option<Subscribed> {
        let channel = self.0.iter().find(|one| one.advertised.id == channel)?;
        let mut subscribers = channel.subscribers();
        let key = subscribers.next_key;
        subscribers.next_key += 1;
        if let Some((at_ns, encoded)) = &subscribers.last {
            let encoded = Arc::clone(encoded);
            let _ = sender.try_send(Delivery { subscription, at_ns: *at_ns, encoded });
        }
        subscribers.all.push(Subscriber { key, subscription, sender: sender.clone() });
        let count = subscribers.all.len();
        drop(subscribers);
        channel.count.send_replace(count);
        Some(Subscribed { channel: Arc::clone(channel), key })
    }
}

impl Drop for Subscribed {
    fn drop(&mut self) {
        let mut subscribers = self.channel.subscribers();
        subscribers.all.retain(|subscriber| subscriber.key != self.key);
        let count = subscribers.all.len();
        drop(subscribers);
        self.channel.count.send_replace(count);
    }
}
