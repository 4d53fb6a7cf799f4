//! The most likely pose near a guess.
//!
//! Levenberg-Marquardt over the reprojection errors of points and lines and the errors of their depths, under a robust
//! kernel at first; after each round outliers are decided again, as in ORB-SLAM2 (Mur-Artal and Tardos 2017,
//! section III-C). Along directions that the observations do not determine, no step is taken (Zhang, Kaess and Singh 2016).

mod descent;
mod noise;
mod problem;
#[cfg(test)]
mod tests;

use estimation::covariance::{of_std_devs, propagated, scaled};
use estimation::observability::to_one_unit;
use estimation::perturbation::is_rigid;
use estimation::perturbation::left::{adjoint, perturbation_between, perturbed};
use geometry::{CameraModel, CameraModelError, ParameterError};
use nalgebra::{Isometry3, Matrix6};

use super::Observability;
use super::config::{FirstRound, NoiseScale, RefineConfig, RobustKernel};
use super::observation::{LineObservation, PointObservation, Verdict};

pub(super) use descent::Plan;
pub(super) use problem::{Problem, Uses};

/// No guess is farther from the origin of the map: there a coordinate still has steps of a tenth of a micrometre.
const FARTHEST_GUESS_M: f64 = 1e9;

/// Where the camera is thought to be.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PoseGuess {
    /// The pose.
    pub camera_from_map: Isometry3<f64>,
    /// The covariance of its perturbation (see [`estimation::perturbation::left`]), when somebody knows.
    pub covariance: Option<Matrix6<f64>>,
}

/// A pose by what the camera sees.
#[derive(Clone, PartialEq, Debug)]
pub struct PoseEstimate {
    /// The pose.
    pub camera_from_map: Isometry3<f64>,
    /// The covariance of its perturbation (see [`estimation::perturbation::left`]). Along the directions that were not estimated
    /// it is that of the guess.
    pub covariance: Matrix6<f64>,
    /// The status of each point.
    pub points: Vec<Verdict>,
    /// The status of each line.
    pub lines: Vec<Verdict>,
    /// The sum of the squared errors of the inliers, in stated standard deviations.
    pub chi2: f64,
    /// How many errors these are, less the directions that were estimated; 0 when there are no more.
    pub freedom: usize,
    /// By this the stated variances were multiplied: 1 for [`NoiseScale::Given`].
    pub variance_factor: f64,
    /// Rounds that it took.
    pub rounds: usize,
    /// Steps of all rounds.
    pub iterations: usize,
    /// Which directions were estimated. Along the others the pose is that of the guess.
    pub observability: Observability,
}

impl PoseEstimate {
    /// Points that the pose explains.
    #[must_use]
    pub fn point_inliers(&self) -> usize {
        self.points.iter().filter(|verdict| verdict.is_inlier()).count()
    }

    /// Lines that the pose explains.
    #[must_use]
    pub fn line_inliers(&self) -> usize {
        self.lines.iter().filter(|verdict| verdict.is_inlier()).count()
    }
}

/// There is no pose.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum PoseError {
    /// A parameter means nothing.
    #[error(transparent)]
    Config(#[from] ParameterError),
    /// The camera's numbers describe no camera.
    #[error(transparent)]
    Camera(#[from] CameraModelError),
    /// The camera has lens distortion.
    #[error(
        "the camera has lens distortion: features and camera must be those of the rectified image"
    )]
    NotRectified,
    /// The guess has a number that is not finite, or a negative variance.
    #[error(
        "the guess of the pose or its covariance has a number that is not finite, or a negative variance"
    )]
    Guess,
    /// No observation can be used.
    #[error("none of {points} points and {lines} lines can be used")]
    NothingSeen {
        /// Points that were given.
        points: usize,
        /// Lines that were given.
        lines: usize,
    },
    /// No pose near the guess explains any observation.
    #[error("no pose near the guess explains any of {usable} observations")]
    NothingFits {
        /// Observations that could be used.
        usable: usize,
    },
}

/// Finds the pose near a guess that explains points and lines best.
///
/// A few observations are enough: directions that they do not determine are listed in `observability` and left as the guess
/// has it. The same input gives the same result, bit for bit.
///
/// # Errors
/// When the camera, the guess or a parameter cannot be used; when there is nothing to go by.
pub fn refine_pose(
    camera: &CameraModel,
    guess: &PoseGuess,
    points: &[PointObservation],
    lines: &[LineObservation],
    config: &RefineConfig,
) -> Result<PoseEstimate, PoseError> {
    config.validate()?;
    check_camera(camera)?;
    guess.check()?;
    Problem::new(camera, points, lines, config).estimate(guess)
}

/// The information of observations about the perturbation of a pose that explains all of them: 1/m^2, 1/rad^2 and mixed. Those that
/// cannot be used add nothing.
#[must_use]
pub fn information_at(
    camera: &CameraModel,
    camera_from_map: &Isometry3<f64>,
    points: &[PointObservation],
    lines: &[LineObservation],
    config: &RefineConfig,
) -> Matrix6<f64> {
    let problem = Problem::new(camera, points, lines, config);
    problem.information_of_inliers(camera_from_map, &problem.usable())
}

pub(crate) fn check_camera(camera: &CameraModel) -> Result<(), PoseError> {
    camera.validate()?;
    if camera.distortion.is_none() { Ok(()) } else { Err(PoseError::NotRectified) }
}

impl PoseGuess {
    pub(super) fn check(&self) -> Result<(), PoseError> {
        let covariance_holds = self.covariance.is_none_or(|covariance| {
            covariance.iter().all(|value| value.is_finite())
                && covariance.diagonal().iter().all(|variance| *variance >= 0.0)
        });
        let near = self.camera_from_map.translation.vector.amax() < FARTHEST_GUESS_M;
        if covariance_holds && near && is_rigid(&self.camera_from_map) {
            Ok(())
        } else {
            Err(PoseError::Guess)
        }
    }
}

impl Problem<'_> {
    /// All rounds.
    pub(super) fn estimate(&self, guess: &PoseGuess) -> Result<PoseEstimate, PoseError> {
        let usable = self.usable();
        let (points, lines) = usable.lengths();
        if usable.inliers() == 0 {
            return Err(PoseError::NothingSeen { points, lines });
        }
        let nothing_fits = PoseError::NothingFits { usable: usable.inliers() };
        let mut pose = guess.camera_from_map;
        let mut uses = match self.config.first_round {
            FirstRound::Everything => usable,
            FirstRound::FitsGuess => self.judged(&pose, self.noise(&pose, &usable)),
        };
        let (mut iterations, mut rounds) = (0, 0);
        while rounds < self.config.rounds {
            let robust = rounds < self.config.kernel_rounds;
            let kernel = if robust { self.config.kernel } else { RobustKernel::None };
            let descent = self.descend(&pose, &uses, self.plan(kernel, self.noise(&pose, &uses)));
            (pose, iterations, rounds) = (descent.pose, iterations + descent.steps, rounds + 1);
            let judged = self.judged(&pose, self.noise(&pose, &uses));
            let settled = !robust && judged == uses;
            uses = judged;
            if uses.inliers() == 0 {
                return Err(nothing_fits);
            }
            if settled {
                break;
            }
        }
        let mut noise = self.final_noise(&pose, &uses);
        let mut observability = self.observability(&pose, &uses, noise);
        if observability.estimated() < 6 {
            // What a step at a worse pose may have moved, it must not have.
            pose = self.held(guess, &pose, &observability);
            let weak = observability.weak_projector();
            let plan = self.plan(RobustKernel::None, self.noise(&pose, &uses));
            let descent = self.descend(&pose, &uses, Plan { held: Some(&weak), ..plan });
            pose = descent.pose;
            iterations += descent.steps;
            uses = self.judged(&pose, self.noise(&pose, &uses));
            if uses.inliers() == 0 {
                return Err(nothing_fits);
            }
            noise = self.final_noise(&pose, &uses);
            observability = self.observability(&pose, &uses, noise);
        }
        let (chi2, errors) = self.left_over(&pose, &uses);
        Ok(PoseEstimate {
            camera_from_map: pose,
            covariance: self.covariance(guess, &pose, &observability),
            chi2,
            freedom: errors.saturating_sub(observability.estimated()),
            variance_factor: noise,
            rounds,
            iterations,
            observability,
            points: uses.points,
            lines: uses.lines,
        })
    }

    fn plan(&self, kernel: RobustKernel, noise: f64) -> Plan<'static> {
        Plan { kernel, noise, held: None, steps: self.config.iterations_per_round }
    }

    /// The information of the inliers, corrected for their selection by their errors.
    fn observability(&self, pose: &Isometry3<f64>, uses: &Uses, noise: f64) -> Observability {
        let information = self.information_of_inliers(pose, uses) / noise;
        Observability::of(&information, &self.config.limits(), to_one_unit)
    }

    /// A pose with its motion from the guess undone along the weak directions.
    fn held(
        &self,
        guess: &PoseGuess,
        pose: &Isometry3<f64>,
        observability: &Observability,
    ) -> Isometry3<f64> {
        let limits = self.config.limits();
        let way = perturbation_between(pose, &guess.camera_from_map).component_div(&limits);
        let back = observability.weak_projector() * way;
        perturbed(pose, &back.component_mul(&limits))
    }

    /// That of the observations along the directions they determine, that of the guess along the rest.
    fn covariance(
        &self,
        guess: &PoseGuess,
        pose: &Isometry3<f64>,
        observability: &Observability,
    ) -> Matrix6<f64> {
        let limits = self.config.limits();
        let observed: Matrix6<f64> = observability
            .directions
            .iter()
            .filter(|direction| direction.estimated)
            .map(|direction| {
                let in_limits = direction.in_units.component_mul(&limits);
                let std_devs = in_limits * direction.std_dev_in_units();
                std_devs * std_devs.transpose()
            })
            .sum();
        if observability.estimated() == 6 {
            return observed;
        }
        let of_guess =
            guess.covariance.unwrap_or_else(|| of_std_devs(&self.config.unknown_std_devs()));
        let carried = adjoint(&(pose * guess.camera_from_map.inverse()));
        let unit = limits.map(f64::recip);
        let of_guess = scaled(&propagated(&carried, &of_guess), &unit);
        let weak = observability.weak_projector();
        observed + scaled(&(weak * of_guess * weak), &limits)
    }

    fn final_noise(&self, pose: &Isometry3<f64>, uses: &Uses) -> f64 {
        match self.config.noise {
            NoiseScale::Given => 1.0,
            NoiseScale::Estimated => self.noise_of_inliers(pose, uses),
        }
    }
}
