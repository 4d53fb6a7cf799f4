//! Where the poses of the rig are read: from the messages of a topic, or by tf.

use std::collections::VecDeque;

use bag_player::BagMessage;
use detection::shell::DetectionParameters;
use geometry::{Stamp, StampedPose};
use msgs::convert::stamp_from_time;
use msgs::tf2_msgs::TFMessage;
use node_shell::TransformTree;

use super::poses::Poses;
use crate::run::inputs::{Inputs, TF_STATIC};
use crate::run::tf_frames::TfFrames;
use crate::run::{PoseSource, PoseTopicKind};

/// Stamps that wait for the other transforms of their moment: two seconds at 100 Hz, by when whatever localises has published.
const MOST_WAITING: usize = 200;

/// What the poses are read from.
pub(crate) enum RigPoses {
    Topic { topic: String, kind: PoseTopicKind },
    Tf { topics: Vec<&'static str>, frames: TfFrames },
}

impl RigPoses {
    /// Those of some inputs; by tf between the frames of the parameters. `None` where they are computed from images.
    pub(crate) fn of(inputs: &Inputs, parameters: &DetectionParameters) -> Option<Self> {
        match &inputs.pose {
            PoseSource::Topic { topic, kind } => {
                Some(Self::Topic { topic: topic.clone(), kind: *kind })
            }
            PoseSource::Tf => {
                let map = parameters.map_frame_id.clone();
                let robot = parameters.config.pipeline.rig.rig_frame_id.clone();
                let topics = inputs.transforms.clone();
                Some(Self::Tf { topics, frames: TfFrames { map, robot } })
            }
            PoseSource::Visual(_) => None,
        }
    }

    pub(super) fn topics(&self) -> Vec<&str> {
        match self {
            Self::Topic { topic, .. } => vec![topic],
            Self::Tf { topics, .. } => topics.clone(),
        }
    }

    /// What is missing where there are no poses, for a reader.
    pub(super) fn name(&self) -> String {
        match self {
            Self::Topic { topic, .. } => topic.clone(),
            Self::Tf { frames, .. } => {
                format!("the transform from {} to {}", frames.robot, frames.map)
            }
        }
    }
}

/// Reads the poses off messages.
pub(super) struct PoseReader<'a> {
    from: &'a RigPoses,
    tree: TransformTree,
    /// Moments of transforms at which the pose is not known yet.
    waiting: VecDeque<Stamp>,
    has_any: bool,
}

impl<'a> PoseReader<'a> {
    pub(super) fn new(from: &'a RigPoses) -> Self {
        Self { from, tree: TransformTree::default(), waiting: VecDeque::new(), has_any: false }
    }

    /// Takes in a message of one of the topics.
    pub(super) fn take(&mut self, message: &BagMessage, poses: &mut Poses) {
        match self.from {
            RigPoses::Topic { kind, .. } => match kind.read(message) {
                Some(pose) => poses.push(pose),
                None => poses.skip(),
            },
            RigPoses::Tf { frames, .. } => match message.decode::<TFMessage>() {
                Ok(transforms) => {
                    self.take_transforms(&transforms, &*message.topic == TF_STATIC, frames, poses);
                }
                Err(_) => poses.skip(),
            },
        }
    }

    fn take_transforms(
        &mut self,
        message: &TFMessage,
        are_fixed: bool,
        frames: &TfFrames,
        poses: &mut Poses,
    ) {
        self.tree.insert_message(message, are_fixed, |_refused| poses.skip());
        if !are_fixed {
            for transform in &message.transforms {
                let stamp = stamp_from_time(transform.header.stamp);
                if !self.waiting.contains(&stamp) {
                    self.waiting.push_back(stamp);
                }
            }
        }
        let (tree, has_any) = (&self.tree, &mut self.has_any);
        self.waiting.retain(|&stamp| {
            let Ok(map_from_rig) = tree.lookup(&frames.map, &frames.robot, stamp) else {
                return true;
            };
            *has_any = true;
            poses.push(StampedPose { stamp, frame_id: frames.map.clone(), map_from_rig });
            false
        });
        while self.waiting.len() > MOST_WAITING {
            self.waiting.pop_front();
        }
    }

    /// A robot whose transforms are all fixed has one pose.
    pub(super) fn finish(self, poses: &mut Poses) {
        let RigPoses::Tf { frames: TfFrames { map, robot }, .. } = self.from else { return };
        if self.has_any {
            return;
        }
        if let Ok(map_from_rig) = self.tree.lookup(map, robot, Stamp::default()) {
            let pose = StampedPose { stamp: Stamp::default(), frame_id: map.clone(), map_from_rig };
            poses.push(pose);
        }
    }
}

#[cfg(test)]
mod tests {
    use geometry::Stamp;
    use msgs::convert::{time_from_stamp, transform_from_isometry};
    use msgs::geometry_msgs::TransformStamped;
    use msgs::std_msgs::Header;
    use nalgebra::{Isometry3, Translation3, Vector3};

    use super::*;

    fn by_tf() -> RigPoses {
        let frames = TfFrames { map: "map".to_owned(), robot: "base_link".to_owned() };
        RigPoses::Tf { topics: vec!["/tf"], frames }
    }

    fn of(parent: &str, child: &str, milliseconds: i64, x_m: f64) -> TFMessage {
        let stamp = time_from_stamp(Stamp::from_nanos(milliseconds * 1_000_000));
        let transform = TransformStamped {
            header: Header { stamp, frame_id: parent.to_owned() },
            child_frame_id: child.to_owned(),
            transform: transform_from_isometry(&Isometry3::from(Translation3::new(x_m, 0.0, 0.0))),
        };
        TFMessage { transforms: vec![transform] }
    }

    /// The localiser publishes map to odom twice a second, 0.1 s late; the base publishes odom to base_link at 50 Hz.
    #[test]
    fn poses_by_tf_wait_for_the_localiser() {
        let (from, mut poses) = (by_tf(), Poses::new(1000, 0.5));
        let mut reader = PoseReader::new(&from);
        let RigPoses::Tf { frames, .. } = &from else { unreachable!() };
        for milliseconds in (0..4_000).step_by(20) {
            let x_m = milliseconds as f64 * 1e-3;
            let base = of("odom", "base_link", milliseconds, x_m);
            reader.take_transforms(&base, false, frames, &mut poses);
            let localised = milliseconds - 100;
            if localised >= 0 && localised % 500 == 0 {
                let correction = of("map", "odom", localised, 0.01 * localised as f64 * 1e-3);
                reader.take_transforms(&correction, false, frames, &mut poses);
            }
        }
        reader.finish(&mut poses);
        assert_eq!(poses.unusable(), 0);
        let pose = poses.at(Stamp::from_nanos(2_250_000_000)).unwrap();
        assert!((pose.translation.vector - Vector3::x() * 2.25 * 1.01).norm() < 1e-9, "{pose}");
        assert_eq!(poses.at(Stamp::from_nanos(3_800_000_000)), None, "no localisation yet");
    }

    #[test]
    fn a_robot_that_is_bolted_down_has_its_pose_at_any_time() {
        let (from, mut poses) = (by_tf(), Poses::new(1, 0.5));
        let mut reader = PoseReader::new(&from);
        let RigPoses::Tf { frames, .. } = &from else { unreachable!() };
        reader.take_transforms(&of("map", "base_link", 0, 2.0), true, frames, &mut poses);
        reader.finish(&mut poses);
        let pose = poses.at(Stamp::from_secs_nanos(1_700_000_000, 0)).unwrap();
        assert!((pose.translation.vector - Vector3::x() * 2.0).norm() < 1e-9);
    }
}
