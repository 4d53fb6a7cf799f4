//! Reads a bag once, and keeps of each message its stamp and its size.

use std::collections::BTreeMap;

use bag_player::{Bag, BagError, BagInfo, BagMessage, Loss, Selection};
use detection::shell::DetectionParameters;
use geometry::Stamp;
use msgs::RosMessage;
use msgs::geometry_msgs::PoseStamped;
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, Imu, LaserScan, PointCloud2};
use msgs::tf2_msgs::TFMessage;

use crate::doctor::content::{Content, Observed, TransformFacts, Typical};
use crate::failure::Failure;
use crate::import::AddedScans;
use crate::progress::Progress;
use crate::run::inputs::{Inputs, TF_STATIC, TopicArgs, ViewTopics};

/// Frames with a fixed transform beyond this many are not looked at.
const MOST_FRAMES: usize = 4096;

/// What is known of a bag.
pub(super) struct BagFacts {
    pub(super) info: BagInfo,
    /// The topics that `stillmap run` would read; or why it would refuse the bag.
    pub(super) choice: Result<Inputs, Failure>,
    /// Whether it would cut the scans out of the depth images.
    pub(super) cuts_scans: bool,
    /// The topics whose messages the suite understands.
    pub(super) topics: BTreeMap<String, TopicFacts>,
    /// What was recorded of tf.
    pub(super) transforms: TransformFacts,
    /// When the first fixed transform of each frame was recorded.
    pub(super) fixed_since: BTreeMap<String, Stamp>,
    /// When the first message of each topic was recorded that a run would read.
    pub(super) begun: BTreeMap<String, Stamp>,
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
    /// Why the first of them cannot be used.
    pub(super) first_reason: Option<String>,
    /// From the stamp to the arrival at the recorder.
    pub(super) delay_s: Typical,
    /// The content of the messages.
    pub(super) content: Content,
}

impl BagFacts {
    pub(super) fn read(
        bag: &Bag,
        topics: &TopicArgs,
        parameters: &DetectionParameters,
    ) -> Result<Self, Failure> {
        let fail = |error: BagError| Failure::new(error.to_string());
        let info = bag.info().map_err(fail)?;
        let added_scans = AddedScans::where_needed(topics, (bag, &info)).ok().flatten();
        let with_scans = added_scans.map(|added| added.listed_in(info.clone()));
        let choice = Inputs::choose(topics, with_scans.as_ref().unwrap_or(&info), parameters);
        let mut facts: BTreeMap<String, TopicFacts> = info
            .topics
            .iter()
            .filter(|topic| reader_of(&topic.type_name).is_some() && !is_truth(&topic.topic))
            .map(|topic| {
                let is_chosen = choice.as_ref().is_ok_and(|inputs| {
                    inputs.by_node_name().iter().any(|(_, chosen)| *chosen == topic.topic)
                });
                (topic.topic.clone(), TopicFacts::new(&topic.type_name, is_chosen))
            })
            .collect();
        let progress = Progress::new("reading", info.message_count);
        // All topics: damage in a chunk is found only if the chunk is read.
        let mut messages = bag.messages(&Selection::default()).map_err(fail)?;
        let mut transforms = TransformFacts::default();
        let (mut fixed_since, mut begun) = (BTreeMap::new(), BTreeMap::new());
        for message in messages.by_ref() {
            let message = message.map_err(fail)?;
            progress.advance();
            if let Some(facts) = facts.get_mut(&*message.topic) {
                facts.take(&message);
                if facts.is_chosen && !begun.contains_key(&*message.topic) {
                    begun.insert(message.topic.to_string(), message.log_time);
                }
            } else if let Ok(tf) = message.decode::<TFMessage>() {
                let is_fixed = *message.topic == *TF_STATIC;
                for transform in tf.transforms.iter().filter(|_| is_fixed) {
                    let frame = transform.child_frame_id.trim_start_matches('/');
                    if fixed_since.len() < MOST_FRAMES {
                        fixed_since.entry(frame.to_owned()).or_insert(message.log_time);
                    }
                }
                transforms.take(&tf, is_fixed);
            }
        }
        progress.finish();
        let losses = messages.losses().to_vec();
        Ok(Self {
            info,
            choice,
            cuts_scans: with_scans.is_some(),
            topics: facts,
            transforms,
            fixed_since,
            begun,
            losses,
        })
    }

    /// The topics that a run would read; `None` where it would read none.
    pub(super) fn chosen(&self) -> Option<Chosen<'_>> {
        let inputs = self.choice.as_ref().ok()?;
        let view = match &inputs.view {
            ViewTopics::Depth { image, .. } => image,
            ViewTopics::Points(points) => points,
        };
        let poses = match inputs.pose.topic() {
            Some(topic) => Some(self.topics.get(topic)?),
            None => None,
        };
        Some(Chosen { scans: self.topics.get(&inputs.scan), view: self.topics.get(view)?, poses })
    }
}

/// The topics of a run that are compared.
pub(super) struct Chosen<'a> {
    /// None where the scans are cut out of the images.
    pub(super) scans: Option<&'a TopicFacts>,
    pub(super) view: &'a TopicFacts,
    /// None where they are not on a topic: by tf, or computed.
    pub(super) poses: Option<&'a TopicFacts>,
}

/// Ground truth is no input.
fn is_truth(topic: &str) -> bool {
    topic.starts_with("/truth/")
}

impl TopicFacts {
    /// Empty, for messages of a type.
    pub(super) fn new(type_name: &str, is_chosen: bool) -> Self {
        Self {
            type_name: type_name.to_owned(),
            is_chosen,
            stamps: Vec::new(),
            messages: 0,
            largest_bytes: 0,
            unusable: 0,
            first_reason: None,
            delay_s: Typical::default(),
            content: Content::of_type(type_name),
        }
    }

    fn take(&mut self, message: &BagMessage) {
        self.messages += 1;
        self.largest_bytes = self.largest_bytes.max(message.data.len());
        let Some(reader) = reader_of(&self.type_name) else { return };
        match reader(message, self.is_chosen, &mut self.content) {
            Ok(read) => {
                self.delay_s.add(message.log_time.seconds_since(read.stamp));
                self.stamps.push(read.stamp);
                if let Some(reason) = read.useless {
                    self.unusable += 1;
                    self.first_reason.get_or_insert(reason);
                }
            }
            Err(reason) => {
                self.unusable += 1;
                self.first_reason.get_or_insert(reason);
            }
        }
    }

    /// The stamps in their order.
    pub(super) fn sorted_stamps(&self) -> Vec<Stamp> {
        let mut sorted = self.stamps.clone();
        sorted.sort_unstable();
        sorted
    }
}

/// What was read of a message.
struct ReadMessage {
    stamp: Stamp,
    /// Why it cannot be used, where it is to be.
    useless: Option<String>,
}

/// Reads a message, and, where it is to be used, sees whether it can be.
type Reader = fn(&BagMessage, bool, &mut Content) -> Result<ReadMessage, String>;

/// The reader of messages of a type; none for types that the suite does not read.
fn reader_of(type_name: &str) -> Option<Reader> {
    Some(match type_name {
        LaserScan::TYPE_NAME => read::<LaserScan>,
        PoseStamped::TYPE_NAME => read::<PoseStamped>,
        Odometry::TYPE_NAME => read::<Odometry>,
        Image::TYPE_NAME => read::<Image>,
        CompressedImage::TYPE_NAME => read::<CompressedImage>,
        CameraInfo::TYPE_NAME => read::<CameraInfo>,
        PointCloud2::TYPE_NAME => read::<PointCloud2>,
        Imu::TYPE_NAME => read::<Imu>,
        _ => return None,
    })
}

fn read<M: Observed>(
    message: &BagMessage,
    is_used: bool,
    content: &mut Content,
) -> Result<ReadMessage, String> {
    let decoded: M = message.decode().map_err(|error| error.to_string())?;
    let stamp = content.take(&decoded);
    let useless = if is_used { decoded.check().err() } else { None };
    Ok(ReadMessage { stamp, useless: useless.map(|error| error.to_string()) })
}
