//! Which topics of a bag the pipeline reads.

mod chooser;

use bag_player::BagInfo;
use clap::Args;
use detection::shell::{DetectionParameters, PoseInput};
use msgs::RosMessage;
use msgs::sensor_msgs::Image;

use self::chooser::Chooser;
use super::colour_topics::ColourTopics;
use super::pose_topics::PoseSource;
use super::view_topics::COMPRESSED_DEPTH;
pub use super::view_topics::ViewTopics;
use crate::failure::Failure;
use crate::lidar::{LIDAR, LidarArgs};
use crate::offer::Offer;
use crate::sensor_bag;
use crate::visual::VisualTopicArgs;

/// Topics that the user names; the rest is found by type.
#[derive(Args, Debug, Default)]
pub struct TopicArgs {
    /// The LaserScan topic, where the bag has several
    #[arg(long, value_name = "TOPIC")]
    pub scan: Option<String>,
    /// The depth image topic (16UC1 or 32FC1), or that of compressed ones (.../compressedDepth)
    #[arg(long, value_name = "TOPIC")]
    pub depth: Option<String>,
    /// The CameraInfo topic of the depth image
    #[arg(long, value_name = "TOPIC")]
    pub camera_info: Option<String>,
    /// A PointCloud2 topic, to be read in place of a depth image
    #[arg(long, value_name = "TOPIC", conflicts_with_all = ["depth", "camera_info"])]
    pub points: Option<String>,
    /// The topic of the rig's poses (PoseStamped, Odometry or PoseWithCovarianceStamped); or `tf`: the robot in the map by /tf; or
    /// `visual`: visual odometry from the colour and depth images; or `lidar`: odometry from the scans of a 3D LiDAR
    #[arg(long, value_name = "TOPIC")]
    pub pose: Option<String>,
    #[command(flatten)]
    visual: VisualTopicArgs,
    #[command(flatten)]
    lidar: LidarArgs,
}

impl TopicArgs {
    /// Whether no topic is named.
    pub(crate) fn is_empty(&self) -> bool {
        let Self { scan, depth, camera_info, points, pose, visual, lidar } = self;
        [scan, depth, camera_info, points, pose].into_iter().all(Option::is_none)
            && visual.is_empty()
            && lidar.is_empty()
    }

    /// The options that name topics of other sensors than a LiDAR.
    pub(super) fn of_other_sensors(&self) -> Vec<&'static str> {
        let Self { scan, depth, camera_info, points, pose: _, visual, lidar: _ } = self;
        let named = [
            (scan.is_some(), "--scan"),
            (depth.is_some(), "--depth"),
            (camera_info.is_some(), "--camera-info"),
            (points.is_some(), "--points"),
            (!visual.is_empty(), "--image"),
        ];
        named.into_iter().filter_map(|(is_given, name)| is_given.then_some(name)).collect()
    }

    /// What the user names of the colour camera.
    pub(super) fn visual(&self) -> &VisualTopicArgs {
        &self.visual
    }

    /// Whether the pose is to be a LiDAR's.
    pub(crate) fn wants_lidar(&self) -> bool {
        self.pose.as_deref() == Some(LIDAR)
    }

    /// Whether nothing is said of the pose.
    pub(crate) fn has_no_pose(&self) -> bool {
        self.pose.is_none()
    }

    /// What the user names of the LiDAR.
    pub(crate) fn lidar(&self) -> &LidarArgs {
        &self.lidar
    }
}

/// The topics that a run reads.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Inputs {
    pub(crate) scan: String,
    /// The depth images or the clouds.
    pub view: ViewTopics,
    pub(crate) pose: PoseSource,
    /// The colour camera of the map, where it has one.
    pub(crate) colour: Option<ColourTopics>,
    /// The topic of true labels, where the bag has it.
    pub labels: Option<String>,
    /// The topics of tf that the bag has, static transforms first; empty if no node uses tf.
    pub(crate) transforms: Vec<&'static str>,
}

/// The topics of tf, the same in every bag.
pub(crate) const TF_STATIC: &str = "/tf_static";
pub(crate) const TF: &str = "/tf";

/// The scans of scanners that report several returns of a beam, which are not read.
pub(crate) const MULTI_ECHO: &str = "sensor_msgs/msg/MultiEchoLaserScan";

impl Inputs {
    /// Chooses the topics of a bag: those that the user named, else the only one of its type, else the
    /// one with the usual name. Poses are of the kind that `detection` asks for, if the bag has it, or else of another.
    pub(crate) fn choose(
        args: &TopicArgs,
        info: &BagInfo,
        detection: &DetectionParameters,
    ) -> Result<Self, Failure> {
        let offer = Offer::of_bag(info);
        let is_it = |topic: &str, type_name| {
            topic == sensor_bag::TRUE_LABELS && type_name == Image::TYPE_NAME
        };
        let labels = info.topics.iter().find(|topic| is_it(&topic.topic, &topic.type_name));
        let labels = labels.map(|topic| topic.topic.clone());
        Ok(Self { labels, ..Self::choose_from(args, &offer, detection.pose_source)? })
    }

    /// The same among topics of a bag or of the live graph, poses of the preferred kind before others.
    pub(crate) fn choose_from(
        args: &TopicArgs,
        offer: &Offer<'_>,
        preferred: PoseInput,
    ) -> Result<Self, Failure> {
        let choose = Chooser { offer };
        let scan = choose.scan(args)?;
        let view = choose.chosen_view(args)?;
        let pose = choose.pose(args, &view, preferred)?;
        let transforms = [TF_STATIC, TF].into_iter().filter(|name| choose.has_tf(name)).collect();
        Ok(Self { scan, view, pose, colour: None, labels: None, transforms })
    }

    /// The colour camera, where its messages are passed on for the map alone: the visual odometry passes on its own.
    pub(crate) fn colour_of_map(&self) -> Option<&ColourTopics> {
        self.colour.as_ref().filter(|_| !matches!(self.pose, PoseSource::Visual(_)))
    }

    /// Whether the rig's poses come from the bag. Otherwise the run computes them, in a frame whose origin is the first camera.
    #[must_use]
    pub fn has_poses_of_bag(&self) -> bool {
        !matches!(self.pose, PoseSource::Visual(_))
    }

    /// The same without the topics that no node uses with these parameters.
    pub(crate) fn needed_by(self, detection: &DetectionParameters) -> Self {
        if detection.needs_tf() { self } else { Self { transforms: Vec::new(), ..self } }
    }

    /// Whether a node subscribes to a topic of the bag.
    pub(crate) fn is_of(&self, topic: &str) -> bool {
        self.transforms.contains(&topic)
            || self.by_node_name().into_iter().any(|(_, known)| known == topic)
    }

    /// The sensors' topics that the nodes subscribe to, each with the name that the node knows it by.
    pub(crate) fn by_node_name(&self) -> Vec<(&'static str, &str)> {
        let mut topics = vec![("scan", self.scan.as_str())];
        match &self.pose {
            PoseSource::Topic { topic, kind } => topics.push((kind.node_name(), topic)),
            PoseSource::Tf => {}
            PoseSource::Visual(visual) => topics.extend(visual.by_node_name()),
        }
        match &self.view {
            ViewTopics::Depth { image, camera_info } => {
                let is_compressed = self.view.is_compressed();
                topics.push((if is_compressed { COMPRESSED_DEPTH } else { "depth/image" }, image));
                topics.push(("depth/camera_info", camera_info));
            }
            ViewTopics::Points(points) => topics.push(("points", points)),
        }
        for (name, topic) in self.colour.iter().flat_map(ColourTopics::by_node_name) {
            // The visual odometry has the same ones.
            if !topics.iter().any(|(known, _)| *known == name) {
                topics.push((name, topic));
            }
        }
        topics
    }
}

/// Where the points of a bag come from.
pub(crate) fn view_of(info: &BagInfo, topics: &TopicArgs) -> Result<ViewTopics, Failure> {
    Chooser { offer: &Offer::of_bag(info) }.chosen_view(topics)
}

#[cfg(test)]
mod tests;
