//! How large errors may be, and what they are in fact.

use estimation::chi_square::{probability, quantile};
use estimation::quantile::upper_median;
use nalgebra::Isometry3;

use super::problem::{Problem, Uses};
use crate::solve::config::NoiseScale;
use crate::solve::term::MAX_ROWS;

/// Variances are taken for no smaller than this share of the stated ones: without any noise none would be left.
const LEAST_FACTOR: f64 = 0.0025;
/// Beyond this many rounds the median hardly changes, with as many outliers as there may be.
const MEDIAN_ROUNDS: usize = 5;
/// Steps of the table by leverage.
const LEVERAGES: usize = 8;
/// The coordinates of a pose.
const COORDINATES: f64 = 6.0;

/// The distribution of the inliers' errors, by how many errors an observation has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gates {
    limits: [f64; MAX_ROWS + 1],
    variances: [[f64; LEVERAGES + 1]; MAX_ROWS + 1],
    medians: [f64; MAX_ROWS + 1],
}

impl Gates {
    pub(super) fn new(inlier_probability: f64) -> Self {
        let mut gates = Self {
            limits: [0.0; MAX_ROWS + 1],
            variances: [[1.0; LEVERAGES + 1]; MAX_ROWS + 1],
            medians: [1.0; MAX_ROWS + 1],
        };
        for rows in 1..=MAX_ROWS {
            let limit = quantile(rows, inlier_probability);
            let within = probability(rows, limit);
            gates.limits[rows] = limit;
            // The mean of one error's square, where the sum of all is below the limit (it is nothing otherwise), over how often
            // it is. Of an error that the pose follows by some share little is left, and it is hardly ever cut off.
            for (step, variance) in gates.variances[rows].iter_mut().enumerate() {
                let left = 1.0 - step as f64 / LEVERAGES as f64;
                let reached = limit / left;
                *variance = probability(rows + 2, reached) / probability(rows, reached);
            }
            gates.medians[rows] = quantile(rows, 0.5 * within);
        }
        gates
    }

    /// The largest squared error of an inlier.
    #[inline]
    pub(super) fn limit(&self, rows: usize) -> f64 {
        self.limits[rows.min(MAX_ROWS)]
    }

    /// The variance of an inlier's errors, which are cut off at the limit.
    ///
    /// The share of its information that an inlier keeps: cutting off its errors makes the pose no better. Of an
    /// estimate that sets the sum of the cut errors to zero the information is their mean square over all inliers
    /// (Huber 1981, section 3.2: the slope of their mean squared over their variance, and by Stein's lemma both are the same
    /// number); here it is shared out to the inliers. `leverage` is the share by which the pose follows the observation.
    pub(super) fn variance(&self, rows: usize, leverage: f64) -> f64 {
        let steps = &self.variances[rows.min(MAX_ROWS)];
        let place = leverage.clamp(0.0, 1.0) * LEVERAGES as f64;
        let step = (place as usize).min(LEVERAGES - 1);
        steps[step] + (place - step as f64) * (steps[step + 1] - steps[step])
    }
}

impl Problem<'_> {
    /// By what the stated variances are to be multiplied for the next step.
    ///
    /// The median of the squared errors over what it would be, of the used observations first, then of those that are no
    /// outliers by it.
    pub(super) fn noise(&self, pose: &Isometry3<f64>, uses: &Uses) -> f64 {
        if self.config.noise == NoiseScale::Given {
            return 1.0;
        }
        let gates = &self.gates;
        let squares = self.squares(pose, uses);
        let mut shares: Vec<f64> = Vec::with_capacity(squares.len());
        let mut factor = f64::INFINITY;
        for _ in 0..MEDIAN_ROUNDS {
            let inliers = squares.iter().filter(|(chi2, rows)| *chi2 < factor * gates.limit(*rows));
            shares.clear();
            shares.extend(inliers.map(|(chi2, rows)| chi2 / gates.medians[*rows]));
            let Some(median) = upper_median(&mut shares) else { break };
            factor = median.max(LEAST_FACTOR);
        }
        if factor.is_finite() { factor } else { 1.0 }
    }

    /// The same by the mean of the inliers' squared errors, which is sharper.
    pub(super) fn noise_of_inliers(&self, pose: &Isometry3<f64>, uses: &Uses) -> f64 {
        let (mut sum, mut expected) = (0.0, 0.0);
        for (chi2, rows) in self.squares(pose, uses) {
            sum += chi2;
            expected += rows as f64 * self.gates.variance(rows, 0.0);
        }
        if expected > COORDINATES {
            (sum / (expected - COORDINATES)).max(LEAST_FACTOR)
        } else {
            1.0
        }
    }
}
