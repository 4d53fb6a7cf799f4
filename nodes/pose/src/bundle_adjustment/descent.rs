//! The steps.

use std::collections::BTreeSet;

use estimation::perturbation::left::perturbed;
use geometry::CameraModel;
use nalgebra::{Isometry3, Point3};
use pose_graph::blocks::BlockSystem;

use super::problem::{Cameras, Gates, Kind, State, Uses};
use super::{Bundle, BundleConfig, Motion};
use crate::solve::RobustKernel;
use crate::solve::term::{LineTerm, PointTerm};

/// The damping begins here (Madsen, Nielsen and Tingleff 2004, section 3.2) ...
const FIRST_DAMPING: f64 = 1e-6;
/// ... and ends the descent here: no step is short enough.
const LAST_DAMPING: f64 = 1e6;
/// A step that lowers the cost divides the damping by this, one that does not multiplies it (Marquardt 1963).
const DAMPING_FACTOR: f64 = 10.0;
/// A pose that no observation constrains is held by this share of the largest information, times the damping.
const LEAST_DIAGONAL: f64 = 1e-9;
/// The descent ends where a step lowers the cost by no more than this share.
const SETTLED: f64 = 1e-6;

/// A bundle during the descent.
pub(super) struct Search<'a> {
    config: &'a BundleConfig,
    is_aborted: &'a dyn Fn() -> bool,
    models: Vec<CameraModel>,
    /// The unknown that each pose is; `None` for those that are fixed or see nothing.
    unknowns: Vec<Option<usize>>,
    points: Kind<3, Point3<f64>>,
    lines: Kind<4, [Point3<f64>; 2]>,
    motions: Vec<Motion>,
    gates: Gates,
    system: BlockSystem,
    pub(super) state: State,
    pub(super) iterations: usize,
    pub(super) was_aborted: bool,
}

impl<'a> Search<'a> {
    pub(super) fn new(
        bundle: &Bundle,
        config: &'a BundleConfig,
        is_aborted: &'a dyn Fn() -> bool,
    ) -> Self {
        let models: Vec<CameraModel> = bundle.poses.iter().map(|pose| pose.camera).collect();
        let points = Kind::new(&bundle.point_sightings, bundle.points_m.len(), |sighting| {
            PointTerm::new(&crate::solve::PointObservation {
                point_in_map_m: bundle.points_m[sighting.landmark],
                ..sighting.seen
            })
        });
        let lines = Kind::new(&bundle.line_sightings, bundle.lines_m.len(), |sighting| {
            let [start_in_map_m, end_in_map_m] = bundle.lines_m[sighting.landmark];
            let seen =
                crate::solve::LineObservation { start_in_map_m, end_in_map_m, ..sighting.seen };
            LineTerm::new(&models[sighting.pose], &seen)
        });
        let (unknowns, tied) = unknowns(bundle, &points, &lines);
        Self {
            config,
            is_aborted,
            system: BlockSystem::new(unknowns.iter().flatten().count(), tied),
            unknowns,
            gates: Gates::new(config.inlier_probability),
            state: State {
                poses: bundle.poses.iter().map(|pose| pose.camera_from_map).collect(),
                points_m: bundle.points_m.clone(),
                lines_m: bundle.lines_m.clone(),
            },
            models,
            points,
            lines,
            motions: bundle.motions.clone(),
            iterations: 0,
            was_aborted: false,
        }
    }

    pub(super) fn usable(&self) -> Uses {
        Uses { points: self.points.usable(), lines: self.lines.usable() }
    }

    pub(super) fn judged(&self) -> Uses {
        let cameras = Cameras::new(&self.models, &self.state.poses);
        let (gates, keep) = (&self.gates, self.config.keep_without_depth);
        Uses {
            points: self.points.judged(&self.state.points_m, &cameras, gates, keep),
            lines: self.lines.judged(&self.state.lines_m, &cameras, gates, keep),
        }
    }

    /// The cost of the sightings under the kernel.
    pub(super) fn cost(&self, uses: &Uses) -> f64 {
        self.cost_at(&self.state, uses, self.config.kernel)
    }

    fn cost_at(&self, state: &State, uses: &Uses, kernel: RobustKernel) -> f64 {
        let cameras = Cameras::new(&self.models, &state.poses);
        let weigh = (kernel, &self.gates);
        let (kernel, gate) = (self.config.motion_kernel, self.gates.of_motions());
        let motions = self.motions.iter().map(|motion| motion.cost(&state.poses, kernel, gate));
        self.points.cost(&state.points_m, &cameras, &uses.points, weigh)
            + self.lines.cost(&state.lines_m, &cameras, &uses.lines, weigh)
            + motions.sum::<f64>()
    }

    /// Lowers the cost of what is used.
    pub(super) fn descend(&mut self, uses: &Uses, kernel: RobustKernel, iterations: usize) {
        let mut cost = self.cost_at(&self.state, uses, kernel);
        let mut damping = FIRST_DAMPING;
        for _ in 0..iterations {
            self.was_aborted = self.was_aborted || (self.is_aborted)();
            if self.was_aborted {
                return;
            }
            let before = cost;
            (cost, damping) = self.step(uses, kernel, (cost, damping));
            self.iterations += 1;
            if before - cost <= SETTLED * before {
                return;
            }
        }
    }

    /// One step, shorter and shorter till it lowers the cost. Returns what the cost and the damping are then.
    fn step(
        &mut self,
        uses: &Uses,
        kernel: RobustKernel,
        (cost, mut damping): (f64, f64),
    ) -> (f64, f64) {
        self.system.clear();
        let cameras = Cameras::new(&self.models, &self.state.poses);
        let (weigh, unknowns) = ((kernel, &self.gates), &self.unknowns);
        let (state, system) = (&self.state, &mut self.system);
        let points = self.points.linearised(
            &state.points_m,
            &cameras,
            &uses.points,
            weigh,
            unknowns,
            system,
        );
        let lines =
            self.lines.linearised(&state.lines_m, &cameras, &uses.lines, weigh, unknowns, system);
        let (kernel, gate) = (self.config.motion_kernel, self.gates.of_motions());
        for motion in &self.motions {
            motion.linearise(&self.state.poses, kernel, gate, &self.unknowns, &mut self.system);
        }
        let least = LEAST_DIAGONAL * self.system.largest_diagonal();
        while damping < LAST_DAMPING {
            let mut system = self.system.clone();
            system.damp(damping, least);
            let of_points = points.eliminate(damping, &mut system);
            let of_lines = lines.eliminate(damping, &mut system);
            if let Some(steps) = system.solve() {
                let there = State {
                    poses: self.stepped(&steps),
                    points_m: points.corrected(&self.state.points_m, &of_points, &steps),
                    lines_m: lines.corrected(&self.state.lines_m, &of_lines, &steps),
                };
                let lower = self.cost_at(&there, uses, kernel);
                if lower < cost {
                    self.state = there;
                    return (lower, damping / DAMPING_FACTOR);
                }
            }
            damping *= DAMPING_FACTOR;
        }
        (cost, FIRST_DAMPING)
    }

    fn stepped(&self, steps: &[nalgebra::Vector6<f64>]) -> Vec<Isometry3<f64>> {
        let poses = self.state.poses.iter().zip(&self.unknowns).map(|(pose, unknown)| {
            let step = unknown.and_then(|unknown| steps.get(unknown));
            step.map_or(*pose, |step| perturbed(pose, step))
        });
        poses.collect()
    }
}

/// The unknown that each pose is, and which unknowns see some landmark both.
fn unknowns(
    bundle: &Bundle,
    points: &Kind<3, Point3<f64>>,
    lines: &Kind<4, [Point3<f64>; 2]>,
) -> (Vec<Option<usize>>, BTreeSet<(usize, usize)>) {
    let mut sees = vec![false; bundle.poses.len()];
    for pose in points.seen_from().flatten().chain(lines.seen_from().flatten()) {
        sees[pose] = true;
    }
    for motion in &bundle.motions {
        sees[motion.from] = true;
        sees[motion.to] = true;
    }
    let mut count = 0;
    let mut unknown = |(pose, sees): (&super::BundlePose, &bool)| {
        let is_unknown = *sees && !pose.is_fixed;
        count += usize::from(is_unknown);
        is_unknown.then(|| count - 1)
    };
    let unknowns: Vec<Option<usize>> = bundle.poses.iter().zip(&sees).map(&mut unknown).collect();
    let mut tied = BTreeSet::new();
    let mut tie = |poses: &mut dyn Iterator<Item = usize>| {
        let seen_from: Vec<usize> = poses.filter_map(|pose| unknowns[pose]).collect();
        for (index, one) in seen_from.iter().enumerate() {
            tied.extend(seen_from[index + 1..].iter().map(|other| (*one, *other)));
        }
    };
    points.seen_from().for_each(|mut poses| tie(&mut poses));
    lines.seen_from().for_each(|mut poses| tie(&mut poses));
    for motion in &bundle.motions {
        tie(&mut [motion.from, motion.to].into_iter());
    }
    (unknowns, tied)
}
