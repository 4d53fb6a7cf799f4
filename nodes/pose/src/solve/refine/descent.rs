//! Levenberg-Marquardt within the observable directions.

use estimation::Observability;
use estimation::covariance::scaled;
use estimation::observability::{all_estimated, restricted, to_one_unit};
use estimation::perturbation::left::perturbed;
use nalgebra::{Isometry3, Matrix6, Vector6};

use super::problem::{Linearised, Problem, Uses};
use crate::solve::config::RobustKernel;

/// The damping begins at this share of the largest diagonal element (Madsen, Nielsen and Tingleff 2004, section 3.2).
const FIRST_DAMPING: f64 = 1e-6;
/// A step that lowers the cost divides the damping by this, one that does not multiplies it (Marquardt 1963).
const DAMPING_FACTOR: f64 = 10.0;
/// The descent ends where a step would be shorter than this many standard deviations (squared).
const SETTLED: f64 = 1e-10;
/// ... or where so short a one does not lower the cost any more: rounding.
const ROUNDING: f64 = 1e-4;

/// How a descent is made.
#[derive(Clone, Copy)]
pub(crate) struct Plan<'a> {
    /// How observations are weighed.
    pub(crate) kernel: RobustKernel,
    /// By what all variances are multiplied.
    pub(crate) noise: f64,
    /// No step is taken along the directions that this projects to (in units of the limits); without it, along those that
    /// are not observable at the pose where the step begins.
    pub(crate) held: Option<&'a Matrix6<f64>>,
    /// Steps, at most.
    pub(crate) steps: usize,
}

/// Where a descent has led.
pub(crate) struct Descent {
    pub(crate) pose: Isometry3<f64>,
    pub(crate) steps: usize,
}

impl Problem<'_> {
    /// Lowers the cost of the used observations.
    pub(crate) fn descend(&self, start: &Isometry3<f64>, uses: &Uses, plan: Plan<'_>) -> Descent {
        let limits = self.config.limits();
        let Plan { kernel, noise, held, steps } = plan;
        let mut descent = Descent { pose: *start, steps: 0 };
        let mut here =
            Local::new(self.linearised(start, uses, kernel, noise), noise, &limits, held);
        let mut damping = FIRST_DAMPING * here.information.diagonal().max();
        while descent.steps < steps {
            let Some(step) = here.step(damping) else { break };
            // The length of the step in standard deviations, squared; but for the damping.
            let length2 = -step.dot(&here.pull);
            if length2.is_nan() || length2 < SETTLED {
                break;
            }
            descent.steps += 1;
            let pose = perturbed(&descent.pose, &step.component_mul(&limits));
            let there = self.linearised(&pose, uses, kernel, noise);
            if there.cost < here.cost {
                descent.pose = pose;
                here = Local::new(there, noise, &limits, held);
                damping /= DAMPING_FACTOR;
            } else if length2 < ROUNDING {
                break;
            } else {
                damping *= DAMPING_FACTOR;
            }
        }
        descent
    }
}

/// The neighbourhood of a pose in units of the limits, without the held directions.
struct Local {
    cost: f64,
    information: Matrix6<f64>,
    pull: Vector6<f64>,
}

impl Local {
    fn new(at: Linearised, noise: f64, limits: &Vector6<f64>, held: Option<&Matrix6<f64>>) -> Self {
        let whole = at.information.information() / noise;
        let information = scaled(&whole, limits);
        let pull = at.information.pull().component_mul(limits) / noise;
        let weak = match held {
            Some(held) => *held,
            None if all_estimated(&information) => {
                return Self { cost: at.cost, information, pull };
            }
            None => Observability::of(&whole, limits, to_one_unit).weak_projector(),
        };
        // Along what is held the information is 1 and the pull 0: no step.
        let pull = (Matrix6::identity() - weak) * pull;
        Self { cost: at.cost, information: restricted(&information, &weak, 1.0), pull }
    }

    /// `None` when the numbers are not finite.
    fn step(&self, damping: f64) -> Option<Vector6<f64>> {
        let damped = self.information + damping * Matrix6::identity();
        Some(-damped.cholesky()?.solve(&self.pull))
    }
}
