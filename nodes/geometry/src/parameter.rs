//! Parameters, each declared once. From its declaration come the field of a struct with its default and its check, and what
//! others know of it: the descriptors of ROS 2, the parameter files, the help texts and the tables. See
//! [`parameters!`](crate::parameters).

mod declaration;
mod declare;
mod error;
mod kind;
mod range;

use std::ops::Bound;

pub use declaration::{Choice, Declaration, Kind, NamedDeclaration, Setting, all_parameters};
pub use error::{Accepted, ParameterError, ParameterName};
pub use kind::{Parameter, Parameters};
pub use range::Range;

/// A condition of its own, with what it accepts in words that follow "must be".
///
/// # Errors
/// When it does not hold.
pub fn check(
    name: &'static str,
    accepted: impl Into<Accepted>,
    value: f64,
    holds: bool,
) -> Result<(), ParameterError> {
    if holds {
        return Ok(());
    }
    Err(ParameterError { name: name.into(), accepted: accepted.into(), value })
}

/// A finite number above 0.
///
/// # Errors
/// When it is not.
pub fn positive(name: &'static str, value: f64) -> Result<(), ParameterError> {
    within(name, value, Bound::Excluded(0.0), Bound::Unbounded)
}

/// A finite number, 0 or more.
///
/// # Errors
/// When it is not.
pub fn not_negative(name: &'static str, value: f64) -> Result<(), ParameterError> {
    within(name, value, Bound::Included(0.0), Bound::Unbounded)
}

/// A share that is not the whole.
///
/// # Errors
/// When it is not.
pub fn below_one(name: &'static str, value: f64) -> Result<(), ParameterError> {
    within(name, value, Bound::Included(0.0), Bound::Excluded(1.0))
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
    within(name, value, Bound::Included(least), Bound::Included(most))
}

/// A count that is large enough.
///
/// # Errors
/// When it is not.
pub fn at_least(name: &'static str, value: usize, least: usize) -> Result<(), ParameterError> {
    within(name, value as f64, Bound::Included(least as f64), Bound::Unbounded)
}

fn within(
    name: &'static str,
    value: f64,
    from: Bound<f64>,
    to: Bound<f64>,
) -> Result<(), ParameterError> {
    let range = Range { from, to };
    check(name, Accepted::Range(range), value, range.contains(value))
}

#[cfg(test)]
mod tests;
