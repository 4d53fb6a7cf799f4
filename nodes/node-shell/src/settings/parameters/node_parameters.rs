//! What a node says of its parameters, so that others can read and set them while it runs.

use geometry::parameter::Declaration;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::process::failure::NodeFailure;

/// The parameters of a node, as [`geometry::parameters!`] declares them.
pub trait NodeParameters:
    Serialize + DeserializeOwned + Default + Clone + Send + Sync + 'static
{
    /// What is declared of each.
    const DECLARATIONS: &'static [Declaration] = &[];
    /// Without declarations: the text of a parameter file; the comment above a parameter says what it means.
    const FILE: &'static str = "";
    /// Without declarations: what [`NodeParameters::validate`] accepts of a number.
    const RANGES: &'static [(&'static str, Range)] = &[];
    /// Without declarations: those that may change while the node runs.
    const CHANGEABLE: &'static [&'static str] = &[];

    /// Whether the node is managed: see [`Lifecycle`](crate::Lifecycle).
    const IS_MANAGED: bool = true;

    /// Checks all parameters together.
    ///
    /// # Errors
    /// With the parameter that is out of its range, and what is accepted.
    fn validate(&self) -> Result<(), NodeFailure>;
}

/// The numbers that a parameter may have; both ends belong to it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Range {
    /// Fractional numbers.
    Real {
        /// The least.
        least: f64,
        /// The largest.
        most: f64,
    },
    /// Whole numbers.
    Whole {
        /// The least.
        least: i64,
        /// The largest.
        most: i64,
    },
}

impl Range {
    /// All finite numbers above 0.
    pub const POSITIVE: Self = Self::above(0.0);
    /// All finite numbers from 0.
    pub const NOT_NEGATIVE: Self = Self::real(0.0, f64::MAX);
    /// All finite numbers.
    pub const FINITE: Self = Self::real(f64::MIN, f64::MAX);

    /// Fractional numbers, both ends among them.
    #[must_use]
    pub const fn real(least: f64, most: f64) -> Self {
        Self::Real { least, most }
    }

    /// All finite numbers above one.
    #[must_use]
    pub const fn above(bound: f64) -> Self {
        Self::Real { least: bound.next_up(), most: f64::MAX }
    }

    /// Whole numbers, both ends among them.
    #[must_use]
    pub const fn whole(least: i64, most: i64) -> Self {
        Self::Whole { least, most }
    }

    /// Whole numbers from one on.
    #[must_use]
    pub const fn at_least(least: i64) -> Self {
        Self::whole(least, i64::MAX)
    }
}

/// The parameters of a node that has none of its own.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, serde::Deserialize)]
pub struct NoParameters {}

impl NodeParameters for NoParameters {
    const IS_MANAGED: bool = false;

    fn validate(&self) -> Result<(), NodeFailure> {
        Ok(())
    }
}
