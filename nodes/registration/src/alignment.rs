//! Gauss-Newton's steps over correspondences that are found again before each, within the observable directions.

use estimation::covariance::{scaled, symmetrized};
use estimation::observability::restricted;
use estimation::perturbation::composite::perturbed;
use estimation::perturbation::{is_rigid, parts};
use estimation::{Executor, Observability};
use nalgebra::{Isometry3, Matrix6, Vector6};

use super::config::RegistrationConfig;
use super::correspondences::{Correspondences, Rules, Scatter};
use super::error::RegistrationError;
use super::normal_equations::Sums;
use super::prepared_cloud::PreparedCloud;
use super::surface::Surface;

/// Six numbers are sought: no fewer correspondences are ever enough.
const UNKNOWNS: usize = 6;

/// Where a cloud lies.
#[derive(Clone, PartialEq, Debug)]
pub struct Registration {
    /// Takes points of the source to the target.
    pub target_from_source: Isometry3<f64>,
    /// Of a perturbation of the pose ([`estimation::perturbation::composite`]), in m^2, m rad and rad^2: by how much the pulls of neighbourhoods
    /// differ. Directions that were held have the reach of the correspondences for their standard deviation.
    pub covariance: Matrix6<f64>,
    /// The directions that the correspondences determine.
    pub observability: Observability<6>,
    /// Whether the steps became small before they were too many.
    pub converged: bool,
    /// Steps that were taken.
    pub iterations: usize,
    /// Points of the source that have a correspondence.
    pub correspondences: usize,
    /// The share of the source's points that they are.
    pub overlap: f64,
    /// The root of the mean of the squared weighted distances of the correspondences: across the surface, where there is
    /// one.
    pub residual_rms_m: f64,
}

/// A stage of the descent.
struct Stage {
    settled_m: f64,
    settled_rad: f64,
    needed: usize,
    iterations: usize,
}

/// The end of a stage.
struct Descent {
    pose: Isometry3<f64>,
    last: Sums,
    converged: bool,
    iterations: usize,
}

/// Registers the source to any surface, from a guess, as [`crate::register`] does to a cloud.
///
/// # Errors
/// As [`crate::register`].
pub fn align<S: Surface>(
    source: &PreparedCloud,
    target: &S,
    guess: &Isometry3<f64>,
    config: &RegistrationConfig,
    executor: &dyn Executor,
) -> Result<Registration, RegistrationError> {
    config.validate()?;
    if !is_rigid(guess) {
        return Err(RegistrationError::Guess);
    }
    let rules = Rules {
        method: config.method,
        max_correspondence_m: config.max_correspondence_m,
        kernel: config.kernel,
        kernel_width_m: config.kernel_width_m,
    };
    let (pose, spent) = coarsely(source, target, guess, config, rules, executor)?;
    let mut fine = Correspondences::new(source, target, 1, rules, executor);
    let stage = Stage {
        settled_m: config.settled_m,
        settled_rad: config.settled_rad,
        needed: config.min_correspondences,
        iterations: config.max_iterations.saturating_sub(spent).max(1),
    };
    let descent = descend(&mut fine, &pose, config, &stage)?;
    let observability = observability(&mut fine, &descent.pose, config)?;
    let count = descent.last.count;
    let scatter = fine.scatter_at(&descent.pose);
    let reach_m = config.max_correspondence_m;
    Ok(Registration {
        target_from_source: descent.pose,
        covariance: covariance(&descent.last, &scatter, &observability, reach_m)?,
        observability,
        converged: descent.converged,
        iterations: spent + descent.iterations,
        correspondences: count,
        overlap: count as f64 / source.len().max(1) as f64,
        residual_rms_m: (descent.last.squares_m2 / count.max(1) as f64).sqrt(),
    })
}

/// The first steps: with a part of the points, and from farther away. With the number of steps.
fn coarsely<S: Surface>(
    source: &PreparedCloud,
    target: &S,
    guess: &Isometry3<f64>,
    config: &RegistrationConfig,
    rules: Rules,
    executor: &dyn Executor,
) -> Result<(Isometry3<f64>, usize), RegistrationError> {
    let coarse = config.coarse;
    let needed = (config.min_correspondences / coarse.every.max(1)).max(UNKNOWNS);
    if coarse.every == 0 || source.len() / coarse.every < needed {
        return Ok((*guess, 0));
    }
    let rules = Rules { max_correspondence_m: coarse.max_correspondence_m, ..rules };
    let mut correspondences = Correspondences::new(source, target, coarse.every, rules, executor);
    let stage = Stage {
        settled_m: coarse.settled_m,
        settled_rad: coarse.settled_rad,
        needed,
        // At least one is left for all of the points.
        iterations: config.max_iterations - 1,
    };
    let descent = descend(&mut correspondences, guess, config, &stage)?;
    Ok((descent.pose, descent.iterations))
}

fn descend<S: Surface>(
    correspondences: &mut Correspondences<'_, S>,
    guess: &Isometry3<f64>,
    config: &RegistrationConfig,
    stage: &Stage,
) -> Result<Descent, RegistrationError> {
    let mut last = enough(correspondences, guess, stage)?;
    let observability = observability(correspondences, guess, config)?;
    let mut descent = Descent { pose: *guess, last, converged: false, iterations: 0 };
    while descent.iterations < stage.iterations {
        let step = step(&last, &observability).ok_or(RegistrationError::Unsolvable)?;
        descent.pose = perturbed(&descent.pose, &step);
        descent.last = last;
        descent.iterations += 1;
        let (shift, turn) = parts(&step);
        descent.converged = shift.norm() < stage.settled_m && turn.norm() < stage.settled_rad;
        if descent.converged {
            break;
        }
        last = enough(correspondences, &descent.pose, stage)?;
    }
    Ok(descent)
}

/// The normal equations at a pose where enough points correspond.
fn enough<S: Surface>(
    correspondences: &mut Correspondences<'_, S>,
    pose: &Isometry3<f64>,
    stage: &Stage,
) -> Result<Sums, RegistrationError> {
    let sums = correspondences.found_at(pose);
    if sums.count < stage.needed {
        return Err(RegistrationError::NoOverlap {
            found: sums.count,
            points: correspondences.points(),
            needed: stage.needed,
            within_m: correspondences.max_correspondence_m(),
        });
    }
    Ok(sums)
}

fn observability<S: Surface>(
    correspondences: &mut Correspondences<'_, S>,
    pose: &Isometry3<f64>,
    config: &RegistrationConfig,
) -> Result<Observability<6>, RegistrationError> {
    let agreement = correspondences.agreement_at(pose);
    let information = agreement.information() / agreement.count.max(1) as f64;
    if !information.iter().all(|value| value.is_finite()) {
        return Err(RegistrationError::Unsolvable);
    }
    Ok(Observability::of(&information, &agreement.units(), |_, share| {
        share > config.min_constrained_share
    }))
}

/// Gauss-Newton's step along the directions that are estimated. `None` when the numbers are not finite.
fn step(sums: &Sums, observability: &Observability<6>) -> Option<Vector6<f64>> {
    let units = &observability.units;
    let held = observability.weak_projector();
    let pull = sums.pull().component_mul(units);
    let pull = pull - held * pull;
    let information = estimated_information(sums, &held, units);
    Some(information.cholesky()?.solve(&pull).component_mul(units))
        .filter(|step| step.iter().all(|value| value.is_finite()))
}

/// The information in units with no tie between what is estimated and what is held. Along what is held it is as large as along
/// the rest: no step leads there.
fn estimated_information(sums: &Sums, held: &Matrix6<f64>, units: &Vector6<f64>) -> Matrix6<f64> {
    let information = scaled(&sums.information(), units);
    let size = information.diagonal().max().max(f64::MIN_POSITIVE);
    restricted(&information, held, size)
}

/// Fewer neighbourhoods give no estimate of how they differ.
const LEAST_NEIGHBOURHOODS: usize = 4 * UNKNOWNS;

/// The covariance of the pose when errors of one neighbourhood depend on each other in any way, and those of different
/// ones do not: the "sandwich" `H^-1 (sum p p^T) H^-1` (Liang and Zeger 1986, eq. 9; Huber 1967). Where neighbourhoods are few,
/// that of independent errors, `s^2 H^-1`, as far as neighbours can be alike.
fn covariance(
    sums: &Sums,
    scatter: &Scatter,
    observability: &Observability<6>,
    reach_m: f64,
) -> Result<Matrix6<f64>, RegistrationError> {
    let units = &observability.units;
    let (estimated, held) = (observability.projector(), observability.weak_projector());
    let information = estimated_information(sums, &held, units);
    let inverse = information.cholesky().ok_or(RegistrationError::Unsolvable)?.inverse();
    let of_estimated = if scatter.count >= LEAST_NEIGHBOURHOODS {
        // As many numbers were fitted to them.
        let count = scatter.count as f64;
        let correction = count / (count - UNKNOWNS as f64);
        correction * inverse * scaled(&scatter.squares, units) * inverse
    } else {
        let points = sums.count.saturating_sub(UNKNOWNS).max(1) as f64;
        let alike = sums.count as f64 / scatter.count.max(1) as f64;
        alike * sums.squares_m2 / points * inverse
    };
    let in_units = estimated * of_estimated * estimated + reach_m * reach_m * held;
    Ok(symmetrized(&scaled(&in_units, units)))
}
