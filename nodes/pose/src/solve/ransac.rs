//! The pose without a guess: random sample consensus (Fischler and Bolles 1981).
//!
//! Three points with depths give a pose by [`rigid_alignment`], at once and without a choice of roots; a step of least
//! squares over the three then weighs depths against pixels. Three points without depths give up to four poses by
//! [`p3p`]. Poses are compared by truncated squared errors (MSAC: Torr and Zisserman 2000), each as far as it
//! can still be the best; a new best one is refined by its inliers (Chum, Matas and Kittler 2003).

#[cfg(test)]
mod tests;

use estimation::Random;
use geometry::CameraModel;
use nalgebra::{Isometry3, Matrix6, Point3, Vector3};

use super::config::{FirstRound, RansacConfig, RefineConfig, RobustKernel};
use super::observation::{PointObservation, Verdict};
use super::p3p::p3p;
use super::refine::{Plan, PoseError, PoseEstimate, PoseGuess, Problem, Uses, check_camera};
use super::rigid_alignment::rigid_alignment;

/// Points of a sample.
const SAMPLE: usize = 3;
/// Steps over a sample, and over the inliers of a pose that is the best so far.
const POLISHING_STEPS: usize = 3;
/// A sample may miss a point by this many times the usual limit (of squared errors) to be refined by: it is of three noisy
/// points only.
const SAMPLE_GATE: f64 = 4.0;

/// How the poses of samples were found.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MinimalSolver {
    /// By three points with depths.
    RigidAlignment,
    /// By three directions.
    P3p,
}

/// A pose that was found without a guess.
#[derive(Clone, PartialEq, Debug)]
pub struct PnpEstimate {
    /// The pose, refined by all that it explains.
    pub pose: PoseEstimate,
    /// How samples gave poses.
    pub solver: MinimalSolver,
    /// Samples that were drawn.
    pub iterations: usize,
}

/// No pose was found.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum PnpError {
    /// The camera or a parameter cannot be used, or the best pose could not be refined.
    #[error(transparent)]
    Pose(#[from] PoseError),
    /// Too few points.
    #[error("{usable} of {points} points can be used: at least {needed} are needed")]
    TooFewPoints {
        /// Points that can be used.
        usable: usize,
        /// Points that were given.
        points: usize,
        /// The number needed.
        needed: usize,
    },
    /// The best pose explains too few points.
    #[error(
        "after {iterations} samples the best pose explains {inliers} of {usable} points: at least {needed} are needed"
    )]
    NoConsensus {
        /// The number that the best pose explains.
        inliers: usize,
        /// Points that can be used.
        usable: usize,
        /// The number needed.
        needed: usize,
        /// Samples that were drawn.
        iterations: usize,
    },
}

/// Finds the pose that explains the most points, without a guess; `refine` says how it is refined, but for its `first_round`.
///
/// The same points and the same seed give the same result, bit for bit.
///
/// # Errors
/// When the camera or a parameter cannot be used, and when no pose explains `min_inliers` points.
pub fn pnp_ransac(
    camera: &CameraModel,
    points: &[PointObservation],
    config: &RansacConfig,
    refine: &RefineConfig,
) -> Result<PnpEstimate, PnpError> {
    config.validate().and_then(|()| refine.validate()).map_err(PoseError::from)?;
    check_camera(camera)?;
    let refine = RefineConfig { first_round: FirstRound::FitsGuess, ..*refine };
    let problem = Problem::new(camera, points, &[], &refine);
    let usable = problem.usable();
    let best = Search::new(camera, points, &problem, &usable, config)?.run();
    let needed = config.min_inliers;
    let (usable, iterations) = (usable.inliers(), best.iterations);
    let no_consensus = |inliers| PnpError::NoConsensus { inliers, usable, needed, iterations };
    if best.inliers < needed {
        return Err(no_consensus(best.inliers));
    }
    let guess = PoseGuess { camera_from_map: best.camera_from_map, covariance: None };
    let pose = problem.estimate(&guess)?;
    if pose.point_inliers() < needed {
        return Err(no_consensus(pose.point_inliers()));
    }
    Ok(PnpEstimate { pose, solver: best.solver, iterations })
}

/// The best pose of a search.
pub(super) struct Best {
    pub(super) camera_from_map: Isometry3<f64>,
    pub(super) inliers: usize,
    pub(super) iterations: usize,
    pub(super) solver: MinimalSolver,
    cost: f64,
}

/// A search among the points that are in `searched`.
pub(super) struct Search<'a> {
    camera: &'a CameraModel,
    points: &'a [PointObservation],
    problem: &'a Problem<'a>,
    config: &'a RansacConfig,
    searched: &'a Uses,
    /// Samples are drawn among these.
    pool: Vec<usize>,
    solver: MinimalSolver,
}

impl<'a> Search<'a> {
    pub(super) fn new(
        camera: &'a CameraModel,
        points: &'a [PointObservation],
        problem: &'a Problem<'a>,
        searched: &'a Uses,
        config: &'a RansacConfig,
    ) -> Result<Self, PnpError> {
        let used = |index: &usize| searched.points[*index].is_inlier();
        let usable: Vec<usize> = (0..points.len()).filter(used).collect();
        if usable.len() < config.min_inliers {
            let (usable, needed) = (usable.len(), config.min_inliers);
            return Err(PnpError::TooFewPoints { usable, points: points.len(), needed });
        }
        let deep = |index: &usize| points[*index].depth_m.is_some();
        let with_depth: Vec<usize> = usable.iter().copied().filter(deep).collect();
        let share = with_depth.len() as f64 / usable.len() as f64;
        let (pool, solver) = if with_depth.len() >= SAMPLE && share >= config.min_depth_share {
            (with_depth, MinimalSolver::RigidAlignment)
        } else {
            (usable, MinimalSolver::P3p)
        };
        Ok(Self { camera, points, problem, config, searched, pool, solver })
    }

    /// Draws samples until a better pose is unlikely.
    pub(super) fn run(&self) -> Best {
        let mut random = Random::new(self.config.seed);
        let mut best = Best {
            camera_from_map: Isometry3::identity(),
            inliers: 0,
            iterations: 0,
            solver: self.solver,
            cost: f64::INFINITY,
        };
        let searched = self.searched.inliers();
        let mut wanted = self.config.max_iterations;
        while best.iterations < wanted {
            let Some(sample) = random.three_below(self.pool.len()) else { break };
            best.iterations += 1;
            let better = self.poses_of(sample.map(|drawn| self.pool[drawn]), &mut best);
            if better {
                let ratio = best.inliers as f64 / searched as f64;
                if ratio >= self.config.enough_inlier_ratio {
                    break;
                }
                wanted = self.wanted(ratio).min(self.config.max_iterations);
            }
        }
        best
    }

    /// Samples after which one without outliers has been drawn with the wanted probability (Fischler and Bolles 1981,
    /// section II-B).
    fn wanted(&self, inlier_ratio: f64) -> usize {
        let all_right = inlier_ratio.powi(SAMPLE as i32);
        // A float too large for an integer becomes the largest one, and NaN zero; the ratio is neither 0 nor 1 here.
        ((1.0 - self.config.confidence).ln() / (-all_right).ln_1p()).ceil() as usize
    }

    /// Compares the poses of a sample with the best. Whether one is better.
    fn poses_of(&self, sample: [usize; SAMPLE], best: &mut Best) -> bool {
        let mut better = false;
        match self.solver {
            MinimalSolver::RigidAlignment => {
                if let Some(pose) = self.aligned(sample) {
                    better |= self.compare(pose, best);
                }
            }
            MinimalSolver::P3p => {
                let in_map = sample.map(|index| self.points[index].point_in_map_m);
                let Some(rays) = self.rays(sample) else { return false };
                for pose in p3p(&in_map, &rays) {
                    better |= self.compare(pose, best);
                }
            }
        }
        better
    }

    fn rays(&self, sample: [usize; SAMPLE]) -> Option<[Vector3<f64>; SAMPLE]> {
        let ray = |index: usize| Some(self.camera.ray(&self.points[index].pixel_px)?.push(1.0));
        Some([ray(sample[0])?, ray(sample[1])?, ray(sample[2])?])
    }

    /// The pose of three points with depths.
    fn aligned(&self, sample: [usize; SAMPLE]) -> Option<Isometry3<f64>> {
        let rays = self.rays(sample)?;
        let mut in_camera = [Point3::origin(); SAMPLE];
        for ((place, index), ray) in in_camera.iter_mut().zip(sample).zip(rays) {
            *place = Point3::from(ray * self.points[index].depth_m?);
        }
        let in_map = sample.map(|index| self.points[index].point_in_map_m);
        let aligned = rigid_alignment(&in_map, &in_camera).ok()?;
        let of_sample = self.problem.of_points(&sample);
        Some(polished(&of_sample, &aligned.target_from_source, &of_sample.usable()))
    }

    /// Takes a pose for the best when it is, refined by what it explains.
    fn compare(&self, pose: Isometry3<f64>, best: &mut Best) -> bool {
        let Some((cost, inliers)) = self.problem.truncated_cost(&pose, self.searched, best.cost)
        else {
            return false;
        };
        (best.camera_from_map, best.cost, best.inliers) = (pose, cost, inliers);
        let mut near = self.problem.judged(&pose, SAMPLE_GATE);
        for (verdict, searched) in near.points.iter_mut().zip(&self.searched.points) {
            if !searched.is_inlier() {
                *verdict = Verdict::Outlier;
            }
        }
        let refined = polished(self.problem, &pose, &near);
        let of_refined = self.problem.truncated_cost(&refined, self.searched, cost);
        if let Some((cost, inliers)) = of_refined {
            (best.camera_from_map, best.cost, best.inliers) = (refined, cost, inliers);
        }
        true
    }
}

/// A pose after a few steps along all directions, observable or not.
fn polished(problem: &Problem<'_>, pose: &Isometry3<f64>, uses: &Uses) -> Isometry3<f64> {
    let nothing = Matrix6::zeros();
    let plan = Plan {
        kernel: RobustKernel::Huber,
        noise: 1.0,
        held: Some(&nothing),
        steps: POLISHING_STEPS,
    };
    problem.descend(pose, uses, plan).pose
}
