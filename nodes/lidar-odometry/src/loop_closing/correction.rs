//! The keyframes as a graph of poses: the odometry from each to the next, and the loops. Two loops that agree bend it.

use nalgebra::{Isometry3, Matrix6};
use pose_graph::{Edge, PoseGraph, information, optimise};

use super::{ClosedLoop, Keyframe, LoopCloser, LoopOutcome, NotALoop};

/// A keyframe seen from an earlier one. Both are counted from the first one that ever was.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct LoopEdge {
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) from_to: Isometry3<f64>,
    pub(super) information: Matrix6<f64>,
    pub(super) fit_share: f64,
}

impl LoopCloser {
    /// Closes a loop if one that waits says the same; else it waits itself.
    pub(super) fn believe(&mut self, edge: LoopEdge) -> LoopOutcome {
        let way_m = self.keyframe(edge.to).map_or(0.0, |now| now.way_m);
        let most_m = self.config.confirmation_m;
        let is_near = |waiting: &LoopEdge| {
            self.keyframe(waiting.to).is_some_and(|then| way_m - then.way_m <= most_m)
        };
        let waiting: Vec<LoopEdge> =
            self.unconfirmed.iter().copied().filter(|waiting| is_near(waiting)).collect();
        let confirming: Vec<LoopEdge> =
            waiting.iter().copied().filter(|waiting| self.agree(waiting, &edge)).collect();
        self.unconfirmed = waiting;
        if confirming.is_empty() {
            self.unconfirmed.push(edge);
            return LoopOutcome::Unconfirmed;
        }
        match self.close(&edge, &confirming) {
            Ok(closed) => {
                self.unconfirmed.clear();
                self.closed += 1;
                self.closed_at_m = Some(way_m);
                LoopOutcome::Closed(closed)
            }
            Err(reason) => LoopOutcome::Refused(reason),
        }
    }

    fn keyframe(&self, number: usize) -> Option<&Keyframe> {
        self.keyframes.get(number.checked_sub(self.forgotten)?)
    }

    /// Whether the way from the one to the other keyframe is the same by the loops as by the odometry.
    fn agree(&self, one: &LoopEdge, other: &LoopEdge) -> bool {
        let all = self
            .keyframe(one.from)
            .zip(self.keyframe(other.from))
            .zip(self.keyframe(one.to).zip(self.keyframe(other.to)));
        let Some(((one_then, other_then), (one_now, other_now))) = all else { return false };
        let then = one_then.map_from_vehicle.inv_mul(&other_then.map_from_vehicle);
        let by_loops = one.from_to.inverse() * then * other.from_to;
        let by_odometry = one_now.odom_from_vehicle.inv_mul(&other_now.odom_from_vehicle);
        let off = by_odometry.inv_mul(&by_loops);
        off.translation.vector.norm() <= self.config.agreement_m
            && off.rotation.angle() <= self.config.agreement_deg.to_radians()
    }

    /// Puts all keyframes where the graph has them then.
    fn close(&mut self, edge: &LoopEdge, others: &[LoopEdge]) -> Result<ClosedLoop, NotALoop> {
        let new: Vec<LoopEdge> = others.iter().copied().chain([*edge]).collect();
        let graph = self.graph(&new);
        let optimised = optimise(&graph, &self.config.graph, &|| false)?;
        let fates = optimised.edges.iter().rev().zip(new.iter().rev());
        // All of them or none: they have confirmed each other.
        if let Some((fate, _)) = fates.clone().find(|(fate, _)| !fate.is_used) {
            return Err(NotALoop::Contradicted { chi2: fate.chi2 });
        }
        let before = self.keyframes.back().map(|now| now.map_from_vehicle).unwrap_or_default();
        for (keyframe, pose) in self.keyframes.iter_mut().zip(&optimised.poses) {
            keyframe.map_from_vehicle = *pose;
        }
        self.loops.extend(new);
        let now = self.keyframes.back().map(|now| now.map_from_vehicle).unwrap_or_default();
        if let Some(last) = self.keyframes.back() {
            self.map_from_odom = last.map_from_vehicle * last.odom_from_vehicle.inverse();
        }
        let gap = before.inv_mul(&now);
        let (then, to) = (self.keyframe(edge.from), self.keyframe(edge.to));
        Ok(ClosedLoop {
            before: then.map(|then| then.stamp).unwrap_or_default(),
            way_m: to.zip(then).map_or(0.0, |(now, then)| now.way_m - then.way_m),
            gap_m: gap.translation.vector.norm(),
            gap_rad: gap.rotation.angle(),
            fit_share: edge.fit_share,
        })
    }

    /// The first keyframe stays where it is. The new loops stand last, and may be wrong.
    fn graph(&self, new: &[LoopEdge]) -> PoseGraph {
        let poses = self.keyframes.iter().map(|keyframe| keyframe.map_from_vehicle).collect();
        let mut graph = PoseGraph { poses, is_fixed: vec![true], edges: Vec::new() };
        let pairs = self.keyframes.iter().zip(self.keyframes.iter().skip(1));
        for (from, (earlier, later)) in pairs.enumerate() {
            let km = ((later.way_m - earlier.way_m) / 1000.0).max(f64::MIN_POSITIVE);
            let certain =
                information(self.config.drift_m_per_km, self.config.drift_deg_per_km.to_radians());
            graph.edges.push(Edge {
                from,
                to: from + 1,
                from_to: earlier.odom_from_vehicle.inv_mul(&later.odom_from_vehicle),
                information: certain / km,
                is_doubtful: false,
            });
        }
        let of_loop = |edge: &LoopEdge, is_doubtful| Edge {
            from: edge.from - self.forgotten,
            to: edge.to - self.forgotten,
            from_to: edge.from_to,
            information: edge.information,
            is_doubtful,
        };
        graph.edges.extend(self.loops.iter().map(|edge| of_loop(edge, false)));
        graph.edges.extend(new.iter().map(|edge| of_loop(edge, true)));
        graph
    }
}
