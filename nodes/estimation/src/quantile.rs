//! Medians and quantiles. Values are compared by `f64::total_cmp`: one that is not a number sorts last.

/// The middle one of the values in order, the mean of the two middle ones of an even number: for figures that people read.
/// `None` without a value.
#[must_use]
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_unstable_by(f64::total_cmp);
    median_of_sorted(&sorted)
}

/// [`median`] of values in order.
#[must_use]
pub fn median_of_sorted(sorted: &[f64]) -> Option<f64> {
    let upper = *sorted.get(sorted.len() / 2)?;
    let lower = *sorted.get((sorted.len() - 1) / 2)?;
    Some(f64::midpoint(lower, upper))
}

/// The middle one of the values, the upper one of two: a value that occurs, found without sorting them all. For estimators;
/// it reorders the values. `None` without a value.
#[must_use]
pub fn upper_median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    let (_, median, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    Some(*median)
}

/// The least value that `percent` of a hundred values do not exceed (nearest rank), of values in order. `None` without a
/// value.
#[must_use]
pub fn percentile_of_sorted(sorted: &[f64], percent: usize) -> Option<f64> {
    // In whole numbers: no rounding of a share.
    let rank = (sorted.len() * percent.min(100)).div_ceil(100).max(1);
    sorted.get(rank - 1).copied()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn medians_and_percentiles_of_a_few_values() {
        assert_eq!(median([4.0, 1.0, 3.0, 2.0]), Some(2.5));
        assert_eq!(median([7.0, -1.0, 2.0]), Some(2.0));
        assert_eq!(median([]), None);
        assert_eq!(upper_median(&mut [4.0, 1.0, 3.0, 2.0]), Some(3.0));
        assert_eq!(upper_median(&mut []), None);
        let hundred: Vec<f64> = (1..=100).map(f64::from).collect();
        let at = |percent| percentile_of_sorted(&hundred, percent);
        assert_eq!(
            (at(0), at(50), at(99), at(100)),
            (Some(1.0), Some(50.0), Some(99.0), Some(100.0))
        );
        assert_eq!(percentile_of_sorted(&hundred[..3], 99), Some(3.0));
        assert_eq!(percentile_of_sorted(&[], 50), None);
    }

    proptest! {
        #[test]
        fn half_of_the_values_are_on_either_side(mut values in prop::collection::vec(-1e6..1e6_f64, 1..40)) {
            let middle = median(values.iter().copied()).unwrap();
            let below = values.iter().filter(|value| **value < middle).count();
            let above = values.iter().filter(|value| **value > middle).count();
            prop_assert!(2 * below <= values.len() && 2 * above <= values.len());
            let upper = upper_median(&mut values).unwrap();
            values.sort_unstable_by(f64::total_cmp);
            prop_assert_eq!(upper, values[values.len() / 2]);
        }
    }
}
