//! Where a bag has the poses of the rig.

use bag_player::BagMessage;
use detection::shell::PoseInput;
use geometry::StampedPose;
use msgs::RosMessage;
use msgs::convert;
use msgs::geometry_msgs::{PoseStamped, PoseWithCovarianceStamped};
use msgs::nav_msgs::Odometry;

use crate::visual::VisualTopics;

/// The value of `--pose` for poses by tf.
pub(crate) const BY_TF: &str = "tf";

/// Where the rig's pose comes from.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum PoseSource {
    /// A topic of the bag.
    Topic {
        /// The topic.
        topic: String,
        /// What is on it.
        kind: PoseTopicKind,
    },
    /// The transforms of the bag.
    Tf,
    /// Visual odometry.
    Visual(VisualTopics),
}

impl PoseSource {
    /// The topic of the bag, if the poses come from one.
    pub(crate) fn topic(&self) -> Option<&str> {
        match self {
            Self::Topic { topic, .. } => Some(topic),
            Self::Tf | Self::Visual(_) => None,
        }
    }

    /// The value of detection's parameter `pose_source`.
    pub(crate) fn input(&self) -> PoseInput {
        match self {
            Self::Topic { kind, .. } => kind.input(),
            Self::Tf => PoseInput::Tf,
            // The pose node's.
            Self::Visual(_) => PoseInput::Pose,
        }
    }

    /// What the poses are read from, for a reader.
    pub(crate) fn name(&self) -> &str {
        match self {
            Self::Topic { topic, .. } => topic,
            Self::Tf => "/tf",
            Self::Visual(_) => "visual odometry",
        }
    }
}

/// Messages that have the pose of the rig.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum PoseTopicKind {
    Pose,
    Odometry,
    PoseWithCovariance,
}

impl PoseTopicKind {
    /// All of them, in the order of preference.
    pub(crate) const ALL: [Self; 3] = [Self::Pose, Self::Odometry, Self::PoseWithCovariance];

    /// The type of the messages.
    pub(crate) fn type_name(self) -> &'static str {
        match self {
            Self::Pose => PoseStamped::TYPE_NAME,
            Self::Odometry => Odometry::TYPE_NAME,
            Self::PoseWithCovariance => PoseWithCovarianceStamped::TYPE_NAME,
        }
    }

    /// The name of detection's topic.
    pub(crate) fn node_name(self) -> &'static str {
        match self {
            Self::Pose => "pose",
            Self::Odometry => "odom",
            Self::PoseWithCovariance => "pose_with_covariance",
        }
    }

    /// The value of detection's parameter `pose_source`.
    pub(crate) fn input(self) -> PoseInput {
        match self {
            Self::Pose => PoseInput::Pose,
            Self::Odometry => PoseInput::Odometry,
            Self::PoseWithCovariance => PoseInput::PoseWithCovariance,
        }
    }

    /// The pose in a message of this kind; `None` where the message cannot be read, or has none.
    pub(crate) fn read(self, message: &BagMessage) -> Option<StampedPose> {
        match self {
            Self::Pose => convert::pose_from_message(&message.decode().ok()?).ok(),
            Self::Odometry => convert::pose_from_odometry(&message.decode().ok()?).ok(),
            Self::PoseWithCovariance => {
                convert::pose_from_covariance_message(&message.decode().ok()?).ok()
            }
        }
    }
}
