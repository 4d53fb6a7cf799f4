//! The numbers that a parameter may have.

use std::f64::consts::PI;
use std::fmt;
use std::ops::{Bound, RangeBounds};

/// The numbers that a parameter may have, all of them finite.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Range {
    /// Where it begins.
    pub from: Bound<f64>,
    /// Where it ends.
    pub to: Bound<f64>,
}

impl Range {
    /// All finite numbers.
    pub const FINITE: Self = Self { from: Bound::Unbounded, to: Bound::Unbounded };

    /// Whether a number is in it. A NaN is in no range.
    #[must_use]
    pub fn contains(&self, value: f64) -> bool {
        value.is_finite() && (self.from, self.to).contains(&value)
    }
}

/// The text after "must be": `0 or more, below 1`.
impl fmt::Display for Range {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.from, self.to) {
            (Bound::Unbounded, Bound::Unbounded) => formatter.write_str("a finite number"),
            (Bound::Included(least), Bound::Included(most)) => {
                write!(formatter, "{} to {}", Number(least), Number(most))
            }
            (from, to) => {
                match from {
                    Bound::Included(least) => write!(formatter, "{} or more", Number(least))?,
                    Bound::Excluded(bound) => write!(formatter, "above {}", Number(bound))?,
                    Bound::Unbounded => {}
                }
                if from != Bound::Unbounded && to != Bound::Unbounded {
                    formatter.write_str(", ")?;
                }
                match to {
                    Bound::Included(most) => write!(formatter, "at most {}", Number(most)),
                    Bound::Excluded(bound) => write!(formatter, "below {}", Number(bound)),
                    Bound::Unbounded => Ok(()),
                }
            }
        }
    }
}

/// A bound as people write it.
struct Number(f64);

impl fmt::Display for Number {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 / PI {
            1.0 => formatter.write_str("pi"),
            -1.0 => formatter.write_str("-pi"),
            2.0 => formatter.write_str("2 pi"),
            _ => self.0.fmt(formatter),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn a_range_says_what_it_contains() {
        use Bound::{Excluded, Included, Unbounded};
        for (from, to, text, inside, outside) in [
            (Unbounded, Unbounded, "a finite number", f64::MIN, f64::INFINITY),
            (Excluded(0.0), Unbounded, "above 0", f64::from_bits(1), 0.0),
            (Included(0.0), Unbounded, "0 or more", 0.0, 0.0_f64.next_down()),
            (Unbounded, Included(2.5), "at most 2.5", 2.5, 2.5_f64.next_up()),
            (Included(2.0), Included(1e3), "2 to 1000", 1e3, 1e3_f64.next_up()),
            (Included(0.0), Excluded(1.0), "0 or more, below 1", 1.0_f64.next_down(), 1.0),
            (Excluded(0.0), Included(TAU), "above 0, at most 2 pi", TAU, 0.0),
            (Included(-PI), Included(PI), "-pi to pi", -PI, PI.next_up()),
        ] {
            let range = Range { from, to };
            assert_eq!(range.to_string(), text);
            assert!(range.contains(inside) && !range.contains(outside), "{text}");
            assert!(!range.contains(f64::NAN) && !range.contains(f64::NEG_INFINITY), "{text}");
        }
    }
}
