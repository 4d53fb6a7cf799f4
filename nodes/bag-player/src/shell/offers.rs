//! The publishers of the topics of a bag, each with the QoS that it was recorded with.

use std::collections::BTreeMap;

use msgs::RosMessage;
use msgs::sensor_msgs::CompressedImage;
use node_shell::{Node, PublishError, Qos, RawPublisher, RawType, ShellError};

use crate::info::TopicInfo;
use crate::message::{BagMessage, full_type_name};
use crate::qos::{Durability, OfferedQos, Reliability};
use crate::shell::compress::Compression;
use crate::shell::latched::Latched;
use crate::shell::options::PlayOptions;
use crate::shell::summary::TopicSummary;

/// Types whose messages are too large for reliable delivery.
pub(super) const LARGE_TYPES: [&str; 3] =
    ["sensor_msgs/msg/Image", "sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/CompressedImage"];

/// The static transforms. They are always latched, as listeners of tf2 require, even where a converted or cut bag states
/// another QoS.
const FIXED_TRANSFORMS: &str = "tf_static";

/// Last parts of topic names that are latched by convention (tf2, REP-2003), and a type that is.
const LATCHED_TOPICS: [&str; 4] = ["tf_static", "map", "static_map", "robot_description"];
const LATCHED_TYPE: &str = "nav_msgs/msg/OccupancyGrid";

/// Samples kept for late subscribers where several publishers of a latched topic were recorded as one.
const MOST_LATCHED: u64 = 100;

/// Depths where the bag has none: REP-2003 for sensors, the default of ROS 2 for the rest.
const SENSOR_DEPTH: u32 = 5;
const DEFAULT_DEPTH: u32 = 10;

/// The depth that replaces a history that keeps all.
const KEEP_ALL_DEPTH: u64 = 1000;

/// One topic that is played.
struct Offer {
    publisher: RawPublisher,
    type_name: String,
    /// The number of messages that a subscriber has that comes later; 0 unless the topic is latched.
    latched: usize,
    summary: TopicSummary,
}

/// The topics that are played, by their name in the bag.
pub(super) struct Offers(BTreeMap<String, Offer>);

impl Offers {
    /// Creates a publisher for each topic.
    pub(super) fn create<'a>(
        node: &Node,
        options: &PlayOptions,
        compression: &Compression,
        topics: impl Iterator<Item = &'a TopicInfo>,
    ) -> Result<Self, ShellError> {
        let mut offers: BTreeMap<String, Offer> = BTreeMap::new();
        for topic in topics {
            if let Some(first) = offers.get(&topic.topic) {
                tracing::warn!(
                    "{} carries {} and {}: only the first is played",
                    topic.topic,
                    first.type_name,
                    topic.type_name
                );
                continue;
            }
            let qos = qos_of(topic);
            let mut type_name = full_type_name(&topic.type_name);
            let mut described = (topic.definition.as_deref(), topic.type_hash.as_deref());
            let mut name = options.published_name(&topic.topic).to_owned();
            if let Some(part) = compression.topic_part(&topic.topic) {
                // Below the remapped name of the raw image.
                name = format!("{}/{part}", node.resolve(&name)?);
                type_name = CompressedImage::TYPE_NAME.to_owned();
                described = (None, None);
            }
            let (definition, hash) = described;
            let kind = RawType { name: &type_name, definition, hash };
            let publisher = node.raw_publisher_of(&name, kind, &qos)?;
            let summary = TopicSummary::new(&topic.topic, publisher.topic(), &type_name);
            let latched = if qos.is_transient_local() { last_latched(topic, &qos) } else { 0 };
            offers.insert(topic.topic.clone(), Offer { publisher, type_name, latched, summary });
        }
        Ok(Self(offers))
    }

    /// The topics whose messages of before the played part are published, too.
    pub(super) fn latched(&self) -> Latched {
        let latched = self.0.iter().filter(|(_, offer)| offer.latched > 0);
        Latched::new(latched.map(|(topic, offer)| (topic.clone(), offer.latched)).collect())
    }

    /// Publishes a message. `None` if its topic is not played with this type.
    pub(super) fn publish(&mut self, message: &BagMessage) -> Option<Result<(), PublishError>> {
        let offer = self.0.get_mut(&*message.topic)?;
        if offer.type_name != full_type_name(&message.type_name) {
            return None;
        }
        let result = offer.publisher.publish(&message.data);
        let subscribers = offer.publisher.subscriber_count();
        offer.summary.most_subscribers = offer.summary.most_subscribers.max(subscribers);
        match &result {
            Ok(()) => offer.summary.published += 1,
            Err(_) => offer.summary.failed += 1,
        }
        Some(result)
    }

    pub(super) fn count_failed(&mut self, topic: &str) {
        if let Some(offer) = self.0.get_mut(topic) {
            offer.summary.failed += 1;
        }
    }

    pub(super) fn count_late(&mut self, topic: &str, late_s: f64) {
        if let Some(offer) = self.0.get_mut(topic) {
            offer.summary.late += 1;
            offer.summary.worst_late_s = offer.summary.worst_late_s.max(late_s);
        }
    }

    /// The publisher of a topic, by its absolute published name.
    pub(super) fn publisher(&self, published_name: &str) -> Option<&RawPublisher> {
        self.0.values().map(|offer| &offer.publisher).find(|one| one.topic() == published_name)
    }

    /// The published names of the topics.
    pub(super) fn published_names(&self) -> Vec<&str> {
        self.0.values().map(|offer| offer.publisher.topic()).collect()
    }

    /// The counts of published messages; ends the publishers.
    pub(super) fn into_summaries(self) -> Vec<TopicSummary> {
        self.0.into_values().map(|offer| offer.summary).collect()
    }
}

/// The QoS of a publisher: as recorded, else by type and name.
fn qos_of(topic: &TopicInfo) -> Qos {
    let mut offered = topic.qos.unwrap_or_else(|| default_qos(&topic.topic, &topic.type_name));
    if last_part(&topic.topic) == FIXED_TRANSFORMS {
        offered.reliability = Reliability::Reliable;
        offered.durability = Durability::TransientLocal;
    }
    let latched = offered.durability == Durability::TransientLocal;
    let kept = if latched { topic.message_count.min(MOST_LATCHED) } else { 0 };
    let depth = match offered.depth {
        Some(depth) => u64::from(depth).max(kept),
        None => KEEP_ALL_DEPTH,
    };
    Qos::new(
        offered.reliability == Reliability::Reliable,
        latched,
        usize::try_from(depth).unwrap_or(usize::MAX),
    )
}

/// How many of the last messages of a latched topic are what a later subscriber has. The transforms of all messages
/// hold, those of each broadcaster in one of its own.
fn last_latched(topic: &TopicInfo, offered: &Qos) -> usize {
    if last_part(&topic.topic) == FIXED_TRANSFORMS {
        return offered.depth();
    }
    let recorded = topic.qos.and_then(|qos| qos.depth).map_or(1, |depth| depth.max(1));
    offered.depth().min(usize::try_from(recorded).unwrap_or(usize::MAX))
}

fn default_qos(topic: &str, type_name: &str) -> OfferedQos {
    let type_name = full_type_name(type_name);
    if LATCHED_TOPICS.contains(&last_part(topic)) || type_name == LATCHED_TYPE {
        OfferedQos::latched()
    } else if LARGE_TYPES.contains(&type_name.as_str()) {
        OfferedQos::sensor(SENSOR_DEPTH)
    } else {
        OfferedQos::reliable(DEFAULT_DEPTH)
    }
}

fn last_part(topic: &str) -> &str {
    topic.rsplit('/').next().unwrap_or(topic)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn topic(name: &str, type_name: &str, qos: Option<OfferedQos>) -> TopicInfo {
        TopicInfo {
            topic: name.into(),
            type_name: type_name.into(),
            definition: None,
            type_hash: None,
            encoding: "cdr".into(),
            message_count: 3,
            rate_hz: None,
            qos,
        }
    }

    #[test]
    fn what_was_recorded_is_offered() {
        let image = "sensor_msgs/msg/Image";
        let recorded = topic("/image", image, Some(OfferedQos::reliable(7)));
        assert_eq!(qos_of(&recorded), Qos::reliable(7));
        let everything = OfferedQos { depth: None, ..OfferedQos::reliable(1) };
        assert_eq!(qos_of(&topic("/a", image, Some(everything))), Qos::reliable(1000));
    }

    #[test]
    fn without_a_record_type_and_name_decide() {
        assert_eq!(qos_of(&topic("/i", "sensor_msgs/Image", None)), Qos::sensor(5));
        assert_eq!(qos_of(&topic("/scan", "sensor_msgs/msg/LaserScan", None)), Qos::reliable(10));
    }

    #[test]
    fn fixed_transforms_are_latched_whatever_the_bag_says() {
        for recorded in [OfferedQos::reliable(7), OfferedQos::sensor(7)] {
            let tf = |name| qos_of(&topic(name, "tf2_msgs/msg/TFMessage", Some(recorded)));
            assert_eq!(tf("/robot/tf_static"), Qos::new(true, true, 7));
            assert_ne!(tf("/robot/tf"), Qos::new(true, true, 7));
        }
    }

    #[test]
    fn a_latched_topic_keeps_all_of_its_publishers() {
        let expected = Qos::new(true, true, 3);
        assert_eq!(qos_of(&topic("/tf_static", "tf2_msgs/msg/TFMessage", None)), expected);
        assert_eq!(qos_of(&topic("/grid", "nav_msgs/msg/OccupancyGrid", None)), expected);
    }
}
