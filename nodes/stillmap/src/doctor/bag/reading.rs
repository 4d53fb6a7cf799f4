//! Reads a bag once, and keeps of each message its stamp and its size.

use std::collections::BTreeMap;

use bag_player::{Bag, BagError, BagInfo, BagMessage, Loss, Selection};
use geometry::Stamp;
use msgs::RosMessage;
use msgs::convert::{self, ConvertError, stamp_from_time};
use msgs::geometry_msgs::PoseStamped;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, LaserScan, PointCloud2};
use msgs::std_msgs::Header;

use crate::failure::Failure;
use crate::progress::Progress;
use crate::run::inputs::{Inputs, TopicArgs, ViewTopics};

/// What is known of a bag.
pub(super) struct BagFacts {
    pub(super) info: BagInfo,
    /// What `stillmap run` would read; or why it would not.
    pub(super) choice: Result<Inputs, Failure>,
    /// The topics whose messages the suite understands.
    pub(super) topics: BTreeMap<String, TopicFacts>,
    pub(super) losses: Vec<Loss>,
}

/// What is known of a topic.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct TopicFacts {
    pub(super) type_name: String,
    /// Whether `stillmap run` would read it.
    pub(super) is_chosen: bool,
    /// The stamps of its messages, in the order in which they were recorded.
    pub(super) stamps: Vec<Stamp>,
    pub(super) messages: u64,
    pub(super) largest_bytes: usize,
    /// Messages that cannot be used.
    pub(super) unusable: u64,
    /// Why the first of them cannot.
    pub(super) first_reason: Option<String>,
}

impl BagFacts {
    pub(super) fn read(bag: &Bag, topics: &TopicArgs) -> Result<Self, Failure> {
        let fail = |error: BagError| Failure::new(error.to_string());
        let info = bag.info().map_err(fail)?;
        let choice = Inputs::choose(topics, &info);
        let mut facts: BTreeMap<String, TopicFacts> = info
            .topics
            .iter()
            .filter(|topic| reader_of(&topic.type_name).is_some() && !is_truth(&topic.topic))
            .map(|topic| {
                let is_chosen = choice.as_ref().is_ok_and(|inputs| {
                    inputs.by_node_name().iter().any(|(_, chosen)| *chosen == topic.topic)
                });
                let facts = TopicFacts {
                    type_name: topic.type_name.clone(),
                    is_chosen,
                    stamps: Vec::new(),
                    messages: 0,
                    largest_bytes: 0,
                    unusable: 0,
                    first_reason: None,
                };
                (topic.topic.clone(), facts)
            })
            .collect();
        let progress = Progress::new("reading", info.message_count);
        // All topics: a chunk that is not read is not seen to be damaged.
        let mut messages = bag.messages(&Selection::default()).map_err(fail)?;
        for message in messages.by_ref() {
            let message = message.map_err(fail)?;
            progress.advance();
            if let Some(facts) = facts.get_mut(&*message.topic) {
                facts.take(&message);
            }
        }
        progress.finish();
        Ok(Self { info, choice, topics: facts, losses: messages.losses().to_vec() })
    }

    /// The topics that a run would read: scans, view, poses.
    pub(super) fn chosen(&self) -> Option<(&TopicFacts, &TopicFacts, &TopicFacts)> {
        let inputs = self.choice.as_ref().ok()?;
        let view = match &inputs.view {
            ViewTopics::Depth { image, .. } => image,
            ViewTopics::Points(points) => points,
        };
        Some((
            self.topics.get(&inputs.scan)?,
            self.topics.get(view)?,
            self.topics.get(inputs.pose.topic()?)?,
        ))
    }
}

/// The truth is no input.
fn is_truth(topic: &str) -> bool {
    topic.starts_with("/truth/")
}

impl TopicFacts {
    fn take(&mut self, message: &BagMessage) {
        self.messages += 1;
        self.largest_bytes = self.largest_bytes.max(message.data.len());
        let Some(reader) = reader_of(&self.type_name) else { return };
        match reader(message, self.is_chosen) {
            Ok(stamp) => self.stamps.push(stamp),
            Err(reason) => {
                self.unusable += 1;
                self.first_reason.get_or_insert(reason);
            }
        }
    }

    /// The stamps in their order, and how many of them came behind a later one.
    pub(super) fn sorted_stamps(&self) -> (Vec<Stamp>, usize) {
        let late = self.stamps.windows(2).filter(|pair| pair[1] < pair[0]).count();
        let mut sorted = self.stamps.clone();
        sorted.sort_unstable();
        (sorted, late)
    }
}

/// Reads the stamp of a message, and, where it is to be used, sees whether it can be.
type Reader = fn(&BagMessage, bool) -> Result<Stamp, String>;

/// The reader of messages of a type; none for types that the suite does not read.
fn reader_of(type_name: &str) -> Option<Reader> {
    let reader: Reader = match type_name {
        LaserScan::TYPE_NAME => |message, used| {
            read(message, used, |one: &LaserScan| &one.header, convert::scan_from_message)
        },
        PoseStamped::TYPE_NAME => |message, used| {
            read(message, used, |one: &PoseStamped| &one.header, convert::pose_from_message)
        },
        Image::TYPE_NAME => |message, used| {
            read(message, used, |one: &Image| &one.header, convert::depth_from_message)
        },
        CameraInfo::TYPE_NAME => |message, used| {
            read(message, used, |one: &CameraInfo| &one.header, convert::camera_from_message)
        },
        PointCloud2::TYPE_NAME => |message, used| {
            read(message, used, |one: &PointCloud2| &one.header, convert::cloud_from_message)
        },
        CompressedImage::TYPE_NAME => |message, used| {
            read(message, used, |one: &CompressedImage| &one.header, |_| Ok::<_, ConvertError>(()))
        },
        _ => return None,
    };
    Some(reader)
}

fn read<M: RosMessage, T>(
    message: &BagMessage,
    is_used: bool,
    header: fn(&M) -> &Header,
    convert: fn(&M) -> Result<T, ConvertError>,
) -> Result<Stamp, String> {
    let decoded: M = message.decode().map_err(|error| error.to_string())?;
    if is_used {
        convert(&decoded).map_err(|error| error.to_string())?;
    }
    Ok(stamp_from_time(header(&decoded).stamp))
}
