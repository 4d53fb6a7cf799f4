//! The scanner's pose on the rig from cycles of scans and depth images.

mod report;
mod starts;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use geometry::{DepthImage, ParameterError};
use nalgebra::{Isometry3, Vector6};

use crate::config::CalibrationConfig;
use crate::constraint::{Constraint, constraints_of};
use crate::fit::{Fit, Observation, fit};
use crate::observability::{Coordinate, SHARE_OF_ONE, share};
use crate::optics::DepthOptics;
use crate::repeated::{InCycle, Key, repeated};
use crate::returns::LidarReturn;
use crate::static_returns::{static_returns, views_of};

use self::starts::Agreement;

pub use geometry::RigMounts;
pub use report::{Calibration, CoordinateEstimate};

/// Returns are projected onto the image again until the scanner moves by less than this ...
const SETTLED_M: f64 = 1e-4;
/// ... and turns by less than this.
const SETTLED_RAD: f64 = 3e-5;
/// From this iteration on a coordinate that is held or a return that is dropped stays so: one at the border would alternate.
const DECIDED_FROM: usize = 5;
/// From this one on a coordinate that is observable only in combination with others, and not fully, is held too.
const MIXED_UNTIL: usize = 15;
/// A step that is no larger than this many times the above is good enough when the iterations are used up.
const NEARLY_SETTLED: f64 = 10.0;

/// A scan and the depth image nearest to it.
#[derive(Clone, PartialEq, Debug)]
pub struct Cycle {
    /// The returns of the scan, in the order of its beams.
    pub returns: Vec<LidarReturn>,
    /// The depth image.
    pub image: DepthImage,
    /// The pose of the rig when the image was taken, where it is known: cycles of one place are compared.
    pub map_from_rig: Option<Isometry3<f64>>,
}

/// The cycles do not determine the scanner's pose.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum CalibrationError {
    /// A parameter is out of its range.
    #[error("calibration: {0}")]
    Config(#[from] ParameterError),
    /// Too few returns lie on surfaces that the camera sees.
    #[error(
        "only {found} of {returns} returns lie within {max_offset_m} m of a plane that the camera sees, and {needed} \
         are needed; where {noisy} others are, the depth scatters too much for one"
    )]
    TooFewReturns {
        /// The returns that are.
        found: usize,
        /// Of this many.
        returns: usize,
        /// This many are needed.
        needed: usize,
        /// The farthest that counts.
        max_offset_m: f64,
        /// Returns where the image is too noisy to show one.
        noisy: usize,
    },
    /// The returns determine no direction well enough.
    #[error(
        "{found} returns on surfaces determine no coordinate to {max_std_dev_m} m or {max_std_dev_rad:.4} rad"
    )]
    NothingObservable {
        /// This many returns were on surfaces.
        found: usize,
        /// The required standard deviation, of a shift ...
        max_std_dev_m: f64,
        /// ... and of a turn.
        max_std_dev_rad: f64,
    },
    /// Where it fits best, the camera sees other surfaces than the scanner.
    #[error(
        "with the mount that fits best {agree} returns lie on the surface that the camera sees there, and {contradict} beside it"
    )]
    Contradicted {
        /// Returns on the surface.
        agree: usize,
        /// Returns beside it.
        contradict: usize,
    },
    /// The pose did not settle.
    #[error(
        "the scanner's pose did not settle: after {iterations} iterations it still moves by {step_m:.4} m and \
         {step_rad:.5} rad"
    )]
    NotSettled {
        /// After this many iterations.
        iterations: usize,
        /// The last step, of the shift ...
        step_m: f64,
        /// ... and of the turn.
        step_rad: f64,
    },
}

/// Estimates the scanner's pose from cycles, starting from `mounts`, and from some headings beside. The camera's pose stays.
///
/// Every return is moved into the camera frame and compared with the plane, or the edge, that the depth image shows
/// there; moving objects are left out ([`crate::static_returns`]), outliers have no weight
/// ([`crate::fit`]). Directions that the scene does not determine stay as they are in `mounts`, and the result says so.
///
/// # Errors
/// When too few returns are on surfaces, these determine no direction, the pose does not settle, or too many returns contradict
/// the pose that is found.
pub fn calibrate(
    cycles: &[Cycle],
    optics: DepthOptics<'_>,
    mounts: &RigMounts,
    config: &CalibrationConfig,
) -> Result<Calibration, CalibrationError> {
    config.validate()?;
    let problem = Problem::new(cycles, optics, mounts, config);
    let (settled, agreement) = problem.best_of_starts()?;
    if !agreement.is_enough() {
        let Agreement { agree, contradict, .. } = agreement;
        return Err(CalibrationError::Contradicted { agree, contradict });
    }
    Ok(problem.report(&settled, agreement))
}

/// Where the iterations ended.
struct Settled {
    constraints: Vec<InCycle>,
    fit: Fit,
    iterations: usize,
}

struct Problem<'a> {
    cycles: &'a [Cycle],
    views: Vec<usize>,
    is_static: Vec<Vec<bool>>,
    optics: DepthOptics<'a>,
    mounts: RigMounts,
    config: &'a CalibrationConfig,
}

impl<'a> Problem<'a> {
    fn new(
        cycles: &'a [Cycle],
        optics: DepthOptics<'a>,
        mounts: &RigMounts,
        config: &'a CalibrationConfig,
    ) -> Self {
        let views = views_of(cycles);
        let is_static = static_returns(cycles, &views, config);
        Self { cycles, views, is_static, optics, mounts: *mounts, config }
    }

    /// Projects the returns and fits again until the correction that began with `start` settles.
    fn settle(&self, start: Vector6<f64>) -> Result<Settled, CalibrationError> {
        let config = self.config;
        let mut total = start;
        let mut step = (f64::INFINITY, f64::INFINITY);
        let mut known = None;
        let mut held = [false; 6];
        let mut kept: Option<BTreeSet<Key>> = None;
        for iteration in 0..config.max_iterations {
            let (constraints, fit) = self.iterate(&total, held, kept.as_ref())?;
            if iteration + 1 >= DECIDED_FROM {
                kept = Some(constraints.iter().map(InCycle::key).collect());
            }
            let share_of = |coordinate| share(&fit.observability, coordinate);
            let needed = if iteration < MIXED_UNTIL { 0.5 } else { SHARE_OF_ONE };
            let knows = Coordinate::ALL.map(|coordinate| share_of(coordinate) > needed);
            if iteration >= DECIDED_FROM {
                let before = known.unwrap_or(knows);
                let is_mixed = iteration >= MIXED_UNTIL;
                for (held, (before, now)) in held.iter_mut().zip(before.into_iter().zip(knows)) {
                    *held |= (before || is_mixed) && !now;
                }
            }
            known = Some(knows);
            let moved = fit.total - total;
            step = (moved.fixed_rows::<3>(0).norm(), moved.fixed_rows::<3>(3).norm());
            total = fit.total;
            let is_last = iteration + 1 == config.max_iterations;
            let limit = if is_last { NEARLY_SETTLED } else { 1.0 };
            if step.0 <= limit * SETTLED_M && step.1 <= limit * SETTLED_RAD {
                return Ok(Settled { constraints, fit, iterations: iteration + 1 });
            }
        }
        let (step_m, step_rad) = step;
        Err(CalibrationError::NotSettled { iterations: config.max_iterations, step_m, step_rad })
    }

    /// Projects the returns onto the images with the correction so far, and fits a better one.
    fn iterate(
        &self,
        total: &Vector6<f64>,
        held: [bool; 6],
        kept: Option<&BTreeSet<Key>>,
    ) -> Result<(Vec<InCycle>, Fit), CalibrationError> {
        let mounts = self.mounts.corrected(total);
        let constraints = self.constraints(&mounts, kept);
        let found = constraints.len();
        if found < self.config.min_returns {
            return Err(CalibrationError::TooFewReturns {
                found,
                returns: self.cycles.iter().map(|cycle| cycle.returns.len()).sum(),
                needed: self.config.min_returns,
                max_offset_m: self.config.max_offset_m,
                noisy: self.agreement(total).noisy,
            });
        }
        let observations = self.observations(&constraints, &mounts);
        match fit(&observations, total, held, self.config) {
            Some(fit) => Ok((constraints, fit)),
            None => Err(CalibrationError::NothingObservable {
                found,
                max_std_dev_m: self.config.max_std_dev_m,
                max_std_dev_rad: self.config.max_std_dev_rad,
            }),
        }
    }

    /// The constraints of the returns that are `kept`.
    fn constraints(&self, mounts: &RigMounts, kept: Option<&BTreeSet<Key>>) -> Vec<InCycle> {
        let mut constraints = Vec::new();
        for (index, (cycle, is_static)) in self.cycles.iter().zip(&self.is_static).enumerate() {
            let is_static = |place: usize| is_static.get(place).copied().unwrap_or(false);
            let of_cycle = constraints_of(
                &cycle.returns,
                is_static,
                &cycle.image,
                self.optics,
                mounts,
                self.config,
            );
            let is_kept = |constraint: &Constraint| {
                kept.is_none_or(|kept| kept.contains(&(index, constraint.beam, constraint.kind)))
            };
            let of_cycle = of_cycle.into_iter().filter(is_kept);
            constraints.extend(of_cycle.map(|constraint| (index, constraint)));
        }
        repeated(constraints, &self.views)
    }

    fn observations(&self, constraints: &[InCycle], mounts: &RigMounts) -> Vec<Observation> {
        let of = |InCycle { constraint, group, .. }: &InCycle| Observation {
            linearised: constraint.linearised(mounts),
            std_dev_m: constraint.std_dev_m,
            normal_std_dev_rad: constraint.surface.normal_std_dev_rad,
            group: *group,
        };
        constraints.iter().map(of).collect()
    }
}
