//! Tukey's weights at the median scale of the errors, and the variance that such an estimate has.
//!
//! Source: Beaton and Tukey 1974 (the biweight); Huber 1981, section 7.6 (the variance); Newey and West 1987 (errors that
//! neighbours share).

use crate::quantile::upper_median;

/// Tukey's constant for 95 % efficiency on normal errors (Beaton and Tukey 1974).
const TUKEY: f64 = 4.685;
/// The standard deviation of normal numbers over the median of their absolute values.
const STD_DEVS_A_MEDIAN: f64 = 1.4826;
/// Errors are taken for no smaller than this share of the expected ones: a scan registered to itself leaves none.
const LEAST_SCALE: f64 = 0.05;
/// Beyond this many rounds the scale hardly changes, with as many outliers as there may be.
const SCALE_ROUNDS: usize = 4;
/// Neighbours may share an error over this many observations: a window of a line at the distances of a room.
const LONGEST_LAG: usize = 20;

/// The scale at which an error of this size is just an outlier.
#[must_use]
pub fn scale_that_reaches(error: f64) -> f64 {
    error / TUKEY
}

/// Tukey's weight of an error: 1 for none, 0 for outliers.
#[must_use]
pub fn weight(error: f64, scale: f64) -> f64 {
    let share = error / (TUKEY * scale);
    if share.abs() < 1.0 { (1.0 - share * share).powi(2) } else { 0.0 }
}

/// The weights of one round of reweighting.
#[derive(Clone, PartialEq, Debug)]
pub struct TukeyWeights {
    /// Errors in expected standard deviations, in the order in which they were given.
    pub errors: Vec<f64>,
    /// Their weights; 0 for outliers.
    pub weights: Vec<f64>,
    /// The errors' standard deviation over the expected one, by the median of those that are no outliers.
    scale: f64,
}

impl TukeyWeights {
    /// Weighs errors, which are taken for no smaller than `least_scale` on average. `None` without any errors.
    #[must_use]
    pub fn of(errors: Vec<f64>, least_scale: f64) -> Option<Self> {
        let mut sizes: Vec<f64> = errors.iter().map(|error| error.abs()).collect();
        let mut scale = f64::INFINITY;
        // The median of all is too large by the share of outliers: again without what is one by it.
        for _ in 0..SCALE_ROUNDS {
            sizes.retain(|size| *size < TUKEY * scale);
            let median = upper_median(&mut sizes)?;
            scale = (STD_DEVS_A_MEDIAN * median).max(LEAST_SCALE);
        }
        scale = scale.max(least_scale);
        let weights = errors.iter().map(|error| weight(*error, scale)).collect();
        Some(Self { errors, weights, scale })
    }

    /// The factor of `(J' W J)^-1` that makes it the covariance of an estimate of `unknowns` numbers (Huber 1981, section
    /// 7.6), over the errors that are no outliers. Infinite where they say nothing.
    #[must_use]
    pub fn variance_factor(&self, unknowns: usize) -> f64 {
        let (mut count, mut weights, mut pulls, mut slopes) = (0.0, 0.0, 0.0, 0.0);
        for (error, weight) in self.inliers() {
            let share = (error / (TUKEY * self.scale)).powi(2);
            count += 1.0;
            weights += weight;
            pulls += (weight * error).powi(2);
            slopes += (1.0 - share) * (1.0 - 5.0 * share);
        }
        let freedom = f64::max(count - unknowns as f64, 1.0);
        let slope = slopes / count;
        // Where nearly all lie far out, the slope vanishes: nothing is known then. NaN is no slope either.
        if slope > 0.0 {
            let factor = (pulls / freedom) * (weights / count) / (slope * slope);
            factor.max(LEAST_SCALE * LEAST_SCALE)
        } else {
            f64::INFINITY
        }
    }

    /// By how much the variance of a sum of neighbouring errors exceeds that of independent ones (Newey and West 1987); at
    /// least 1.
    #[must_use]
    pub fn run_factor(&self) -> f64 {
        let inliers: Vec<f64> = self.inliers().map(|(error, _)| error).collect();
        let squares: f64 = inliers.iter().map(|error| error * error).sum();
        if squares <= 0.0 {
            return 1.0;
        }
        let lags = LONGEST_LAG.min(inliers.len() / 4);
        let correlated: f64 = (1..=lags)
            .map(|lag| {
                let together: f64 =
                    inliers.iter().zip(&inliers[lag..]).map(|(one, other)| one * other).sum();
                (1.0 - lag as f64 / (lags + 1) as f64) * together / squares
            })
            .sum();
        (1.0 + 2.0 * correlated).max(1.0)
    }

    /// The errors that are no outliers, with their weights.
    fn inliers(&self) -> impl Iterator<Item = (f64, f64)> {
        let all = self.errors.iter().copied().zip(self.weights.iter().copied());
        all.filter(|(_, weight)| *weight > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Random;

    #[test]
    fn for_normal_errors_the_variance_factor_is_their_variance() {
        let mut random = Random::new(3);
        let errors = (0..20_000).map(|_| 2.0 * random.normal()).collect();
        let weighing = TukeyWeights::of(errors, 0.0).unwrap();
        // 5 % are the price of robustness.
        let mean_weight = weighing.weights.iter().sum::<f64>() / 20_000.0;
        let variance = weighing.variance_factor(3) / mean_weight;
        assert!((variance / 4.0 - 1.05).abs() < 0.04, "{variance}");
        assert!((weighing.run_factor() - 1.0).abs() < 0.1, "{}", weighing.run_factor());
    }

    #[test]
    fn outliers_count_nothing() {
        let mut random = Random::new(4);
        let errors: Vec<f64> =
            (0..1000).map(|index| if index % 3 == 0 { 30.0 } else { random.normal() }).collect();
        let weighing = TukeyWeights::of(errors.clone(), 0.0).unwrap();
        for (error, weight) in errors.iter().zip(&weighing.weights) {
            assert_eq!(*weight == 0.0, *error == 30.0, "{error} {weight}");
        }
    }

    #[test]
    fn errors_in_runs_of_four_count_a_quarter() {
        let mut random = Random::new(5);
        let errors = (0..2000).flat_map(|_| [random.normal(); 4]).collect();
        let factor = TukeyWeights::of(errors, 0.0).unwrap().run_factor();
        assert!((factor - 4.0).abs() < 0.6, "{factor}");
    }

    #[test]
    fn no_errors_and_no_freedom_are_no_panic() {
        assert!(TukeyWeights::of(Vec::new(), 0.0).is_none());
        let zeros = TukeyWeights::of(vec![0.0; 2], 0.0).unwrap();
        assert_eq!(zeros.run_factor(), 1.0);
        assert!((zeros.variance_factor(3) - 0.0025).abs() < 1e-12);
    }

    #[test]
    fn a_run_of_eight_errors_by_hand() {
        // Two lags: of the products of neighbours 5 of 8 are left at one, 2 of 8 at two, weighted 2/3 and 1/3.
        let errors = vec![2.0, 2.0, 2.0, 2.0, -2.0, -2.0, -2.0, -2.0];
        let factor = TukeyWeights::of(errors, 0.0).unwrap().run_factor();
        assert!((factor - 2.0).abs() < 1e-12, "{factor}");
    }
}
