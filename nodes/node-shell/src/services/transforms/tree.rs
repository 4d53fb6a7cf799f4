//! Frames, each with its parent, and the transform from one to another.

use std::collections::BTreeMap;

use geometry::{PoseBuffer, PoseLookupError, PosePushError, Stamp, StampedPose, check_pose};
use msgs::convert;
use msgs::tf2_msgs::TFMessage;
use nalgebra::Isometry3;

use super::error::{FRAMES_NAMED, TransformError, TransformRefused};

/// Frames that may be known; a robot has a hundred.
pub(super) const MOST_FRAMES: usize = 1000;
/// Transforms of one frame over time that are kept: ten seconds, which is tf2's own memory, at 100 Hz.
const MOST_TIMED: usize = 1000;
/// Transforms that follow one another by more than this are not interpolated between: half a second more than the
/// slowest broadcaster of moving parts, at 1 Hz.
const MAX_GAP_S: f64 = 1.5;
/// But they are where both agree, as far as tf2's own memory reaches: a localisation that publishes seldom while the robot stands,
/// or seldom corrects an odometry.
const MAX_REST_S: f64 = 10.0;

/// The transforms between frames, fixed ones and those of a moment.
///
/// Each frame has one parent. What is heard last decides which, and whether it is fixed to it.
#[derive(Clone, Debug, Default)]
pub struct TransformTree {
    /// By the child's name.
    edges: BTreeMap<String, Edge>,
}

#[derive(Clone, Debug)]
struct Edge {
    parent: String,
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Fixed(Isometry3<f64>),
    /// Poses of the child in the parent.
    Timed(PoseBuffer),
}

impl TransformTree {
    /// Takes in the transforms of a message of `/tf_static` (`are_fixed`) or `/tf`. Invalid ones are left out, and `refuse` is
    /// called with the reason of each.
    pub fn insert_message(
        &mut self,
        message: &TFMessage,
        are_fixed: bool,
        mut refuse: impl FnMut(String),
    ) {
        for transform in &message.transforms {
            let (parent, child) = (&transform.header.frame_id, &transform.child_frame_id);
            let inserted = match convert::isometry_from_transform(&transform.transform) {
                Err(error) => Err(format!("the transform from {child:?} to {parent:?}: {error}")),
                Ok(parent_from_child) => if are_fixed {
                    self.insert_fixed(parent, child, &parent_from_child)
                } else {
                    let stamp = convert::stamp_from_time(transform.header.stamp);
                    self.insert_timed(stamp, parent, child, &parent_from_child)
                }
                .map_err(|error| error.to_string()),
            };
            if let Err(reason) = inserted {
                refuse(reason);
            }
        }
    }

    /// Takes in that `child` is fixed to `parent`: `parent_from_child * point_in_child` is a point in the parent.
    ///
    /// # Errors
    /// When it does not fit into a tree, or its numbers are of no use.
    pub fn insert_fixed(
        &mut self,
        parent: &str,
        child: &str,
        parent_from_child: &Isometry3<f64>,
    ) -> Result<(), TransformRefused> {
        let (parent, child) = self.check(parent, child, parent_from_child)?;
        self.edges.insert(child, Edge { parent, kind: Kind::Fixed(*parent_from_child) });
        Ok(())
    }

    /// Takes in where `child` was in `parent` at a moment. One of a known stamp is ignored: broadcasters
    /// repeat themselves.
    ///
    /// # Errors
    /// When it does not fit into a tree, its numbers are of no use, or it is older than all that is kept.
    pub fn insert_timed(
        &mut self,
        stamp: Stamp,
        parent: &str,
        child: &str,
        parent_from_child: &Isometry3<f64>,
    ) -> Result<(), TransformRefused> {
        let (parent, child) = self.check(parent, child, parent_from_child)?;
        let pose =
            StampedPose { stamp, frame_id: parent.clone(), map_from_rig: *parent_from_child };
        let pushed = match self.edges.get_mut(&child) {
            Some(Edge { parent: before, kind: Kind::Timed(poses) }) if *before == parent => {
                poses.push(pose)
            }
            _ => {
                let mut poses = PoseBuffer::new(MOST_TIMED)
                    .with_max_gap_s(MAX_GAP_S)
                    .with_max_rest_s(MAX_REST_S);
                let pushed = poses.push(pose);
                let edge = Edge { parent: parent.clone(), kind: Kind::Timed(poses) };
                self.edges.insert(child.clone(), edge);
                pushed
            }
        };
        match pushed {
            Ok(()) | Err(PosePushError::Duplicate { .. }) => Ok(()),
            Err(source) => Err(TransformRefused::Time { parent, child, source }),
        }
    }

    /// The transform of a moment that takes a point in `source` to `target`. Fixed transforms hold at any moment;
    /// between two of a moving frame it is interpolated, and never carried on beyond the last one.
    ///
    /// # Errors
    /// When a frame is missing, the two are not connected, or the transform is not known for the moment.
    pub fn lookup(
        &self,
        target: &str,
        source: &str,
        stamp: Stamp,
    ) -> Result<Isometry3<f64>, TransformError> {
        self.transform_chain(target, source, Some(stamp))
    }

    /// The same by the last transform of each frame, of whatever moment: for frames that hardly move, and are published
    /// later than they are requested.
    ///
    /// # Errors
    /// When a frame is missing, or the two are not connected.
    pub fn lookup_latest(
        &self,
        target: &str,
        source: &str,
    ) -> Result<Isometry3<f64>, TransformError> {
        self.transform_chain(target, source, None)
    }

    fn transform_chain(
        &self,
        target: &str,
        source: &str,
        stamp: Option<Stamp>,
    ) -> Result<Isometry3<f64>, TransformError> {
        let [of_target, of_source] = self.branches(target, source)?;
        let common_from_target = self.chain(&of_target, stamp)?;
        let common_from_source = self.chain(&of_source, stamp)?;
        Ok(common_from_target.inverse() * common_from_source)
    }

    /// Whether a joint may move one of the two relative to the other: a transform between them is one of a moment.
    ///
    /// # Errors
    /// When a frame is missing, or the two are not connected.
    pub fn is_jointed(&self, target: &str, source: &str) -> Result<bool, TransformError> {
        let branches = self.branches(target, source)?;
        let mut edges = branches.iter().flatten().filter_map(|child| self.edges.get(*child));
        Ok(edges.any(|edge| matches!(edge.kind, Kind::Timed(_))))
    }

    /// The frames from each of the two up to below the frame in which both are.
    fn branches<'a>(
        &'a self,
        target: &'a str,
        source: &'a str,
    ) -> Result<[Vec<&'a str>; 2], TransformError> {
        let (target, source) = (name_of(target), name_of(source));
        for frame in [target, source] {
            self.check_known(frame)?;
        }
        let (mut to_target, mut to_source) = (self.ancestors(target), self.ancestors(source));
        let Some((up_target, up_source)) = meeting(&to_target, &to_source) else {
            let root =
                |ancestors: &[&str]| ancestors.last().copied().unwrap_or_default().to_owned();
            return Err(TransformError::NotConnected {
                target: target.to_owned(),
                source_frame: source.to_owned(),
                target_root: root(&to_target),
                source_root: root(&to_source),
            });
        };
        to_target.truncate(up_target);
        to_source.truncate(up_source);
        Ok([to_target, to_source])
    }

    /// Forgets what is of a moment, as after a jump of the clock. Fixed transforms stay.
    pub fn forget_timed(&mut self) {
        self.edges.retain(|_, edge| matches!(edge.kind, Kind::Fixed(_)));
    }

    /// How many frames have a parent.
    #[must_use]
    pub fn len(&self) -> usize {
        self.edges.len()
    }

    /// Whether nothing is known.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.edges.is_empty()
    }

    /// The names without what does not belong to them, if the child may have this parent in this pose.
    fn check(
        &self,
        parent: &str,
        child: &str,
        parent_from_child: &Isometry3<f64>,
    ) -> Result<(String, String), TransformRefused> {
        let (parent, child) = (name_of(parent).to_owned(), name_of(child).to_owned());
        if parent.is_empty() || child.is_empty() {
            return Err(TransformRefused::NoName { parent, child });
        }
        if self.ancestors(&parent).contains(&child.as_str()) {
            return Err(TransformRefused::Loop { parent, child });
        }
        if self.edges.len() >= MOST_FRAMES && !self.edges.contains_key(&child) {
            return Err(TransformRefused::TooManyFrames { child });
        }
        if let Err(source) = check_pose(parent_from_child) {
            return Err(TransformRefused::Unusable { parent, child, source });
        }
        Ok((parent, child))
    }

    fn check_known(&self, frame: &str) -> Result<(), TransformError> {
        if self.edges.contains_key(frame) || self.edges.values().any(|edge| edge.parent == frame) {
            return Ok(());
        }
        let mut frames: Vec<&String> =
            self.edges.iter().flat_map(|(child, edge)| [child, &edge.parent]).collect();
        frames.sort_unstable();
        frames.dedup();
        let frames = frames.into_iter().take(FRAMES_NAMED).cloned().collect();
        Err(TransformError::UnknownFrame { frame: frame.to_owned(), frames })
    }

    /// The frame itself, its parent, and so on to the root. Ends, since no loop is ever taken in.
    fn ancestors<'a>(&'a self, frame: &'a str) -> Vec<&'a str> {
        let parent = |frame: &&'a str| self.edges.get(*frame).map(|edge| edge.parent.as_str());
        std::iter::successors(Some(frame), parent).collect()
    }

    /// The transform from the first of these frames to the parent of the last one.
    fn chain(
        &self,
        frames: &[&str],
        stamp: Option<Stamp>,
    ) -> Result<Isometry3<f64>, TransformError> {
        let mut top_from_frame = Isometry3::identity();
        for (child, edge) in frames.iter().filter_map(|child| self.edges.get_key_value(*child)) {
            let parent_from_child = match &edge.kind {
                Kind::Fixed(parent_from_child) => *parent_from_child,
                Kind::Timed(poses) => match pose_at(poses, stamp) {
                    Ok(parent_from_child) => parent_from_child,
                    Err(source) => {
                        let (parent, child) = (edge.parent.clone(), child.clone());
                        return Err(TransformError::Time { parent, child, source });
                    }
                },
            };
            top_from_frame = parent_from_child * top_from_frame;
        }
        Ok(top_from_frame)
    }
}

/// The pose of a moment, or the newest one.
fn pose_at(poses: &PoseBuffer, stamp: Option<Stamp>) -> Result<Isometry3<f64>, PoseLookupError> {
    let pose = match stamp {
        Some(stamp) => poses.at(stamp)?,
        None => poses.newest().cloned().ok_or(PoseLookupError::Empty)?,
    };
    Ok(pose.map_from_rig)
}

/// How many steps lead from each of the two to the first common ancestor.
fn meeting(to_target: &[&str], to_source: &[&str]) -> Option<(usize, usize)> {
    to_target.iter().enumerate().find_map(|(up_target, frame)| {
        let up_source = to_source.iter().position(|other| other == frame)?;
        Some((up_target, up_source))
    })
}

/// Names of ROS 1 begin with a slash, and mean the same without.
fn name_of(frame: &str) -> &str {
    frame.strip_prefix('/').unwrap_or(frame)
}
