//! The types that a parameter may have.

use std::ops::Bound;

use super::check;
use super::declaration::{Declaration, Kind};
use super::error::{Accepted, ParameterError};
use super::range::Range;

/// A type of parameters: of numbers, texts, choices, and structs of them.
pub trait Parameter {
    /// Its values.
    const KIND: Kind;
    /// The numbers that it has, unless less is declared.
    const RANGE: Range = Range::FINITE;

    /// Checks a value of the parameter that is so declared.
    ///
    /// # Errors
    /// When it is out of its range.
    fn check(&self, declaration: &'static Declaration) -> Result<(), ParameterError>;
}

/// A struct of parameters, made by [`crate::parameters!`].
pub trait Parameters: Parameter {
    /// Its parameters, in their order.
    const DECLARATIONS: &'static [Declaration];

    /// Checks every parameter, and then what several of them must be together.
    ///
    /// # Errors
    /// The first one that does not hold.
    fn validate(&self) -> Result<(), ParameterError>;
}

fn check_number(declaration: &'static Declaration, number: f64) -> Result<(), ParameterError> {
    let range = declaration.range;
    check(declaration.name, Accepted::Range(range), number, range.contains(number))
}

macro_rules! whole_numbers {
    ($($type:ty, $to:expr;)*) => {$(
        impl Parameter for $type {
            const KIND: Kind = Kind::Whole;
            const RANGE: Range = Range { from: Bound::Included(0.0), to: $to };

            fn check(&self, declaration: &'static Declaration) -> Result<(), ParameterError> {
                check_number(declaration, *self as f64)
            }
        }
    )*};
}

whole_numbers! {
    u8, Bound::Included(Self::MAX as f64);
    u16, Bound::Included(Self::MAX as f64);
    u32, Bound::Included(Self::MAX as f64);
    u64, Bound::Unbounded;
    usize, Bound::Unbounded;
}

macro_rules! real_numbers {
    ($($type:ty)*) => {$(
        impl Parameter for $type {
            const KIND: Kind = Kind::Real;

            fn check(&self, declaration: &'static Declaration) -> Result<(), ParameterError> {
                check_number(declaration, f64::from(*self))
            }
        }
    )*};
}

real_numbers! { f32 f64 }

impl<const LENGTH: usize> Parameter for [f64; LENGTH] {
    const KIND: Kind = Kind::Reals(LENGTH);

    fn check(&self, declaration: &'static Declaration) -> Result<(), ParameterError> {
        let range = declaration.range;
        let bad = self.iter().copied().find(|number| !range.contains(*number));
        let accepted = Accepted::List(LENGTH, range);
        check(declaration.name, accepted, bad.unwrap_or_default(), bad.is_none())
    }
}

impl Parameter for bool {
    const KIND: Kind = Kind::Truth;

    fn check(&self, _: &'static Declaration) -> Result<(), ParameterError> {
        Ok(())
    }
}

impl Parameter for String {
    const KIND: Kind = Kind::Text;

    fn check(&self, _: &'static Declaration) -> Result<(), ParameterError> {
        Ok(())
    }
}
