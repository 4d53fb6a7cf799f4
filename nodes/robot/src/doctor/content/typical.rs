//! The median and the maximum of many numbers.

use std::ops::Range;

use estimation::quantile::upper_median;

/// Numbers that are kept at most: a day at 10 Hz.
const MOST_VALUES: usize = 1 << 20;

/// Numbers, one or a few a message.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct Typical {
    values: Vec<f64>,
}

impl Typical {
    /// Adds a number; one that is not finite is ignored.
    pub(crate) fn add(&mut self, value: f64) {
        if value.is_finite() && self.values.len() < MOST_VALUES {
            self.values.push(value);
        }
    }

    /// The median.
    pub(crate) fn median(&self) -> Option<f64> {
        upper_median(&mut self.values.clone())
    }

    /// The median of some, by their places; none where these are not kept.
    pub(crate) fn median_of(&self, places: Range<usize>) -> Option<f64> {
        upper_median(&mut self.values.get(places)?.to_vec())
    }

    /// The maximum.
    pub(crate) fn largest(&self) -> Option<f64> {
        self.values.iter().copied().max_by(f64::total_cmp)
    }

    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.values.len()
    }
}
