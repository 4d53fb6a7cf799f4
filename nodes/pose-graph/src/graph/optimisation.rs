//! The steps.

use estimation::perturbation::is_rigid;
use estimation::perturbation::right::perturbed;
use nalgebra::{Isometry3, Vector6};

use super::{Edge, EdgeStatus, GraphConfig, GraphError, OptimisedGraph, PoseGraph};
use crate::blocks::BlockSystem;

/// The damping begins here (Madsen, Nielsen and Tingleff 2004, section 3.2) ...
const FIRST_DAMPING: f64 = 1e-6;
/// ... and ends the descent here: no step is short enough.
const LAST_DAMPING: f64 = 1e12;
/// A step that lowers the cost divides the damping by this, one that does not multiplies it (Marquardt 1963).
const DAMPING_FACTOR: f64 = 10.0;
/// A node that no edge holds is held by this share of the largest information, times the damping.
const LEAST_DIAGONAL: f64 = 1e-9;
/// The descent ends where a step lowers the cost by no more than this share.
const SETTLED: f64 = 1e-9;

/// Finds the poses that explain the edges best. Fixed nodes, and those that no chain of edges connects to a fixed
/// one, stay where they are. `is_aborted` is called before every step.
///
/// The same graph gives the same result, bit for bit.
///
/// # Errors
/// When an edge or a parameter cannot be used, and when nothing is fixed.
pub fn optimise(
    graph: &PoseGraph,
    config: &GraphConfig,
    is_aborted: &dyn Fn() -> bool,
) -> Result<OptimisedGraph, GraphError> {
    config.validate()?;
    graph.check()?;
    let mut search = Search::new(graph, config, is_aborted);
    search.descend();
    search.choose();
    let status = |(edge, is_used): (&Edge, &bool)| EdgeStatus {
        chi2: edge.chi2(&search.poses),
        is_used: *is_used,
    };
    Ok(OptimisedGraph {
        edges: graph.edges.iter().zip(&search.is_used).map(status).collect(),
        chi2_before: search.cost_at(&graph.poses),
        chi2: search.cost(),
        iterations: search.iterations,
        was_aborted: search.was_aborted,
        poses: search.poses,
    })
}

impl PoseGraph {
    fn check(&self) -> Result<(), GraphError> {
        let nodes = self.poses.len();
        if let Some(index) = self.poses.iter().position(|pose| !is_rigid(pose)) {
            return Err(GraphError::NotFinite { what: "node", index });
        }
        for (index, edge) in self.edges.iter().enumerate() {
            let (from, to) = (edge.from, edge.to);
            if from == to || from.max(to) >= nodes {
                return Err(GraphError::Edge { edge: index, from, to, nodes });
            }
            let of_information = edge.information.iter().copied().all(f64::is_finite);
            if !(of_information && is_rigid(&edge.from_to)) {
                return Err(GraphError::NotFinite { what: "edge", index });
            }
            let value = edge.information.diagonal().min();
            if value < 0.0 {
                return Err(GraphError::Information { edge: index, value });
            }
        }
        if nodes > 0 && !self.is_fixed.iter().take(nodes).any(|is_fixed| *is_fixed) {
            return Err(GraphError::NothingFixed { nodes });
        }
        Ok(())
    }

    /// The unknown that each node is: those that are not fixed, and that edges tie to a fixed one.
    fn unknowns(&self) -> Vec<Option<usize>> {
        let nodes = self.poses.len();
        let mut tied: Vec<Vec<usize>> = vec![Vec::new(); nodes];
        for edge in &self.edges {
            tied[edge.from].push(edge.to);
            tied[edge.to].push(edge.from);
        }
        let is_fixed = |node: usize| self.is_fixed.get(node).copied().unwrap_or(false);
        let mut is_reached: Vec<bool> = (0..nodes).map(is_fixed).collect();
        let mut ahead: Vec<usize> = (0..nodes).filter(|node| is_fixed(*node)).collect();
        while let Some(node) = ahead.pop() {
            for &next in &tied[node] {
                if !is_reached[next] {
                    is_reached[next] = true;
                    ahead.push(next);
                }
            }
        }
        let mut count = 0;
        let mut unknown = |node: usize| {
            let is_unknown = is_reached[node] && !is_fixed(node);
            count += usize::from(is_unknown);
            is_unknown.then(|| count - 1)
        };
        (0..nodes).map(&mut unknown).collect()
    }
}

struct Search<'a> {
    graph: &'a PoseGraph,
    config: &'a GraphConfig,
    is_aborted: &'a dyn Fn() -> bool,
    unknowns: Vec<Option<usize>>,
    system: BlockSystem,
    poses: Vec<Isometry3<f64>>,
    is_used: Vec<bool>,
    iterations: usize,
    was_aborted: bool,
}

impl<'a> Search<'a> {
    fn new(
        graph: &'a PoseGraph,
        config: &'a GraphConfig,
        is_aborted: &'a dyn Fn() -> bool,
    ) -> Self {
        let unknowns = graph.unknowns();
        let tied = graph.edges.iter().filter_map(|edge| unknowns[edge.from].zip(unknowns[edge.to]));
        let system = BlockSystem::new(unknowns.iter().flatten().count(), tied);
        Self {
            graph,
            config,
            is_aborted,
            system,
            poses: graph.poses.clone(),
            is_used: graph.edges.iter().map(|edge| !edge.is_doubtful).collect(),
            iterations: 0,
            was_aborted: false,
            unknowns,
        }
    }

    fn used(&self) -> impl Iterator<Item = &'a Edge> {
        let edges = self.graph.edges.iter().zip(&self.is_used);
        edges.filter_map(|(edge, is_used)| is_used.then_some(edge))
    }

    fn cost(&self) -> f64 {
        self.cost_at(&self.poses)
    }

    fn cost_at(&self, poses: &[Isometry3<f64>]) -> f64 {
        self.used().map(|edge| edge.chi2(poses)).sum()
    }

    /// Decides which doubtful edges are used. Each is tried alone first, and those that the certain edges contradict least
    /// are taken in first; each of them must agree with those before, too.
    fn choose(&mut self) {
        let doubtful: Vec<usize> =
            (0..self.is_used.len()).filter(|edge| !self.is_used[*edge]).collect();
        let mut candidates = Vec::new();
        let start = self.state();
        for edge in doubtful {
            let rise = self.rise(edge, &start);
            self.restore(&start);
            self.is_used[edge] = false;
            if rise <= self.config.max_rise_chi2 {
                candidates.push((rise, edge));
            }
        }
        candidates.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
        for (_, edge) in candidates {
            let before = self.state();
            if self.rise(edge, &before) > self.config.max_rise_chi2 {
                self.restore(&before);
                self.is_used[edge] = false;
            }
        }
    }

    /// By how much the sum of squared errors rises when an edge is used too; infinite when the search was stopped.
    fn rise(&mut self, edge: usize, before: &(Vec<Isometry3<f64>>, f64)) -> f64 {
        self.is_used[edge] = true;
        let after = self.descend();
        if self.was_aborted { f64::INFINITY } else { after - before.1 }
    }

    fn state(&self) -> (Vec<Isometry3<f64>>, f64) {
        (self.poses.clone(), self.cost())
    }

    fn restore(&mut self, state: &(Vec<Isometry3<f64>>, f64)) {
        self.poses.clone_from(&state.0);
    }

    /// Lowers the cost of the used edges. Returns what it is then.
    fn descend(&mut self) -> f64 {
        let mut cost = self.cost();
        let mut damping = FIRST_DAMPING;
        let mut steps = 0;
        while steps < self.config.iterations && !self.was_aborted {
            if (self.is_aborted)() {
                self.was_aborted = true;
                break;
            }
            steps += 1;
            self.linearise();
            let before = cost;
            while damping < LAST_DAMPING {
                let mut damped = self.system.clone();
                damped.damp(damping, LEAST_DIAGONAL * self.system.largest_diagonal());
                let there = damped.solve().map(|step| self.stepped(&step));
                let better = there.map(|poses| (self.cost_at(&poses), poses));
                if let Some((lower, poses)) = better.filter(|(there, _)| *there < cost) {
                    (cost, self.poses) = (lower, poses);
                    damping = (damping / DAMPING_FACTOR).max(f64::MIN_POSITIVE);
                    break;
                }
                damping *= DAMPING_FACTOR;
            }
            self.iterations += 1;
            if before - cost <= SETTLED * before {
                break;
            }
        }
        cost
    }

    fn stepped(&self, step: &[Vector6<f64>]) -> Vec<Isometry3<f64>> {
        let moved = self.poses.iter().zip(&self.unknowns).map(|(pose, unknown)| {
            let step = unknown.and_then(|unknown| step.get(unknown));
            step.map_or(*pose, |step| perturbed(pose, step))
        });
        moved.collect()
    }

    /// The normal equations at the poses.
    fn linearise(&mut self) {
        self.system.clear();
        let used: Vec<&Edge> = self.used().collect();
        for edge in used {
            let at = edge.linearised(&self.poses);
            let information = edge.information;
            let (from, to) = (self.unknowns[edge.from], self.unknowns[edge.to]);
            let (of_from, of_to) =
                (at.by_from.transpose() * information, at.by_to.transpose() * information);
            if let Some(from) = from {
                self.system.add(from, from, &(of_from * at.by_from));
                self.system.add_right(from, &(of_from * -at.error));
            }
            if let Some(to) = to {
                self.system.add(to, to, &(of_to * at.by_to));
                self.system.add_right(to, &(of_to * -at.error));
            }
            if let Some((from, to)) = from.zip(to) {
                self.system.add(from, to, &(of_from * at.by_to));
            }
        }
    }
}
