//! Whether the parameters of a configuration mean anything: each check names the parameter, what it may be and what it is.
//!
//! ```
//! use geometry::parameter;
//!
//! let range_noise_m = -0.01;
//! let error = parameter::positive("range_noise_m", range_noise_m).unwrap_err();
//! assert_eq!(error.to_string(), "parameter range_noise_m must be a positive number, not -0.01");
//! ```

use std::fmt;

/// A parameter has a value that means nothing.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
#[error("parameter {name} must be {accepted}, not {value}")]
pub struct ParameterError {
    /// The parameter.
    pub name: &'static str,
    /// What it may be.
    pub accepted: Accepted,
    /// What it is.
    pub value: f64,
}

/// What a parameter may be.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Accepted {
    /// In words that follow "must be".
    Words(&'static str),
    /// From the least to the most, both included.
    Between {
        /// The least.
        least: f64,
        /// The most.
        most: f64,
    },
    /// A count of so many or more.
    AtLeast(usize),
}

impl fmt::Display for Accepted {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Words(words) => formatter.write_str(words),
            Self::Between { least, most } => write!(formatter, "between {least} and {most}"),
            Self::AtLeast(least) => write!(formatter, "at least {least}"),
        }
    }
}

/// A condition of its own, with what it accepts in words that follow "must be".
///
/// # Errors
/// When it does not hold.
pub fn check(
    name: &'static str,
    accepted: &'static str,
    value: f64,
    holds: bool,
) -> Result<(), ParameterError> {
    accept(name, Accepted::Words(accepted), value, holds)
}

/// A finite number above 0.
///
/// # Errors
/// When it is none.
pub fn positive(name: &'static str, value: f64) -> Result<(), ParameterError> {
    check(name, "a positive number", value, value.is_finite() && value > 0.0)
}

/// A finite number, 0 or more.
///
/// # Errors
/// When it is none.
pub fn not_negative(name: &'static str, value: f64) -> Result<(), ParameterError> {
    check(name, "0 or more", value, value.is_finite() && value >= 0.0)
}

/// A share that is not the whole.
///
/// # Errors
/// When it is none.
pub fn below_one(name: &'static str, value: f64) -> Result<(), ParameterError> {
    check(name, "in [0, 1)", value, (0.0..1.0).contains(&value))
}

/// A number within bounds, both included.
///
/// # Errors
/// When it is beyond them, or is not a number.
pub fn between(
    name: &'static str,
    value: f64,
    least: f64,
    most: f64,
) -> Result<(), ParameterError> {
    accept(name, Accepted::Between { least, most }, value, (least..=most).contains(&value))
}

/// A count that is large enough.
///
/// # Errors
/// When it is not.
pub fn at_least(name: &'static str, value: usize, least: usize) -> Result<(), ParameterError> {
    accept(name, Accepted::AtLeast(least), value as f64, value >= least)
}

fn accept(
    name: &'static str,
    accepted: Accepted,
    value: f64,
    holds: bool,
) -> Result<(), ParameterError> {
    if holds { Ok(()) } else { Err(ParameterError { name, accepted, value }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bounds_are_as_the_words_say_and_a_nan_is_nowhere() {
        let is = |accepted: Result<(), ParameterError>| accepted.is_ok();
        for (value, expected) in [
            (-1.0, [false, false, false, true]),
            (0.0, [false, true, true, true]),
            (0.5, [true, true, true, true]),
            (1.0, [true, true, false, true]),
            (1.5, [true, true, false, false]),
            (f64::INFINITY, [false, false, false, false]),
            (f64::NAN, [false, false, false, false]),
        ] {
            let found = [
                is(positive("p", value)),
                is(not_negative("p", value)),
                is(below_one("p", value)),
                is(between("p", value, -1.0, 1.0)),
            ];
            assert_eq!(found, expected, "{value}");
        }
        assert!(is(at_least("p", 3, 3)) && !is(at_least("p", 2, 3)));
    }

    #[test]
    fn the_message_names_the_parameter_what_it_may_be_and_what_it_is() {
        let said = |error: Result<(), ParameterError>| error.unwrap_err().to_string();
        assert_eq!(
            said(between("reach_m", f64::NAN, 1.0, 400.5)),
            "parameter reach_m must be between 1 and 400.5, not NaN"
        );
        assert_eq!(
            said(at_least("min_returns", 2, 3)),
            "parameter min_returns must be at least 3, not 2"
        );
        assert_eq!(
            said(check("delta", "a whole number", 0.5, false)),
            "parameter delta must be a whole number, not 0.5"
        );
    }
}
