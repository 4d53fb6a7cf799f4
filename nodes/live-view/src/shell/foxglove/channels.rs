//! The topics that viewers may subscribe to, each subscribed to while somebody wants it.

use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use msgs::RosMessage;
use msgs::builtin_interfaces::Time;
use msgs::cdr::{self, CdrError};
use msgs::diagnostic_msgs::DiagnosticArray;
use msgs::geometry_msgs::PoseStamped;
use msgs::map_msgs::OccupancyGridUpdate;
use msgs::nav_msgs::{OccupancyGrid, Odometry, Path};
use msgs::rcl_interfaces::Log;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, LaserScan, PointCloud2};
use msgs::stillmap_msgs::{DynamicZones, Tracks};
use msgs::tf2_msgs::TFMessage;
use msgs::visualization_msgs::MarkerArray;
use node_shell::{Node, NodeFailure, Qos, Throttle};
use tokio::sync::watch;

use super::GraphOf;
use super::retained::{AllTransforms, LastMessage, Nothing, Retained, Retention};
use super::waiting::{Inlet, Keep, Waiting};
use crate::foxglove::Advertised;

/// A topic for viewers.
struct Channel {
    advertised: Advertised,
    /// What waits for a viewer that takes too little.
    keep: Keep,
    subscribers: Mutex<Subscribers>,
    /// How many there are.
    count: watch::Sender<usize>,
}

#[derive(Default)]
struct Subscribers {
    next_key: u64,
    all: Vec<Subscriber>,
    /// What those that come later get of a latched topic.
    retained: Option<(u64, Arc<[u8]>)>,
}

struct Subscriber {
    key: u64,
    inlet: Inlet,
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
    let latched = (latched, Keep::FirstAndLast);
    // Each of these is complete in itself, and a viewer shows the newest.
    let sensor = (Qos::sensor(5), Keep::Newest(1));
    let events = in_order(Qos::reliable(20));
    topics.add::<PointCloud2, LastMessage>("static_map", latched);
    topics.add::<PointCloud2, Nothing>("static_map_updates", events);
    topics.add::<PointCloud2, Nothing>("static_map_removals", events);
    topics.add::<MarkerArray, Nothing>("mesh", events);
    topics.add::<OccupancyGrid, LastMessage>("map", latched);
    topics.add::<OccupancyGridUpdate, Nothing>("map_updates", events);
    topics.add::<PointCloud2, Nothing>("static_cloud", sensor);
    topics.add::<PointCloud2, Nothing>("dynamic_cloud", sensor);
    topics.add::<DynamicZones, Nothing>("dynamic_zones", sensor);
    topics.add::<Tracks, Nothing>("tracks", sensor);
    topics.add::<MarkerArray, Nothing>("track_markers", events);
    topics.add::<LaserScan, Nothing>("scan", sensor);
    topics.add::<LaserScan, Nothing>("static_scan", events);
    topics.add::<Image, Nothing>("depth/image", sensor);
    topics.add::<CompressedImage, Nothing>("depth/image/compressedDepth", sensor);
    topics.add::<CameraInfo, Nothing>("depth/camera_info", sensor);
    topics.add::<Image, Nothing>("static_depth/image", sensor);
    topics.add::<Image, Nothing>("rgb/image", sensor);
    topics.add::<Image, Nothing>("static_rgb/image", sensor);
    topics.add::<CompressedImage, Nothing>("rgb/image/compressed", sensor);
    topics.add::<PoseStamped, Nothing>("pose", sensor);
    topics.add::<Odometry, Nothing>("odom", sensor);
    topics.add::<Path, Nothing>("path", sensor);
    topics.add::<Path, LastMessage>("map_path", latched);
    topics.add::<PointCloud2, Nothing>("local_map", sensor);
    topics.add::<TFMessage, Nothing>("/tf", in_order(Qos::sensor(100)));
    topics.add::<TFMessage, AllTransforms>(
        "/tf_static",
        (Qos::new(true, true, 100), Keep::FirstAndLast),
    );
    topics.add::<DiagnosticArray, Nothing>("/diagnostics", in_order(Qos::sensor(32)));
    topics.add::<Log, Nothing>("/rosout", in_order(Qos::sensor(100)));
    (Channels(topics.channels), topics.feeds)
}

/// As many wait for a viewer as for a subscriber.
const fn in_order(qos: Qos) -> (Qos, Keep) {
    (qos, Keep::Newest(qos.depth()))
}

struct Topics<'a> {
    node: &'a Arc<Node>,
    channels: Vec<Arc<Channel>>,
    feeds: Vec<Feed>,
}

impl Topics<'_> {
    /// A topic by the suite's name, which viewers see whatever it is remapped to: a layout fits every robot.
    fn add<M: RosMessage, R: Retention<M>>(
        &mut self,
        name: &'static str,
        (qos, keep): (Qos, Keep),
    ) {
        let channel = Arc::new(Channel {
            advertised: Advertised {
                id: self.channels.len() as u32 + 1,
                topic: format!("/{}", name.trim_start_matches('/')),
                type_name: M::TYPE_NAME,
                schema: M::schema(),
            },
            keep,
            subscribers: Mutex::default(),
            count: watch::Sender::new(0),
        });
        self.channels.push(Arc::clone(&channel));
        self.feeds.push(Box::pin(follow::<M, R>(Arc::clone(self.node), name, qos, channel)));
    }
}

/// Hands the messages of a topic to its subscribers, while there are any.
async fn follow<M: RosMessage, R: Retention<M>>(
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
        let mut retention = R::default();
        loop {
            let received = tokio::select! {
                received = messages.next() => received,
                _ = count.wait_for(|count| *count == 0) => break,
            };
            match encoded(&*received.message, &mut retention) {
                Ok(encoded) => channel.deliver(nanos(node.clock().now()), encoded),
                Err(error) => {
                    if let Some(held_back) = bad_output.pass() {
                        tracing::warn!(
                            "a message of {name} is not sent to viewers: {error} ({held_back} more since the last warning)"
                        );
                    }
                }
            }
        }
        channel.subscribers().retained = None;
    }
}

/// A message in CDR.
struct Encoded {
    message: Arc<[u8]>,
    /// What is kept of the topic for those that come later, if that is another than before.
    retained: Option<Arc<[u8]>>,
}

fn encoded<M: RosMessage>(
    message: &M,
    retention: &mut impl Retention<M>,
) -> Result<Encoded, CdrError> {
    let encoded: Arc<[u8]> = cdr::encode(message)?.into();
    let retained = match retention.after(message) {
        Retained::Nothing => None,
        Retained::Message => Some(Arc::clone(&encoded)),
        Retained::Merged(merged) => Some(cdr::encode(&merged)?.into()),
    };
    Ok(Encoded { message: encoded, retained })
}

/// Nanoseconds since 1970; the time of a simulation may begin at 0.
fn nanos(time: Time) -> u64 {
    u64::try_from(time.sec).unwrap_or(0) * 1_000_000_000 + u64::from(time.nanosec)
}

impl Channel {
    fn subscribers(&self) -> MutexGuard<'_, Subscribers> {
        self.subscribers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Gives a message to each subscriber; of a latched topic what holds after it, as a later message takes its place where it waits.
    fn deliver(&self, at_ns: u64, Encoded { message, retained }: Encoded) {
        let mut subscribers = self.subscribers();
        let holds = retained.as_ref().unwrap_or(&message);
        for Subscriber { inlet, .. } in &subscribers.all {
            inlet.push(at_ns, Arc::clone(holds));
        }
        if let Some(retained) = retained {
            subscribers.retained = Some((at_ns, retained));
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
        waiting: &Arc<Waiting>,
    ) -> Option<Subscribed> {
        let channel = self.0.iter().find(|one| one.advertised.id == channel)?;
        let mut subscribers = channel.subscribers();
        let key = subscribers.next_key;
        subscribers.next_key += 1;
        let inlet = waiting.inlet(subscription, channel.keep);
        if let Some((at_ns, encoded)) = &subscribers.retained {
            inlet.push(*at_ns, Arc::clone(encoded));
        }
        subscribers.all.push(Subscriber { key, inlet });
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

#[cfg(test)]
mod tests {
    use msgs::geometry_msgs::TransformStamped;
    use node_shell::{Host, RosArguments};

    use super::*;

    /// Regression: a viewer that came second had the transforms of the last broadcaster alone.
    #[test]
    fn a_viewer_that_comes_second_gets_the_static_transforms_of_all_broadcasters() {
        let host = Host::in_process();
        let arguments = RosArguments::parse([] as [String; 0]).unwrap();
        let node = Arc::new(host.node("foxglove", &arguments).unwrap());
        let robot = host.node("robot", &arguments).unwrap();
        let tf_static = Qos::new(true, true, 100);
        let broadcasters = ["laser", "imu"].map(|child| {
            let publisher = robot.publisher::<TFMessage>("/tf_static", &tf_static).unwrap();
            let child_frame_id = child.to_owned();
            let transform = TransformStamped { child_frame_id, ..TransformStamped::default() };
            publisher.publish(TFMessage { transforms: vec![transform] }).unwrap();
            publisher
        });
        let (channels, feeds) = of(&node, GraphOf::OtherProcesses);
        let index = channels.0.iter().position(|one| one.advertised.topic == "/tf_static").unwrap();
        let feed = feeds.into_iter().nth(index).unwrap();
        let [first, second] = [(); 2].map(|()| Arc::new(Waiting::default()));
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let delivered = runtime.block_on(async {
            let _first = channels.subscribe(index as u32 + 1, 1, &first).unwrap();
            let heard = async {
                for _ in &broadcasters {
                    first.next().await;
                }
            };
            tokio::select! {
                () = heard => {}
                ended = feed => ended.unwrap(),
            }
            let _second = channels.subscribe(index as u32 + 1, 2, &second).unwrap();
            second.take().unwrap()
        });
        let message: TFMessage = cdr::decode(&delivered.encoded).unwrap();
        let children: Vec<&str> =
            message.transforms.iter().map(|one| one.child_frame_id.as_str()).collect();
        assert_eq!(children, ["imu", "laser"]);
    }

    /// Regression: a viewer on a slow link was ten seconds late for good, and a latched message that found its queue full was lost.
    #[test]
    fn a_slow_viewer_gets_the_newest_image_and_every_latched_topic() {
        let host = Host::in_process();
        let arguments = RosArguments::parse([] as [String; 0]).unwrap();
        let node = Arc::new(host.node("foxglove", &arguments).unwrap());
        let (channels, _feeds) = of(&node, GraphOf::OtherProcesses);
        let named = |topic: &str| {
            let one = channels.0.iter().find(|one| one.advertised.topic == topic).unwrap();
            (one.advertised.id, one)
        };
        let waiting = Arc::new(Waiting::default());
        let topics = ["/depth/image", "/static_map", "/tf_static", "/tf"].map(named);
        let _subscribed = topics.map(|(id, _)| channels.subscribe(id, id, &waiting).unwrap());
        let [(_, image), (_, map), (_, transforms), (_, tf)] = topics;
        let plain = |text: String| Encoded { message: text.into_bytes().into(), retained: None };
        let latched = |text: &str| {
            let message: Arc<[u8]> = text.as_bytes().into();
            Encoded { retained: Some(Arc::clone(&message)), message }
        };
        for index in 0..1_000 {
            image.deliver(index, plain(format!("image {index}")));
            tf.deliver(index, plain(format!("tf {index}")));
        }
        map.deliver(1_000, latched("map"));
        transforms.deliver(1_000, latched("transforms"));
        let sent: Vec<String> = std::iter::from_fn(|| waiting.take())
            .map(|one| String::from_utf8(one.encoded.to_vec()).unwrap())
            .collect();
        let tf = (900..1_000).map(|index| format!("tf {index}"));
        let expected: Vec<String> = std::iter::once("image 999".to_owned())
            .chain(tf)
            .chain(["map".to_owned(), "transforms".to_owned()])
            .collect();
        assert_eq!(sent, expected);
    }
}
