//! The keyframes as a graph of poses (Mur-Artal et al. 2015, section III-D): the spanning tree, those that see much of the
//! same, and the loops.

use std::collections::BTreeMap;

use nalgebra::Isometry3;
use pose_graph::{Edge, PoseGraph, information};

use super::LoopConfig;
use crate::bundle_adjustment::MotionStdDev;
use crate::map::{KeyframeId, Map};

/// A graph, and which keyframe each of its nodes is.
#[derive(Clone, Debug)]
pub struct EssentialGraph {
    /// Nodes are `map_from_camera`. The root is fixed.
    pub graph: PoseGraph,
    /// The keyframes, in the order of the nodes.
    pub keyframes: Vec<KeyframeId>,
}

/// A loop that is to be closed: from which keyframe, to which, and where the second is from the first.
pub(super) type NewLoop = (KeyframeId, KeyframeId, Isometry3<f64>);

/// The essential graph of a map as it is: by its own poses no edge but those of loops is off by anything.
#[must_use]
pub fn essential_graph(map: &Map, config: &LoopConfig) -> EssentialGraph {
    with_loop(map, None, config)
}

/// The same with a loop that may be wrong.
pub(super) fn with_loop(map: &Map, new: Option<NewLoop>, config: &LoopConfig) -> EssentialGraph {
    let keyframes: Vec<KeyframeId> = map.keyframes().ids().collect();
    let nodes: BTreeMap<KeyframeId, usize> =
        keyframes.iter().enumerate().map(|(node, id)| (*id, node)).collect();
    let mut graph = PoseGraph::default();
    for (id, keyframe) in map.keyframes().iter() {
        graph.poses.push(keyframe.camera_from_map().inverse());
        graph.is_fixed.push(map.root() == Some(id));
    }
    let step = information(config.edge_std_dev_m, config.edge_std_dev_rad);
    let closed = information(config.loop_std_dev_m, config.loop_std_dev_rad);
    for (id, keyframe) in map.keyframes().iter() {
        let Some(from) = nodes.get(&id).copied() else { continue };
        // To the parent, and to those that came before: each pair once.
        let earlier = keyframe.covisible().iter().filter_map(|(other, shared)| {
            let number = map.keyframes().get(*other)?.number();
            let is_tree = keyframe.parent() == Some(*other) || keyframe.children().contains(other);
            let is_near = shared.landmarks() >= config.essential_shared;
            (is_near && !is_tree && number < keyframe.number()).then_some(*other)
        });
        let earlier: Vec<KeyframeId> = earlier.chain(keyframe.parent()).collect();
        for other in &earlier {
            let (Some(to), Some(of_other)) = (nodes.get(other), map.keyframes().get(*other)) else {
                continue;
            };
            // They are all measured by the same features: together they count as one. Drift grows with the distance
            // between, or where that is not known, with each keyframe.
            let between = keyframe.number().abs_diff(of_other.number()).max(1);
            let of_odometry = keyframe.by_odometry().zip(of_other.by_odometry());
            let motions = &config.keyframing.window.motions;
            let std_dev = of_odometry.and_then(|(one, other)| motions.between(one, other));
            let alone = match std_dev {
                Some(MotionStdDev { shift_m, turn_rad }) => information(shift_m, turn_rad),
                None => step / between as f64,
            };
            let information = alone / earlier.len() as f64;
            let from_to = graph.poses[from].inverse() * graph.poses[*to];
            graph.edges.push(Edge { from, to: *to, from_to, information, is_doubtful: false });
        }
        for (other, edge) in keyframe.loops().iter().filter(|(other, _)| **other > id) {
            let Some(to) = nodes.get(other).copied() else { continue };
            let from_to = edge.camera_from_other;
            graph.edges.push(Edge { from, to, from_to, information: closed, is_doubtful: false });
        }
    }
    if let Some((from, to, from_to)) = new
        && let Some((from, to)) = nodes.get(&from).zip(nodes.get(&to))
    {
        let (from, to) = (*from, *to);
        graph.edges.push(Edge { from, to, from_to, information: closed, is_doubtful: true });
    }
    EssentialGraph { graph, keyframes }
}
