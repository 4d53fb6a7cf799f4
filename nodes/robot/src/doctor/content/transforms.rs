//! The transforms received on `/tf_static` and `/tf`: whether they form one tree.

use std::collections::{BTreeMap, BTreeSet};

use geometry::Stamp;
use msgs::convert::{isometry_from_transform, stamp_from_time};
use msgs::tf2_msgs::TFMessage;
use node_shell::TransformTree;

use super::{Check, Finding, Typical};

/// Frames that are kept at most.
const MOST_FRAMES: usize = 4096;
/// Parents of a frame that are kept at most.
const MOST_PARENTS: usize = 16;
/// A gap in a moving frame's transforms is at least so many of its periods, ...
const GAP_PERIODS: f64 = 5.0;
/// ... and no less than this: tf2 waits for transforms of a tenth of that, and remembers ten.
const LEAST_GAP_S: f64 = 1.0;
/// Reasons that are reported at most.
const MOST_REFUSALS: usize = 3;

/// What is known of tf.
#[derive(Clone, Debug, Default)]
pub(in crate::doctor) struct TransformFacts {
    pub(in crate::doctor) messages: u64,
    /// By the child, then by the parent.
    edges: BTreeMap<String, BTreeMap<String, Edge>>,
    /// Why the first few transforms are invalid.
    refused: Vec<String>,
    refusals: u64,
    tree: TransformTree,
}

/// What was received of a frame in another.
#[derive(Clone, Debug, Default)]
struct Edge {
    messages: u64,
    fixed: bool,
    moving: bool,
    last: Option<Stamp>,
    step_s: Typical,
}

impl TransformFacts {
    pub(in crate::doctor) fn take(&mut self, message: &TFMessage, is_fixed: bool) {
        self.messages += 1;
        for transform in &message.transforms {
            let (parent, child) = (&transform.header.frame_id, &transform.child_frame_id);
            let stamp = stamp_from_time(transform.header.stamp);
            let motion = match isometry_from_transform(&transform.transform) {
                Ok(motion) => motion,
                Err(error) => {
                    self.refuse(format!("{child} in {parent}: {error}"));
                    continue;
                }
            };
            if parent.is_empty() || child.is_empty() {
                self.refuse(format!("{child:?} in {parent:?}: a frame has no name"));
                continue;
            }
            let [parent, child] = [parent, child].map(|name| name.trim_start_matches('/'));
            if self.edges.len() >= MOST_FRAMES && !self.edges.contains_key(child) {
                continue;
            }
            let parents = self.edges.entry(child.to_owned()).or_default();
            if parents.len() >= MOST_PARENTS && !parents.contains_key(parent) {
                continue;
            }
            let edge = parents.entry(parent.to_owned()).or_default();
            edge.messages += 1;
            edge.fixed |= is_fixed;
            edge.moving |= !is_fixed;
            if let Some(before) = edge.last.replace(stamp) {
                edge.step_s.add(stamp.seconds_since(before));
            }
            // An insertion that the tree refuses is found among the edges.
            let _ = if is_fixed {
                self.tree.insert_fixed(parent, child, &motion)
            } else {
                self.tree.insert_timed(stamp, parent, child, &motion)
            };
        }
    }

    fn refuse(&mut self, reason: String) {
        self.refusals += 1;
        if self.refused.len() < MOST_REFUSALS {
            self.refused.push(reason);
        }
    }

    /// The valid transforms.
    pub(in crate::doctor) fn tree(&self) -> &TransformTree {
        &self.tree
    }

    /// These frames and all that are above them in the tree.
    pub(in crate::doctor) fn above<'a>(
        &'a self,
        frames: impl Iterator<Item = &'a str>,
    ) -> BTreeSet<&'a str> {
        let mut open: Vec<&str> = frames.map(|name| name.trim_start_matches('/')).collect();
        let mut above = BTreeSet::new();
        while let Some(frame) = open.pop() {
            if above.insert(frame) {
                let parents = self.edges.get(frame).into_iter().flat_map(BTreeMap::keys);
                open.extend(parents.map(String::as_str));
            }
        }
        above
    }

    /// What is wrong with them. `sensors` are the topics of sensors with their frames.
    pub(in crate::doctor) fn findings(&self, sensors: &[(&str, &str)]) -> Vec<Finding> {
        if self.messages == 0 {
            return Vec::new();
        }
        let mut findings = self.invalid();
        let loops = self.loops();
        findings.extend(loops.iter().map(|frames| loop_finding(frames)));
        findings.extend(self.many_parents());
        if loops.is_empty() {
            findings.extend(self.disconnected(sensors));
        }
        findings.extend(self.gaps());
        if findings.is_empty() {
            let what = format!("tf has {} frames, all of them connected", self.edges.len());
            findings.push(Finding::ok(Check::Transforms, what));
        }
        findings
    }

    fn invalid(&self) -> Vec<Finding> {
        if self.refusals == 0 {
            return Vec::new();
        }
        vec![Finding::error(
            Check::Transforms,
            format!("{} transforms are invalid: {}", self.refusals, self.refused.join("; ")),
            "publish finite numbers and a unit quaternion (0 0 0 1 for no rotation); in static_transform_publisher name \
             the arguments (--qx --qy --qz --qw)",
        )]
    }

    /// Loops from a frame through its parents back to itself; each loop once.
    fn loops(&self) -> BTreeSet<Vec<&str>> {
        let mut search = Search::default();
        for start in self.edges.keys() {
            self.follow(start, &mut search);
        }
        search.loops
    }

    fn follow<'a>(&'a self, frame: &'a str, search: &mut Search<'a>) {
        if let Some(begin) = search.path.iter().position(|before| *before == frame) {
            let mut frames = search.path.get(begin..).unwrap_or_default().to_vec();
            let least = frames.iter().enumerate().min_by_key(|(_, frame)| **frame);
            let turn = least.map_or(0, |(place, _)| place);
            frames.rotate_left(turn);
            search.loops.insert(frames);
        } else if search.path.len() < LONGEST_PATH && search.seen.insert(frame) {
            search.path.push(frame);
            for parent in self.edges.get(frame).into_iter().flat_map(BTreeMap::keys) {
                self.follow(parent, search);
            }
            search.path.pop();
        }
    }

    fn many_parents(&self) -> Vec<Finding> {
        let several = self.edges.iter().filter(|(_, parents)| parents.len() > 1);
        several
            .map(|(child, parents)| {
                let parents: Vec<String> = parents
                    .iter()
                    .map(|(parent, edge)| format!("{parent} ({} messages)", edge.messages))
                    .collect();
                Finding::error(
                    Check::Transforms,
                    format!("tf: the frame {child} has {} parents: {}", parents.len(), parents.join(", ")),
                    format!("let only one broadcaster publish {child}: map -> odom -> base_link -> sensor (REP-105)"),
                )
            })
            .chain(self.edges.iter().flat_map(|(child, parents)| {
                parents.iter().filter(|(_, edge)| edge.fixed && edge.moving).map(move |(parent, _)| {
                    Finding::warn(
                        Check::Transforms,
                        format!("tf: {child} in {parent} is published on /tf_static and on /tf"),
                        format!("let only one broadcaster publish {child}"),
                    )
                })
            }))
            .collect()
    }

    /// The root of the tree that a frame is in.
    fn root<'a>(&'a self, frame: &'a str) -> &'a str {
        let mut at = frame;
        for _ in 0..self.edges.len() {
            let Some((parent, _)) =
                self.edges.get(at).and_then(|parents| parents.first_key_value())
            else {
                break;
            };
            at = parent;
        }
        at
    }

    fn knows(&self, frame: &str) -> bool {
        self.edges.contains_key(frame)
            || self.edges.values().any(|parents| parents.contains_key(frame))
    }

    /// Sensors whose frames tf does not know, or does not connect.
    fn disconnected(&self, sensors: &[(&str, &str)]) -> Vec<Finding> {
        let mut findings = Vec::new();
        let mut roots: BTreeMap<&str, Vec<String>> = BTreeMap::new();
        for (topic, frame) in sensors {
            let frame = frame.trim_start_matches('/');
            if self.knows(frame) {
                roots.entry(self.root(frame)).or_default().push(format!("{frame} ({topic})"));
            } else {
                findings.push(Finding::warn(
                    Check::Frames,
                    format!(
                        "{topic}: its frame {frame} is not among the {} frames of tf",
                        self.edges.len()
                    ),
                    format!(
                        "publish its mount: ros2 run tf2_ros static_transform_publisher --frame-id base_link \
                         --child-frame-id {frame} --x 0 --y 0 --z 0"
                    ),
                ));
            }
        }
        if roots.len() > 1 {
            let parts: Vec<String> = roots
                .iter()
                .map(|(root, frames)| format!("{} under {root}", frames.join(", ")))
                .collect();
            findings.push(Finding::warn(
                Check::Transforms,
                format!("tf has {} parts with sensors that are not connected: {}", parts.len(), parts.join("; ")),
                "publish the transform between them: the robot's description (robot_state_publisher), or \
                 static_transform_publisher",
            ));
        }
        findings
    }

    /// Moving frames without a transform for a while.
    fn gaps(&self) -> Vec<Finding> {
        let edges = self.edges.iter().flat_map(|(child, parents)| {
            parents.iter().map(move |(parent, edge)| (child, parent, edge))
        });
        edges
            .filter(|(_, _, edge)| edge.moving)
            .filter_map(|(child, parent, edge)| {
                let (usual_s, longest_s) = (edge.step_s.median()?, edge.step_s.largest()?);
                (longest_s > LEAST_GAP_S.max(GAP_PERIODS * usual_s)).then(|| {
                    Finding::warn(
                        Check::Transforms,
                        format!(
                            "tf: {child} in {parent} has no transform for {longest_s:.2} s (usual are {usual_s:.3} s)"
                        ),
                        "see why its broadcaster pauses; record /tf on the machine of the broadcaster",
                    )
                })
            })
            .collect()
    }
}

/// Frames one above the other that are followed at most.
const LONGEST_PATH: usize = 256;

/// A search for loops, upwards from child to parent.
#[derive(Default)]
struct Search<'a> {
    /// The frames from the start to the present one.
    path: Vec<&'a str>,
    seen: BTreeSet<&'a str>,
    loops: BTreeSet<Vec<&'a str>>,
}

fn loop_finding(frames: &[&str]) -> Finding {
    let mut path = frames.to_vec();
    path.extend(frames.first());
    Finding::error(
        Check::Transforms,
        format!("tf: {} is a loop, each frame in the next one", path.join(" -> ")),
        "frames form a tree (REP-105): stop the broadcaster that has child and parent swapped",
    )
}
