//! The axis of a chart: its ends and its ticks.

use crate::headline::grouped;

/// As many ticks as fit without touching.
const MAX_TICKS: f64 = 6.0;
/// From this step on, ticks are labelled in millions: their digits would not fit beside the chart.
const MILLIONS_STEP: f64 = 1e5;
/// A plan is wider than its contents by this.
const PLAN_MARGIN: f64 = 1.06;
/// The smallest ratio of a plan's height to its width.
const LEAST_PLAN_HEIGHT: f64 = 0.4;
/// Below this every whole number is one of `f64`'s, and fits in a `usize`.
const MAX_GROUPED: f64 = 1e9;

/// An axis from one round value to another.
#[derive(Clone, PartialEq, Debug)]
pub struct Axis {
    label: String,
    first: f64,
    last: f64,
    step: f64,
    /// Of the plot, where both of its axes have one scale.
    height_for_width: Option<f64>,
}

impl Axis {
    /// An axis that holds all finite `values`, its ends at ticks. With no such value it goes from 0 to 1.
    #[must_use]
    pub fn spanning(label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let finite = values.into_iter().filter(|value| value.is_finite());
        let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
        let (low, high) = if low > high { (0.0, 1.0) } else { (low, high) };
        // A single value gets room around it: a tick's worth of what it amounts to.
        let (low, high) = if high - low > f64::EPSILON * high.abs().max(1.0) {
            (low, high)
        } else {
            (low, low + low.abs().max(1.0))
        };
        let step = round_step((high - low) / MAX_TICKS);
        let label = label.to_owned();
        let (first, last) = ((low / step).floor() * step, (high / step).ceil() * step);
        Self { label, first, last, step, height_for_width: None }
    }

    /// The axes to the right and upwards of a plan, on which a unit is as long on the one as on the other. They
    /// hold all finite values with a margin; the plot is as high as it needs to be, within what is legible.
    #[must_use]
    pub fn of_one_scale(labels: [&str; 2], values: [&[f64]; 2]) -> [Self; 2] {
        let extents = values.map(|values| {
            let finite = values.iter().copied().filter(|value| value.is_finite());
            let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |range, value| {
                (range.0.min(value), range.1.max(value))
            });
            if low > high { (0.0, 0.0) } else { (low, high) }
        });
        let [of_x, of_y] = extents.map(|(low, high)| (high - low) * PLAN_MARGIN);
        // A static trajectory is drawn in a frame of a unit.
        let width = if of_x.max(of_y) > 0.0 { of_x.max(of_y) } else { 1.0 };
        let height = of_y.max(width * LEAST_PLAN_HEIGHT);
        let step = round_step(width / MAX_TICKS);
        let axis = |label: &str, (low, high): (f64, f64), length: f64| {
            let middle = f64::midpoint(low, high);
            let (first, last) = (middle - length / 2.0, middle + length / 2.0);
            let height_for_width = Some(height / width);
            Self { label: label.to_owned(), first, last, step, height_for_width }
        };
        let ([x_label, y_label], [x, y]) = (labels, extents);
        [axis(x_label, x, width), axis(y_label, y, height)]
    }

    /// Of the plot, where both of its axes have one scale.
    pub(super) fn height_for_width(&self) -> Option<f64> {
        self.height_for_width
    }

    /// An axis that ends where the `values` end, with ticks between.
    #[must_use]
    pub fn within(label: &str, values: impl IntoIterator<Item = f64> + Clone) -> Self {
        let axis = Self::spanning(label, values.clone());
        let finite = || values.clone().into_iter().filter(|value| value.is_finite());
        let (low, high) = (finite().reduce(f64::min), finite().reduce(f64::max));
        match (low, high) {
            (Some(first), Some(last)) if first < last => Self { first, last, ..axis },
            _ => axis,
        }
    }

    /// The values at its ends.
    pub(super) fn ends(&self) -> (f64, f64) {
        (self.first, self.last)
    }

    pub(crate) fn label(&self) -> &str {
        &self.label
    }

    /// Where a value lies between the ends: 0 at the first, 1 at the last.
    #[must_use]
    pub fn position(&self, value: f64) -> f64 {
        ((value - self.first) / (self.last - self.first)).clamp(0.0, 1.0)
    }

    /// The values of the ticks, from the first to the last.
    pub(crate) fn ticks(&self) -> Vec<f64> {
        // A tick that rounding puts a hair beyond an end belongs to it.
        let first = (self.first / self.step - 1e-9).ceil();
        let last = (self.last / self.step + 1e-9).floor();
        (0..=(last - first) as usize).map(|index| (first + index as f64) * self.step).collect()
    }

    /// A tick's value with as many digits as its step needs.
    pub(crate) fn tick_text(&self, value: f64) -> String {
        if self.step >= MILLIONS_STEP {
            return format!("{:.1} M", value * 1e-6);
        }
        let decimals = (-self.step.log10().floor()).max(0.0) as usize;
        // Rounded first, so that no tick reads "-0".
        let value = (value / self.step).round() * self.step;
        if decimals == 0 && (0.0..MAX_GROUPED).contains(&value) {
            return grouped(value.round() as usize);
        }
        format!("{:.decimals$}", if value == 0.0 { 0.0 } else { value })
    }
}

/// The least of 1, 2, 5 times a power of ten that is not below `step`.
fn round_step(step: f64) -> f64 {
    let power = 10_f64.powf(step.log10().floor());
    let digit = step / power;
    // A hair above a round digit is that digit: the division leaves one.
    let round = [1.0, 2.0, 5.0].into_iter().find(|&round| digit <= round * (1.0 + 1e-9));
    power * round.unwrap_or(10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_hold_the_values() {
        let axis = Axis::spanning("", [3.0, 97.0]);
        assert_eq!(axis.ticks(), [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]);
        assert_eq!(axis.tick_text(20.0), "20");
        let axis = Axis::spanning("", [-0.31, 0.42]);
        assert_eq!(axis.tick_text(axis.ticks()[0]), "-0.4");
        assert_eq!(axis.tick_text(axis.ticks()[2]), "0.0");
    }

    #[test]
    fn odd_values_still_give_an_axis() {
        for values in [
            vec![],
            vec![f64::NAN],
            vec![5.0],
            vec![0.0, 0.0],
            vec![1e300, -1e300],
            vec![1e-12, 2e-12],
        ] {
            let axis = Axis::spanning("", values.iter().copied());
            let ticks = axis.ticks();
            assert!(ticks.len() >= 2 && ticks.len() <= 10, "{values:?}: {ticks:?}");
            for value in values.iter().filter(|value| value.is_finite()) {
                assert!((0.0..=1.0).contains(&axis.position(*value)), "{values:?}");
            }
        }
    }

    #[test]
    fn an_axis_within_its_values_ends_where_they_do() {
        let axis = Axis::within("", [0.5, 8.4]);
        assert_eq!(axis.ticks(), [2.0, 4.0, 6.0, 8.0]);
        assert_eq!((axis.position(0.5), axis.position(8.4)), (0.0, 1.0));
        assert_eq!(Axis::within("", [3.0]).position(3.0), 0.0);
        assert_eq!(Axis::spanning("", [0.0, 12_000.0]).tick_text(12_000.0), "12,000");
        assert_eq!(Axis::spanning("", [0.0, 1.2e6]).tick_text(1.2e6), "1.2 M");
    }

    #[test]
    fn positions_run_from_the_first_to_the_last_tick() {
        let axis = Axis::spanning("", [0.0, 60.0]);
        assert_eq!((axis.position(0.0), axis.position(30.0), axis.position(60.0)), (0.0, 0.5, 1.0));
    }
}
