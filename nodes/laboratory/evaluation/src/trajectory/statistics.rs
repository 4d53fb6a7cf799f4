//! The six statistics of a set of errors.

use estimation::quantile::median_of_sorted;
use serde::{Deserialize, Serialize};

/// The statistics of a set of errors.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Statistics {
    /// The root mean square (RMSE).
    pub rmse: f64,
    /// The mean.
    pub mean: f64,
    /// The median; of an even number of errors the mean of the two in the middle.
    pub median: f64,
    /// The standard deviation about the mean, over all errors (divided by their number).
    pub std: f64,
    /// The minimum.
    pub min: f64,
    /// The maximum.
    pub max: f64,
}

impl Statistics {
    /// The statistics of `errors`; `None` when it is empty.
    #[must_use]
    pub fn of(errors: &[f64]) -> Option<Self> {
        let mut sorted = errors.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let (&min, &max) = (sorted.first()?, sorted.last()?);
        let count = sorted.len() as f64;
        let mean = errors.iter().sum::<f64>() / count;
        let mean_square = errors.iter().map(|error| error * error).sum::<f64>() / count;
        let variance =
            errors.iter().map(|error| (error - mean) * (error - mean)).sum::<f64>() / count;
        let median = median_of_sorted(&sorted)?;
        Some(Self { rmse: mean_square.sqrt(), mean, median, std: variance.sqrt(), min, max })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_errors_have_their_six_numbers() {
        let statistics = Statistics::of(&[4.0, 1.0, 3.0, 2.0]).unwrap();
        assert_eq!(statistics.median, 2.5);
        assert_eq!((statistics.min, statistics.max, statistics.mean), (1.0, 4.0, 2.5));
        assert!((statistics.rmse - 7.5_f64.sqrt()).abs() < 1e-15);
        assert!((statistics.std - 1.25_f64.sqrt()).abs() < 1e-15);
        assert_eq!(Statistics::of(&[7.0, -1.0, 2.0]).unwrap().median, 2.0);
        assert_eq!(Statistics::of(&[]), None);
    }
}
