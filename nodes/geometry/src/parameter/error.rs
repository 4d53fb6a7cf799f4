//! The error of a value.

use std::fmt;

use super::declaration::{Declaration, Kind};
use super::range::Range;

/// A parameter has a value that it may not have.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
#[error("parameter {name} must be {accepted}, not {value}")]
pub struct ParameterError {
    /// The parameter.
    pub name: ParameterName,
    /// The accepted values.
    pub accepted: Accepted,
    /// Its value; of a list the number that is wrong.
    pub value: f64,
}

impl ParameterError {
    /// The same of a parameter that is in a group.
    #[must_use]
    pub fn in_group(mut self, group: &'static Declaration) -> Self {
        if !matches!(group.kind, Kind::Group { is_flat: true, .. }) {
            self.name.groups.rotate_right(1);
            self.name.groups[0] = Some(group);
        }
        self
    }
}

/// Groups that an error names: as deep as groups are in groups.
const MOST_GROUPS: usize = 4;

/// The name of a parameter with those of its groups: `frame.points.levels`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ParameterName {
    /// The outermost first.
    groups: [Option<&'static Declaration>; MOST_GROUPS],
    name: &'static str,
}

impl From<&'static str> for ParameterName {
    fn from(name: &'static str) -> Self {
        Self { groups: [None; MOST_GROUPS], name }
    }
}

impl fmt::Display for ParameterName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for group in self.groups.iter().flatten() {
            write!(formatter, "{}.", group.name)?;
        }
        formatter.write_str(self.name)
    }
}

/// The accepted values of a parameter, in words that follow "must be".
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Accepted {
    /// In words of its own.
    Words(&'static str),
    /// Numbers in a range.
    Range(Range),
    /// This many numbers, each in a range.
    List(usize, Range),
    /// In words that name another parameter, and what that one is.
    Against(&'static str, f64),
}

impl From<&'static str> for Accepted {
    fn from(words: &'static str) -> Self {
        Self::Words(words)
    }
}

/// `("at least min_range_m", 2.0)`.
impl From<(&'static str, f64)> for Accepted {
    fn from((words, other): (&'static str, f64)) -> Self {
        Self::Against(words, other)
    }
}

impl fmt::Display for Accepted {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Words(words) => formatter.write_str(words),
            Self::Range(range) => range.fmt(formatter),
            Self::List(length, Range::FINITE) => write!(formatter, "{length} finite numbers"),
            Self::List(length, range) => write!(formatter, "{length} numbers, each {range}"),
            Self::Against(words, other) => write!(formatter, "{words} ({other})"),
        }
    }
}
