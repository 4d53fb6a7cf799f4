//! The correction that makes the distances small: least squares, iteratively reweighted (Tukey's biweight), within the
//! directions that the distances determine.

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use estimation::Observability;
use estimation::covariance::scaled;
use estimation::observability::restricted;
use estimation::tukey::TukeyWeights;
use nalgebra::{Matrix6, Vector6};

use crate::config::CalibrationConfig;
use crate::constraint::Linearised;
use crate::observability::{Coordinate, observability};

/// Rounds of reweighting.
const MAX_ROUNDS: usize = 30;
/// They end when no coordinate moves by more than this share of the required standard deviation.
const SETTLED: f64 = 1e-4;
/// Fewer groups than this give no estimate of errors that they share.
const MIN_GROUPS: usize = 12;

/// A distance, what it is expected to scatter by, and what it shares errors with.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Observation {
    /// The distance and its derivative.
    pub linearised: Linearised,
    /// Its expected standard deviation.
    pub std_dev_m: f64,
    /// Standard deviation of the normal's direction.
    pub normal_std_dev_rad: f64,
    /// Observations of one group share their systematic errors: those of a beam from one place.
    pub group: usize,
}

/// The outcome of a fit.
#[derive(Clone, PartialEq, Debug)]
pub struct Fit {
    /// The correction in all, from where it started.
    pub total: Vector6<f64>,
    /// Its covariance along the estimated directions; nothing along the others.
    pub covariance: Matrix6<f64>,
    /// Which directions were estimated.
    pub observability: Observability<6>,
    /// The variance of the errors over the expected one, errors that groups share included.
    pub variance_factor: f64,
    /// The weight of each observation: 0 for outliers, 1 for what fits perfectly.
    pub weights: Vec<f64>,
}

impl Fit {
    /// How the estimate changes when the distances do.
    ///
    /// `observations` are those of the fit, each with the change of its distance.
    #[must_use]
    pub fn response(&self, changes: impl Iterator<Item = (Observation, f64)>) -> Vector6<f64> {
        let mut pull = Vector6::zeros();
        for ((one, change_m), weight) in changes.zip(&self.weights) {
            pull += weight / one.std_dev_m.powi(2) * change_m * one.linearised.jacobian;
        }
        -(self.covariance * pull) / self.variance_factor
    }
}

/// Fits the total correction to distances that were measured with the correction `applied`.
///
/// Directions that are determined worse than the configuration requires stay at 0, and so do the coordinates that are
/// held. `None` without observations, or when they determine no direction at all.
#[must_use]
pub fn fit(
    observations: &[Observation],
    applied: &Vector6<f64>,
    held: [bool; 6],
    config: &CalibrationConfig,
) -> Option<Fit> {
    let problem = Problem { observations, applied, held, config };
    let independent = problem.reweighted(*applied, 1.0)?;
    // What groups share counts as noise too, and may cost a direction that single returns seem to determine.
    let shared = problem.excess_of_groups(&independent);
    let fit = problem.reweighted(independent.total, shared)?;
    (fit.observability.estimated() > 0).then_some(fit)
}

struct Problem<'a> {
    observations: &'a [Observation],
    applied: &'a Vector6<f64>,
    held: [bool; 6],
    config: &'a CalibrationConfig,
}

impl Problem<'_> {
    /// Reweights until nothing moves. `excess` multiplies the variance.
    fn reweighted(&self, start: Vector6<f64>, excess: f64) -> Option<Fit> {
        let mut total = start;
        let mut round = 0;
        loop {
            let weighing = TukeyWeights::of(self.errors(&total), 0.0)?;
            let fit = self.solve(&weighing, excess)?;
            let step = (fit.total - total).component_div(&self.config.wanted_std_devs());
            total = fit.total;
            round += 1;
            if step.amax() < SETTLED || round == MAX_ROUNDS {
                return Some(fit);
            }
        }
    }

    /// The distances that a correction leaves, in expected standard deviations.
    fn errors(&self, total: &Vector6<f64>) -> Vec<f64> {
        let moved = total - self.applied;
        self.observations
            .iter()
            .map(|one| {
                let Linearised { distance_m, jacobian, .. } = one.linearised;
                (distance_m + jacobian.dot(&moved)) / one.std_dev_m
            })
            .collect()
    }

    fn solve(&self, weighing: &TukeyWeights, excess: f64) -> Option<Fit> {
        let (mut normal, mut noise) = (Matrix6::zeros(), Matrix6::zeros());
        let mut right = Vector6::zeros();
        for (one, weight) in self.observations.iter().zip(&weighing.weights) {
            let Linearised { distance_m, jacobian, .. } = one.linearised;
            let information = weight / (one.std_dev_m * one.std_dev_m);
            let outer = jacobian * jacobian.transpose();
            // What the distance would be without any correction.
            let uncorrected_m = distance_m - jacobian.dot(self.applied);
            normal += information * outer;
            right += information * uncorrected_m * jacobian;
            // Normals that deviate at random seem to determine directions that no surface faces: by this much on
            // average, for a deviation that is the same to all sides of the normal.
            let normal_variance =
                one.normal_std_dev_rad.powi(2) + self.config.normal_noise_rad.powi(2);
            noise += information * normal_variance * (one.linearised.displacement_matrix() - outer);
        }
        let variance_factor = excess * weighing.variance_factor(Coordinate::ALL.len());
        let units = self.config.wanted_std_devs();
        let without_noise = (normal - noise) / variance_factor;
        if !without_noise.iter().all(|element| element.is_finite()) {
            return None;
        }
        let observability = observability(&without_noise, &units, self.held);
        let (estimated, held) = (observability.projector(), observability.weak_projector());
        let reduced = restricted(&scaled(&normal, &units), &held, 1.0);
        let inverse = scaled(&(estimated * reduced.try_inverse()? * estimated), &units);
        Some(Fit {
            total: -(inverse * right),
            covariance: variance_factor * inverse,
            observability,
            variance_factor,
            weights: weighing.weights.clone(),
        })
    }

    /// By how much the sums of groups scatter more than those of independent errors would; at least 1.
    fn excess_of_groups(&self, fit: &Fit) -> f64 {
        let Some(weighing) = TukeyWeights::of(self.errors(&fit.total), 0.0) else { return 1.0 };
        let mut groups: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
        let (mut squares, mut count) = (0.0, 0.0);
        for (one, (weight, error)) in
            self.observations.iter().zip(weighing.weights.iter().zip(&weighing.errors))
        {
            if *weight > 0.0 {
                let pull = weight * error;
                let group = groups.entry(one.group).or_default();
                group.0 += pull;
                group.1 += 1.0;
                squares += pull * pull;
                count += 1.0;
            }
        }
        let estimated = fit.observability.estimated();
        if groups.len() < MIN_GROUPS.max(estimated + 1) || squares <= 0.0 {
            return 1.0;
        }
        let of_groups: f64 = groups.values().map(|(sum, count)| sum * sum / count).sum();
        let freedom = (groups.len() - estimated) as f64;
        let excess = of_groups / freedom / (squares / count);
        excess.max(1.0)
    }
}
