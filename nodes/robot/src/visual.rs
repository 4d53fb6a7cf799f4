//! The pose node in this process: it gets the messages of a bag, and its poses are collected.

mod lost;
mod recording_end;
mod topics;
mod trajectory_file;
mod without_pose;

use std::cell::Cell;
use std::path::Path;

use bag_player::{BagError, BagMessage};
use msgs::convert::stamp_from_time;
use msgs::geometry_msgs::PoseStamped;
use msgs::nav_msgs::Odometry;
use msgs::sensor_msgs::{CameraInfo, CompressedImage, Image, Imu};
use msgs::std_msgs::Header;
use msgs::stillmap_msgs::StageReport;
use node_shell::{Node, NodeFailure, PublishError, Publisher, Qos};
use pose::shell::{ImageInput, PoseParameters, Stage};

pub(crate) use self::lost::LostSpan;
use self::recording_end::RecordingEnd;
pub(crate) use self::without_pose::{DropsOfCause, WithoutPose};
use crate::pose_listener::PoseListener;
use crate::run::view_topics::DepthImageError;
pub use topics::{VisualTopicArgs, VisualTopics, depth_info_topic, depth_topic};
pub(crate) use trajectory_file::write_trajectory;

/// The name of the node and of its parameters' section.
pub(crate) const NODE: &str = "pose";
/// The value of `--pose` that selects this node instead of a topic.
pub(crate) const VISUAL: &str = "visual";

/// The pose node, with the publishers of its input and the subscriptions to its output.
pub(crate) struct VisualOdometry {
    stage: Stage,
    listener: PoseListener,
    topics: VisualTopics,
    images: Publisher<Image>,
    compressed: Publisher<CompressedImage>,
    camera_infos: Publisher<CameraInfo>,
    imu: Publisher<Imu>,
    wheels: Publisher<Odometry>,
    without_pose: WithoutPose,
    end: Cell<RecordingEnd>,
}

/// Why a message of the bag could not be passed to a node.
#[derive(Debug, thiserror::Error)]
pub(crate) enum FeedError {
    #[error(transparent)]
    Bag(#[from] BagError),
    #[error(transparent)]
    Publish(#[from] PublishError),
    #[error(transparent)]
    Depth(#[from] DepthImageError),
}

impl FeedError {
    /// Why, without the topic and the time of the message: the same for all that are damaged in the same way.
    pub(crate) fn reason(&self) -> String {
        match self {
            Self::Bag(BagError::Decode { source, .. }) => source.to_string(),
            other => other.to_string(),
        }
    }
}

impl VisualOdometry {
    /// The pose node on `node`; `beside` publishes its input and subscribes to its output. Both have the topics' names of [`VisualTopics::by_node_name`].
    pub(crate) fn new(
        node: &Node,
        beside: &Node,
        topics: VisualTopics,
        parameters: &PoseParameters,
    ) -> Result<Self, NodeFailure> {
        let input = if topics.is_compressed { ImageInput::Compressed } else { ImageInput::Raw };
        let parameters = PoseParameters { input, ..parameters.clone() };
        let qos = Qos::sensor(1);
        Ok(Self {
            stage: Stage::new(node, &parameters)?,
            listener: PoseListener::new(node, NODE, beside)?,
            images: beside.publisher("rgb/image", &qos)?,
            compressed: beside.publisher("rgb/image/compressed", &qos)?,
            camera_infos: beside.publisher("rgb/camera_info", &qos)?,
            imu: beside.publisher("imu", &qos)?,
            wheels: beside.publisher("wheels", &qos)?,
            topics,
            without_pose: WithoutPose::default(),
            end: Cell::default(),
        })
    }

    /// Passes a message of the bag to the node, if it is on one of its topics other than the depth images.
    pub(crate) fn feed(&self, message: &BagMessage) -> Result<(), FeedError> {
        let topic = &*message.topic;
        if topic == self.topics.image {
            if self.topics.is_compressed {
                let image = message.decode::<CompressedImage>()?;
                if self.is_of_the_recording(&image.header) {
                    self.compressed.publish(image)?;
                }
            } else {
                let image = message.decode::<Image>()?;
                if self.is_of_the_recording(&image.header) {
                    self.images.publish(image)?;
                }
            }
        }
        if topic == self.topics.camera_info {
            self.camera_infos.publish(message.decode::<CameraInfo>()?)?;
        }
        // The node subscribes to these two only if its parameters say so.
        if self.topics.imu.as_deref() == Some(topic) && self.imu.subscriber_count() > 0 {
            self.imu.publish(message.decode::<Imu>()?)?;
        }
        if self.topics.wheels.as_deref() == Some(topic) && self.wheels.subscriber_count() > 0 {
            self.wheels.publish(message.decode::<Odometry>()?)?;
        }
        Ok(())
    }

    fn is_of_the_recording(&self, header: &Header) -> bool {
        let mut end = self.end.get();
        let is_of_it = end.admits(stamp_from_time(header.stamp));
        self.end.set(end);
        is_of_it
    }

    /// Lets the node process the waiting messages, and receives its output.
    pub(crate) fn flow(&mut self) {
        self.stage.take_waiting();
        self.listener.receive();
        self.without_pose.note(self.listener.reports(), self.listener.drops());
    }

    /// Whether the recording has ended: later images are of another one.
    pub(crate) fn has_ended(&self) -> bool {
        self.end.get().gone_back_s().is_some()
    }

    /// What is lost of a recording whose time goes back.
    pub(crate) fn lost_after_the_end(&self) -> Option<String> {
        let end = self.end.get();
        let (poses, left_out) = (self.poses().len(), end.left_out());
        end.gone_back_s().map(|back_s| {
            format!(
                "the stamps of the images go back by {back_s:.1} s after {poses} poses: the drive ends there, {left_out} images of another time \
                 are left out"
            )
        })
    }

    /// What a run has lost with the poses that are missing, and how often.
    pub(crate) fn losses(&self) -> Vec<(String, u64)> {
        let mut losses = self.without_pose.losses();
        losses.extend(self.lost_after_the_end().map(|lost| (lost, self.end.get().left_out())));
        losses
    }

    /// Why the depth images may be another camera's.
    pub(crate) fn registration_doubt(&self) -> Option<&str> {
        self.stage.registration_doubt()
    }

    /// The poses so far.
    pub(crate) fn poses(&self) -> &[PoseStamped] {
        self.listener.poses()
    }

    /// The poses as the map has them now; `None` without a map.
    pub(crate) fn trajectory(&self) -> Option<Vec<PoseStamped>> {
        let poses = self.stage.trajectory()?;
        Some(poses.iter().map(msgs::convert::message_from_pose).collect())
    }

    /// Saves the map of keyframes. Returns what was done.
    pub(crate) fn save_map(&self, path: &Path) -> Result<String, NodeFailure> {
        self.stage.save_map_to(path)
    }

    /// The node's report of each pair of images.
    pub(crate) fn reports(&self) -> &[StageReport] {
        self.listener.reports()
    }

    /// Which images have no pose, and why.
    pub(crate) fn without_pose(&self) -> &WithoutPose {
        &self.without_pose
    }
}
