//! Why there is no registration.

use geometry::ParameterError;

/// A cloud cannot be prepared, or not be registered to another.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum RegistrationError {
    /// A parameter has a value that means nothing.
    #[error(transparent)]
    Config(#[from] ParameterError),
    /// There is no point.
    #[error("the cloud has no usable point: of {points} none has three finite coordinates")]
    Empty {
        /// The points that were given.
        points: usize,
    },
    /// The guess is no pose.
    #[error("the guess of the pose has a number that is not finite")]
    Guess,
    /// The clouds do not overlap where the guess puts them.
    #[error(
        "only {found} of {points} points lie within {within_m} m of the target, and {needed} are needed: \
         the clouds do not overlap, or the guess is too far off"
    )]
    NoOverlap {
        /// Correspondences that were found.
        found: usize,
        /// The points of the source.
        points: usize,
        /// Correspondences that are needed.
        needed: usize,
        /// How far apart points may be that correspond.
        within_m: f64,
    },
    /// The numbers ran out of range.
    #[error("the normal equations have no solution: coordinates of the clouds are too large")]
    Unsolvable,
}
