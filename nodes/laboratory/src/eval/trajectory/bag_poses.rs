//! The trajectory on a topic of a bag.

use std::path::Path;

use bag_player::{Bag, BagMessage, Selection, TopicInfo};
use evaluation::trajectory::{RawPose, Trajectory};
use geometry::Stamp;
use msgs::RosMessage;
use msgs::convert::stamp_from_time;
use msgs::geometry_msgs::{Pose, PoseStamped, PoseWithCovarianceStamped};
use msgs::nav_msgs::Odometry;
use msgs::std_msgs::Header;
use msgs::tf2_msgs::TFMessage;

use super::source::Read;
use robot::Failure;

/// The types of topics with one trajectory.
const POSE_TYPES: [&str; 3] =
    [PoseStamped::TYPE_NAME, PoseWithCovarianceStamped::TYPE_NAME, Odometry::TYPE_NAME];

/// A topic, and the transform on it.
struct Wanted {
    topic: String,
    /// Parent and child of a transform of `/tf`.
    frames: Option<(String, String)>,
}

/// Reads the poses of a topic, or of the only topic with poses; `option` is the argument for the topic.
pub(super) fn read(path: &Path, topic: Option<&str>, option: &str) -> Result<Read, Failure> {
    let in_bag = |error: bag_player::BagError| Failure::new(error.to_string());
    let bag = Bag::open(path).map_err(in_bag)?;
    let info = bag.info().map_err(in_bag)?;
    let wanted = match topic {
        Some(topic) => Wanted::parse(topic),
        None => only_topic(&info.topics, path, option)?,
    };
    let type_name = type_of(&info.topics, &wanted, path, option)?;
    let selection = Selection { topics: Some(vec![wanted.topic.clone()]), ..Selection::default() };
    let mut poses: Vec<(Stamp, RawPose)> = Vec::new();
    let mut unreadable = 0;
    let mut messages = bag.messages(&selection).map_err(in_bag)?;
    for message in messages.by_ref() {
        let message = message.map_err(in_bag)?;
        match poses_of(&message, type_name, &wanted) {
            Ok(found) => poses.extend(found),
            Err(_) => unreadable += 1,
        }
    }
    if poses.is_empty() {
        let what = match &wanted.frames {
            Some((parent, child)) => format!("no transform from {parent} to {child}"),
            None => "no pose".to_owned(),
        };
        let failure = Failure::new(format!("{}: {what} on {}", path.display(), wanted.topic));
        return Err(failure.fix(format!("stillmap info {} lists its topics", path.display())));
    }
    let losses = unreadable + messages.losses().len();
    Ok(Read { format: "bag", trajectory: Trajectory::stamped(poses), losses, takes_times: false })
}

impl Wanted {
    /// `/topic`, or `/tf:parent:child`.
    fn parse(text: &str) -> Self {
        let mut parts = text.splitn(3, ':');
        let topic = parts.next().unwrap_or_default().to_owned();
        let frames = parts.next().zip(parts.next());
        let owned =
            |(parent, child): (&str, &str)| (bare(parent).to_owned(), bare(child).to_owned());
        Self { topic, frames: frames.map(owned) }
    }
}

/// A name without its leading slash, which topics of recordings and frames of early ones have.
fn bare(name: &str) -> &str {
    name.strip_prefix('/').unwrap_or(name)
}

fn only_topic(topics: &[TopicInfo], path: &Path, option: &str) -> Result<Wanted, Failure> {
    let mut with_poses = topics
        .iter()
        .filter(|topic| topic.message_count > 0 && POSE_TYPES.contains(&topic.type_name.as_str()));
    match (with_poses.next(), with_poses.next()) {
        (Some(only), None) => Ok(Wanted { topic: only.topic.clone(), frames: None }),
        (None, _) => Err(Failure::new(format!("{} has no topic with poses", path.display()))
            .fix(format!("for a transform give {option} /tf:PARENT:CHILD"))),
        (Some(one), Some(other)) => {
            let all = [one, other].into_iter().chain(with_poses);
            let names: Vec<&str> = all.map(|topic| topic.topic.as_str()).collect();
            Err(Failure::new(format!("{} has several topics with poses", path.display()))
                .fix(format!("choose with {option}: {}", names.join(", "))))
        }
    }
}

/// The type of the topic, which must be a known one.
fn type_of(
    topics: &[TopicInfo],
    wanted: &Wanted,
    path: &Path,
    option: &str,
) -> Result<&'static str, Failure> {
    let found =
        topics.iter().find(|topic| bare(&topic.topic) == bare(&wanted.topic)).ok_or_else(|| {
            Failure::new(format!("{} has no topic {}", path.display(), wanted.topic))
                .fix(format!("stillmap info {} lists its topics", path.display()))
        })?;
    let known = POSE_TYPES.into_iter().chain([TFMessage::TYPE_NAME]);
    let Some(type_name) = known.into_iter().find(|name| *name == found.type_name) else {
        return Err(Failure::new(format!(
            "{}: {} carries {}, which is not a pose",
            path.display(),
            wanted.topic,
            found.type_name
        ))
        .fix(format!(
            "a trajectory is of {} or {}",
            POSE_TYPES.join(", "),
            TFMessage::TYPE_NAME
        )));
    };
    if (type_name == TFMessage::TYPE_NAME) != wanted.frames.is_some() {
        let fix = if wanted.frames.is_some() {
            format!("give {option} {}", wanted.topic)
        } else {
            format!("give {option} {}:PARENT:CHILD", wanted.topic)
        };
        let carries = format!("{} carries {type_name}", wanted.topic);
        return Err(Failure::new(format!("{}: {carries}", path.display())).fix(fix));
    }
    Ok(type_name)
}

fn poses_of(
    message: &BagMessage,
    type_name: &str,
    wanted: &Wanted,
) -> Result<Vec<(Stamp, RawPose)>, bag_player::BagError> {
    if let Some((parent, child)) = &wanted.frames {
        let transforms = message.decode::<TFMessage>()?.transforms;
        let is_wanted = |header: &Header, child_frame: &str| {
            bare(&header.frame_id) == parent && bare(child_frame) == child
        };
        return Ok(transforms
            .iter()
            .filter(|transform| is_wanted(&transform.header, &transform.child_frame_id))
            .map(|transform| {
                let at = &transform.transform.translation;
                let turn = &transform.transform.rotation;
                let raw = RawPose {
                    position_m: [at.x, at.y, at.z],
                    quaternion_xyzw: [turn.x, turn.y, turn.z, turn.w],
                };
                (stamp_from_time(transform.header.stamp), raw)
            })
            .collect());
    }
    let (header, pose) = if type_name == PoseStamped::TYPE_NAME {
        let message = message.decode::<PoseStamped>()?;
        (message.header, message.pose)
    } else if type_name == Odometry::TYPE_NAME {
        let message = message.decode::<Odometry>()?;
        (message.header, message.pose.pose)
    } else {
        let message = message.decode::<PoseWithCovarianceStamped>()?;
        (message.header, message.pose.pose)
    };
    Ok(vec![(stamp_from_time(header.stamp), raw(&pose))])
}

fn raw(pose: &Pose) -> RawPose {
    let (at, turn) = (&pose.position, &pose.orientation);
    RawPose { position_m: [at.x, at.y, at.z], quaternion_xyzw: [turn.x, turn.y, turn.z, turn.w] }
}
