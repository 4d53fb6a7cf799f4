//! The scanner's pose on the rig from cycles of scans and depth images.

mod report;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use estimation::perturbation::composite::perturbed;
use geometry::{DepthImage, ParameterError};
use nalgebra::{Isometry3, Vector6};

use crate::config::CalibrationConfig;
use crate::constraint::{Constraint, constraints_of};
use crate::fit::{Fit, Observation, fit};
use crate::observability::{Coordinate, SHARE_OF_ONE, share};
use crate::optics::DepthOptics;
use crate::returns::LidarReturn;
use crate::steady::{InCycle, Key, steady};
use crate::still::{still_returns, views_of};

pub use report::{Calibration, CoordinateEstimate};

/// Returns are put onto the image anew until the scanner moves by less than this ...
const SETTLED_M: f64 = 1e-4;
/// ... and turns by less than this.
const SETTLED_RAD: f64 = 3e-5;
/// From this iteration on what is given up stays given up, a coordinate or a return: one at the border would come and go.
const DECIDED_FROM: usize = 5;
/// From this one on so is a coordinate that is told only together with others, and not to the end.
const MIXED_UNTIL: usize = 15;
/// A step that is no larger than so many times the above is good enough when the iterations are used up.
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

/// How the two sensors are mounted.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RigMounts {
    /// The camera's optical frame in the rig.
    pub rig_from_camera: Isometry3<f64>,
    /// The scanner's frame in the rig.
    pub rig_from_lidar: Isometry3<f64>,
}

impl RigMounts {
    /// Takes a point of the scanner's frame to the camera's, with the rig's motion in between.
    #[must_use]
    pub fn camera_from_lidar(&self, image_rig_from_rig: &Isometry3<f64>) -> Isometry3<f64> {
        self.rig_from_camera.inverse() * image_rig_from_rig * self.rig_from_lidar
    }

    /// With the scanner's pose corrected; see the crate's page for the six numbers.
    #[must_use]
    pub fn corrected(&self, correction: &Vector6<f64>) -> Self {
        Self { rig_from_lidar: perturbed(&self.rig_from_lidar, correction), ..*self }
    }
}

/// The cycles do not tell where the scanner is.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum CalibrationError {
    /// A parameter is out of its range.
    #[error("calibration: {0}")]
    Config(#[from] ParameterError),
    /// Too few returns lie on surfaces that the camera sees.
    #[error(
        "only {found} of {returns} returns lie within {max_offset_m} m of a plane that the camera sees, and {needed} \
         are needed"
    )]
    TooFewReturns {
        /// So many do.
        found: usize,
        /// Of so many.
        returns: usize,
        /// So many are needed.
        needed: usize,
        /// The farthest that counts.
        max_offset_m: f64,
    },
    /// The returns tell of no direction well enough.
    #[error(
        "{found} returns on surfaces tell no coordinate to {max_std_dev_m} m or {max_std_dev_rad:.4} rad"
    )]
    NothingObservable {
        /// So many returns were on surfaces.
        found: usize,
        /// What was asked for, of a shift ...
        max_std_dev_m: f64,
        /// ... and of a turn.
        max_std_dev_rad: f64,
    },
    /// The pose did not settle.
    #[error(
        "the scanner's pose did not settle: after {iterations} iterations it still moves by {step_m:.4} m and \
         {step_rad:.5} rad"
    )]
    NotSettled {
        /// After so many iterations.
        iterations: usize,
        /// The last step, of the shift ...
        step_m: f64,
        /// ... and of the turn.
        step_rad: f64,
    },
}

/// Estimates the scanner's pose from cycles, starting from `mounts`. The camera's pose stays.
///
/// Every return is moved into the camera frame and compared with the plane, or the edge, that the depth image shows
/// there; what passes through the scene is left out ([`crate::still`]), what does not fit has no weight
/// ([`crate::fit`]). Directions that the scene does not tell stay as they are in `mounts`, and the result says so.
///
/// # Errors
/// When too little of the scans lies on surfaces, these tell of no direction, or the pose does not settle.
pub fn calibrate(
    cycles: &[Cycle],
    optics: DepthOptics<'_>,
    mounts: &RigMounts,
    config: &CalibrationConfig,
) -> Result<Calibration, CalibrationError> {
    config.validate()?;
    let problem = Problem::new(cycles, optics, mounts, config);
    let mut total = Vector6::zeros();
    let mut step = (f64::INFINITY, f64::INFINITY);
    let mut known = None;
    let mut given_up = [false; 6];
    let mut kept: Option<BTreeSet<Key>> = None;
    for iteration in 0..config.max_iterations {
        let (constraints, fit) = problem.iterate(&total, given_up, kept.as_ref())?;
        if iteration + 1 >= DECIDED_FROM {
            kept = Some(constraints.iter().map(InCycle::key).collect());
        }
        let share_of = |coordinate| share(&fit.observability, coordinate);
        let needed = if iteration < MIXED_UNTIL { 0.5 } else { SHARE_OF_ONE };
        let knows = Coordinate::ALL.map(|coordinate| share_of(coordinate) > needed);
        if iteration >= DECIDED_FROM {
            let before = known.unwrap_or(knows);
            let is_mixed = iteration >= MIXED_UNTIL;
            for (given_up, (before, now)) in given_up.iter_mut().zip(before.into_iter().zip(knows))
            {
                *given_up |= (before || is_mixed) && !now;
            }
        }
        known = Some(knows);
        let moved = fit.total - total;
        step = (moved.fixed_rows::<3>(0).norm(), moved.fixed_rows::<3>(3).norm());
        total = fit.total;
        let is_last = iteration + 1 == config.max_iterations;
        let limit = if is_last { NEARLY_SETTLED } else { 1.0 };
        if step.0 <= limit * SETTLED_M && step.1 <= limit * SETTLED_RAD {
            return Ok(problem.report(&constraints, &fit, iteration + 1));
        }
    }
    let (step_m, step_rad) = step;
    Err(CalibrationError::NotSettled { iterations: config.max_iterations, step_m, step_rad })
}

struct Problem<'a> {
    cycles: &'a [Cycle],
    views: Vec<usize>,
    still: Vec<Vec<bool>>,
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
        let still = still_returns(cycles, &views, config);
        Self { cycles, views, still, optics, mounts: *mounts, config }
    }

    /// Puts the returns onto the images with the correction so far, and fits a better one.
    fn iterate(
        &self,
        total: &Vector6<f64>,
        given_up: [bool; 6],
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
            });
        }
        let observations = self.observations(&constraints, &mounts);
        match fit(&observations, total, given_up, self.config) {
            Some(fit) => Ok((constraints, fit)),
            None => Err(CalibrationError::NothingObservable {
                found,
                max_std_dev_m: self.config.max_std_dev_m,
                max_std_dev_rad: self.config.max_std_dev_rad,
            }),
        }
    }

    /// What the returns must lie on, of those that are `kept`.
    fn constraints(&self, mounts: &RigMounts, kept: Option<&BTreeSet<Key>>) -> Vec<InCycle> {
        let mut constraints = Vec::new();
        for (index, (cycle, still)) in self.cycles.iter().zip(&self.still).enumerate() {
            let is_still = |place: usize| still.get(place).copied().unwrap_or(false);
            let of_cycle = constraints_of(
                &cycle.returns,
                is_still,
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
        steady(constraints, &self.views)
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
