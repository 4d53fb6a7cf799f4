//! The chi-square distribution: how large the squared error of an observation may be. Of as few degrees of freedom as observations
//! have, up to 100.

/// More of the series is never needed below [`FARTHEST`].
const MAX_TERMS: usize = 1000;
/// The distribution has reached 1 here, for as few degrees of freedom as observations have.
const FARTHEST: f64 = 200.0;
/// Halving [`FARTHEST`] this often leaves the last digits.
const HALVINGS: usize = 60;
/// A quantile is known when it moves by no more than this share of itself.
const SETTLED: f64 = 1e-13;

/// The probability that a sum of `freedom` squared normal numbers is no larger than `value`.
///
/// The series of the incomplete gamma function (Abramowitz and Stegun 1964, 6.5.29).
#[must_use]
pub fn probability(freedom: usize, value: f64) -> f64 {
    if value.is_nan() || value <= 0.0 || freedom == 0 {
        return 0.0;
    }
    if value >= FARTHEST {
        return 1.0;
    }
    let (shape, half) = (freedom as f64 / 2.0, value / 2.0);
    let mut term = half.powf(shape) * (-half).exp() / gamma_of_half(freedom + 2);
    let mut sum = 0.0;
    for index in 1..MAX_TERMS {
        sum += term;
        term *= half / (shape + index as f64);
        if term < f64::EPSILON * sum {
            break;
        }
    }
    sum.min(1.0)
}

/// The value that a sum of `freedom` squared normal numbers exceeds with the probability `1 - probability_below`.
///
/// Newton's method, kept between bounds that close in.
#[must_use]
pub fn quantile(freedom: usize, probability_below: f64) -> f64 {
    let (mut low, mut high) = (0.0, FARTHEST);
    let mut value = freedom as f64;
    for _ in 0..HALVINGS {
        let excess = probability(freedom, value) - probability_below;
        if excess > 0.0 {
            high = value;
        } else {
            low = value;
        }
        let shape = freedom as f64 / 2.0;
        let density =
            0.5 * (value / 2.0).powf(shape - 1.0) * (-value / 2.0).exp() / gamma_of_half(freedom);
        let newton = value - excess / density;
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        let settled = (next - value).abs() <= SETTLED * next;
        value = next;
        if settled {
            break;
        }
    }
    value
}

/// The gamma function of `twice / 2`.
fn gamma_of_half(twice: usize) -> f64 {
    let (start, mut gamma) =
        if twice.is_multiple_of(2) { (2, 1.0) } else { (1, std::f64::consts::PI.sqrt()) };
    for step in (start..twice).step_by(2) {
        gamma *= step as f64 / 2.0;
    }
    gamma
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_every_textbook() {
        let table = [
            (1, 0.95, 3.841_459),
            (2, 0.95, 5.991_465),
            (3, 0.95, 7.814_728),
            (4, 0.95, 9.487_729),
            (6, 0.999, 22.457_744),
            (3, 0.5, 2.365_974),
            (2, 0.475, 1.288_714),
        ];
        for (freedom, below, expected) in table {
            let value = quantile(freedom, below);
            assert!((value - expected).abs() < 2e-6, "{freedom} {below}: {value}");
            assert!((probability(freedom, value) - below).abs() < 1e-12);
        }
    }

    #[test]
    fn what_is_no_number_has_no_probability() {
        assert_eq!(probability(2, f64::NAN), 0.0);
        assert_eq!(probability(2, -1.0), 0.0);
        assert_eq!(probability(2, f64::INFINITY), 1.0);
        assert!(quantile(2, 1.0).is_finite() && quantile(2, 0.0) < 1e-9);
    }
}
