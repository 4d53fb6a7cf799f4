//! The keyframes as a graph of poses: the odometry from each to the next, and the loops. Two loops that agree bend it.

use nalgebra::{Isometry3, Matrix6};
use pose_graph::{Edge, PoseGraph, information, optimise};

use super::{ClosedLoop, Keyframe, LoopCloser, LoopClosingConfig, LoopOutcome, NotALoop};

/// A keyframe seen from an earlier one. Both are counted from the first one that ever was.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct LoopEdge {
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) from_to: Isometry3<f64>,
    pub(super) information: Matrix6<f64>,
    pub(super) fit_share: f64,
}

/// How far an odometry drifts in a kilometre: standard deviations along and about each axis, which grow with the root of the
/// distance.
#[derive(Clone, Copy, Debug)]
struct Drift {
    m_per_km: f64,
    rad_per_km: f64,
}

impl LoopCloser {
    /// Closes a loop if one that waits says the same; else it waits itself.
    pub(super) fn accept(&mut self, edge: LoopEdge) -> LoopOutcome {
        let travelled_m = self.keyframe(edge.to).map_or(0.0, |now| now.travelled_m);
        let most_m = self.config.confirmation_m;
        let is_near = |waiting: &LoopEdge| {
            self.keyframe(waiting.to).is_some_and(|then| travelled_m - then.travelled_m <= most_m)
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
                self.closed_at_m = Some(travelled_m);
                LoopOutcome::Closed(closed)
            }
            Err(reason) => LoopOutcome::Refused(reason),
        }
    }

    fn keyframe(&self, number: usize) -> Option<&Keyframe> {
        self.keyframes.get(number.checked_sub(self.forgotten)?)
    }

    /// Whether the motion from the one to the other keyframe is the same by the loops as by the odometry.
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
        // A loop is accepted within the largest drift of the odometry.
        let tried =
            optimise(&self.graph(&new, true, self.worst_drift()), &self.config.graph, &|| false)?;
        let statuses = tried.edges.iter().rev().zip(new.iter().rev());
        // All of them or none: they have confirmed each other.
        if let Some((status, _)) = statuses.clone().find(|(status, _)| !status.is_used) {
            return Err(NotALoop::Contradicted { chi2: status.chi2 });
        }
        // By how much each is heeded is by what the odometry has been seen to drift.
        let drift = self.seen_drift(&new);
        let optimised = optimise(&self.graph(&new, false, drift), &self.config.graph, &|| false)?;
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
            travelled_m: to.zip(then).map_or(0.0, |(now, then)| now.travelled_m - then.travelled_m),
            gap_m: gap.translation.vector.norm(),
            gap_rad: gap.rotation.angle(),
            fit_share: edge.fit_share,
        })
    }

    fn worst_drift(&self) -> Drift {
        let LoopClosingConfig { drift_m_per_km, drift_deg_per_km, .. } = self.config;
        Drift { m_per_km: drift_m_per_km, rad_per_km: drift_deg_per_km.to_radians() }
    }

    /// The drift that the loops show against the odometry between them, at most the worst one: an odometry that drifts
    /// by centimetres has the motion more accurately than a scan registered to a place has its tilt.
    fn seen_drift(&self, new: &[LoopEdge]) -> Drift {
        /// Two or three loops determine the order of magnitude only.
        const LEAST_SHARE: f64 = 0.02;
        /// A drift is along each of three axes alike.
        const AXES: f64 = 3.0;
        let worst = self.worst_drift();
        let (mut sums, mut count) = ((0.0, 0.0), 0.0_f64);
        for edge in self.loops.iter().chain(new) {
            let ends = self.keyframe(edge.from).zip(self.keyframe(edge.to));
            let Some((from, to)) = ends else { continue };
            let odometry = from.odom_from_vehicle.inv_mul(&to.odom_from_vehicle);
            let missed = odometry.inv_mul(&edge.from_to);
            let km = ((to.travelled_m - from.travelled_m) / 1000.0).max(f64::MIN_POSITIVE);
            sums.0 += missed.translation.vector.norm_squared() / (AXES * km);
            sums.1 += missed.rotation.angle().powi(2) / (AXES * km);
            count += 1.0;
        }
        let seen =
            |sum: f64, worst: f64| (sum / count.max(1.0)).sqrt().clamp(LEAST_SHARE * worst, worst);
        Drift { m_per_km: seen(sums.0, worst.m_per_km), rad_per_km: seen(sums.1, worst.rad_per_km) }
    }

    /// The first keyframe stays where it is. The new loops stand last.
    fn graph(&self, new: &[LoopEdge], may_be_wrong: bool, drift: Drift) -> PoseGraph {
        let poses = self.keyframes.iter().map(|keyframe| keyframe.map_from_vehicle).collect();
        let mut graph = PoseGraph { poses, is_fixed: vec![true], edges: Vec::new() };
        let pairs = self.keyframes.iter().zip(self.keyframes.iter().skip(1));
        for (from, (earlier, later)) in pairs.enumerate() {
            let km = ((later.travelled_m - earlier.travelled_m) / 1000.0).max(f64::MIN_POSITIVE);
            let certain = information(drift.m_per_km, drift.rad_per_km);
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
        graph.edges.extend(new.iter().map(|edge| of_loop(edge, may_be_wrong)));
        graph
    }
}
