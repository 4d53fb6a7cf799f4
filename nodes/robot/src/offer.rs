//! The topics that inputs are chosen from: those of a bag, or of the live graph.

use std::collections::BTreeSet;

use bag_player::{BagInfo, TopicInfo};
use msgs::RosMessage;
use msgs::sensor_msgs::{CompressedImage, Image, PointCloud2};
use msgs::tf2_msgs::TFMessage;
use msgs::velodyne_msgs::VelodyneScan;

use crate::run::PoseTopicKind;

const GRAPH: &str = "the graph";
/// A robot's poses come at least so often, RTAB-Map's and slam_toolbox's at 1 Hz and more; goals and first guesses do not.
pub(crate) const LEAST_POSES_HZ: f64 = 1.0;

/// The truth of a simulation.
const TRUTH: &str = "/truth/";
/// The encoding of messages of ROS 1 in MCAP.
const ROS1: &str = "ros1";

/// One topic of an offer.
#[derive(Clone, Copy, Debug)]
struct Offered<'a> {
    topic: &'a str,
    type_name: &'a str,
    /// The encoding of its messages, where it is none that is read.
    unread_encoding: Option<&'a str>,
    is_empty: bool,
    /// Whether it has poses that are no robot's: they come once in a while, and others often.
    is_goal: bool,
}

/// Topics with their types.
#[derive(Clone, Debug)]
pub struct Offer<'a> {
    /// Where the topics are, for a reader.
    place: &'static str,
    /// How to see all of them.
    listed_by: &'static str,
    topics: Vec<Offered<'a>>,
}

impl<'a> Offer<'a> {
    /// The topics of a bag. Those without messages are none to choose, unless they are named.
    #[must_use]
    pub fn of_bag(info: &'a BagInfo) -> Self {
        let is_pose = |topic: &TopicInfo| {
            PoseTopicKind::ALL.iter().any(|kind| kind.type_name() == topic.type_name)
        };
        let is_often = |topic: &TopicInfo| topic.rate_hz.is_some_and(|hz| hz >= LEAST_POSES_HZ);
        let is_truth = |topic: &TopicInfo| topic.topic.starts_with(TRUTH);
        let places = |topic: &TopicInfo| {
            is_often(topic)
                && !is_truth(topic)
                && (is_pose(topic) || topic.type_name == TFMessage::TYPE_NAME)
        };
        let has_poses = info.topics.iter().any(places);
        let offered = |topic: &'a TopicInfo| Offered {
            topic: &topic.topic,
            type_name: &topic.type_name,
            unread_encoding: (!topic.is_playable()).then_some(&topic.encoding),
            is_empty: topic.message_count == 0,
            is_goal: has_poses && is_pose(topic) && !is_often(topic),
        };
        Self {
            place: "the bag",
            listed_by: "`stillmap info` lists what the bag holds",
            topics: info.topics.iter().map(offered).collect(),
        }
    }

    /// Topics of the live graph, each with its type.
    pub(crate) fn of_graph(topics: impl IntoIterator<Item = (&'a str, &'a str)>) -> Self {
        let offered = |(topic, type_name)| Offered {
            topic,
            type_name,
            unread_encoding: None,
            is_empty: false,
            is_goal: false,
        };
        Self {
            place: GRAPH,
            listed_by: "`stillmap doctor` lists what the graph has",
            topics: topics.into_iter().map(offered).collect(),
        }
    }

    /// Where the topics are: "the bag", or "the graph".
    pub(crate) fn place(&self) -> &'static str {
        self.place
    }

    /// Whether the topics are those of the live graph.
    pub(crate) fn is_live(&self) -> bool {
        self.place == GRAPH
    }

    /// How to see all of them, a clause.
    pub(crate) fn listed_by(&self) -> &'static str {
        self.listed_by
    }

    /// Name and type of the topic of this name, which may be given with or without its leading slash.
    pub(crate) fn find(&self, named: &str) -> Option<(&'a str, &'a str)> {
        let bare = |name: &str| name.trim_start_matches('/').to_owned();
        let is_it = |offered: &&Offered<'a>| bare(offered.topic) == bare(named);
        self.topics.iter().find(is_it).map(|offered| (offered.topic, offered.type_name))
    }

    /// The encoding of a topic's messages, where it is none that is read.
    pub(crate) fn unread_encoding(&self, named: &str) -> Option<&'a str> {
        let (topic, _) = self.find(named)?;
        self.topics.iter().find(|offered| offered.topic == topic)?.unread_encoding
    }

    /// The topics of a type that could be an input: the truth of a simulation is none.
    pub(crate) fn of_type(&self, type_name: &str) -> impl Iterator<Item = &'a str> {
        let is_input = move |offered: &&Offered<'a>| {
            offered.type_name == type_name
                && offered.unread_encoding.is_none()
                && !offered.is_empty
                && !offered.is_goal
                && !offered.topic.starts_with(TRUTH)
        };
        self.topics.iter().filter(is_input).map(|offered| offered.topic)
    }

    /// Whether there are scans of a 3D LiDAR, or clouds that may be such, and nothing of a camera.
    pub(crate) fn is_of_a_lidar_alone(&self) -> bool {
        let has = |type_name: &str| self.of_type(type_name).next().is_some();
        (has(PointCloud2::TYPE_NAME) || has(VelodyneScan::TYPE_NAME))
            && !has(Image::TYPE_NAME)
            && !has(CompressedImage::TYPE_NAME)
    }

    /// Whether a topic of this name and type is there.
    pub(crate) fn has(&self, topic: &str, type_name: &str) -> bool {
        self.of_type(type_name).any(|offered| offered == topic)
    }

    /// What there is in other encodings than that of ROS 2, to be added to what is missing; empty where there is nothing such.
    pub(crate) fn unread(&self) -> String {
        let with_messages = self.topics.iter().filter(|offered| !offered.is_empty);
        let encodings: BTreeSet<&str> =
            with_messages.filter_map(|offered| offered.unread_encoding).collect();
        if encodings.is_empty() {
            return String::new();
        }
        let of_ros1 = if encodings.contains(ROS1) {
            ", those of a bag of ROS 1 that was put into another container; give the .bag itself, which is read"
        } else {
            ""
        };
        let encodings: Vec<&str> = encodings.into_iter().collect();
        format!(
            " in cdr (ROS 2), the encoding that is read: it has messages in {}{of_ros1}",
            encodings.join(", ")
        )
    }

    /// Whether there are messages, but none in an encoding that is read.
    pub(crate) fn is_unread(&self) -> bool {
        let mut with_messages = self.topics.iter().filter(|offered| !offered.is_empty).peekable();
        with_messages.peek().is_some()
            && with_messages.all(|offered| offered.unread_encoding.is_some())
    }
}

#[cfg(test)]
mod tests {
    use bag_player::{Bag, BagWriter, OfferedQos};
    use geometry::Stamp;
    use msgs::geometry_msgs::PoseStamped;
    use msgs::nav_msgs::Odometry;

    use super::*;

    fn put<M: RosMessage + Default>(writer: &mut BagWriter, topic: &str, times_s: &[f64]) {
        let channel = writer.channel::<M>(topic, OfferedQos::reliable(10)).unwrap();
        for time_s in times_s {
            let stamp = Stamp::from_secs_nanos(100, 0).plus_seconds(*time_s);
            writer.write(channel, stamp, &M::default()).unwrap();
        }
    }

    /// Regression: in a bag of a robot with Nav2 the goals, which are of the type PoseStamped, were taken for the robot's poses.
    #[test]
    fn goals_are_no_poses_where_there_is_an_odometry() {
        let folder = tempfile::tempdir().unwrap();
        let often: Vec<f64> = (0..60).map(|index| 0.1 * f64::from(index)).collect();
        let offered = |name: &str, goals: &[f64], odometry: &[f64]| -> Vec<String> {
            let path = folder.path().join(name);
            let mut writer = BagWriter::create(&path).unwrap();
            put::<PoseStamped>(&mut writer, "/goal_pose", goals);
            put::<Odometry>(&mut writer, "/odom", odometry);
            writer.finish().unwrap();
            let info = Bag::open(&path).unwrap().info().unwrap();
            Offer::of_bag(&info).of_type(PoseStamped::TYPE_NAME).map(str::to_owned).collect()
        };
        for (name, goals) in [("one", &[2.0][..]), ("three", &[0.0, 2.0, 5.0])] {
            assert!(offered(&format!("{name}.mcap"), goals, &often).is_empty(), "{name}");
            // They may be all that there is.
            assert_eq!(offered(&format!("{name}_alone.mcap"), goals, &[]), ["/goal_pose"]);
        }
        assert_eq!(offered("both.mcap", &often, &often), ["/goal_pose"]);
    }
}
