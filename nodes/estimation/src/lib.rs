//! The shared numerics of every estimator of the suite.
//!
//! | module | what |
//! |---|---|
//! | [`perturbation`] | the six numbers that a pose is corrected by, in each of the three conventions in use |
//! | [`twist`] | a constant velocity of a body and the motion that it leads to: exponential and logarithm of SE(3) |
//! | [`covariance`] | how a covariance is propagated, scaled, and what an error is worth by it |
//! | [`kernel`] | robust kernels: what a squared error costs and weighs |
//! | [`tukey`] | Tukey's weights at the median scale of the errors, and the variance that they leave |
//! | [`normal_equations`] | `J' W J` and `J' W e` of six unknowns, packed |
//! | [`symmetric`] | symmetric 3 x 3 matrices, packed |
//! | [`observability`] | which directions the measurements constrain, and the solution within these |
//! | [`assignment`] | which track is given which observation, at the least cost |
//! | [`chi_square`] | how large a squared error may be |
//! | [`quantile`] | medians and quantiles |
//! | [`random`] | random numbers that a seed decides, the same on every machine |
//! | [`executor`] | independent tasks on as many threads as the caller gives |
//!
//! All of it is synchronous and depends on its arguments alone.
//!
//! # Example
//! A pose that is off by a known perturbation, and the perturbation found again:
//! ```
//! use estimation::perturbation::left::{perturbation_between, perturbed};
//! use nalgebra::{Isometry3, Vector3, Vector6};
//!
//! let camera_from_map = Isometry3::new(Vector3::new(1.0, 0.0, 2.0), Vector3::new(0.0, 0.3, 0.0));
//! let error = Vector6::new(0.01, 0.0, -0.02, 0.0, 0.005, 0.0);
//! let off = perturbed(&camera_from_map, &error);
//! assert!((perturbation_between(&camera_from_map, &off) - error).norm() < 1e-12);
//! ```

pub mod assignment;
pub mod chi_square;
pub mod covariance;
pub mod executor;
pub mod kernel;
pub mod normal_equations;
pub mod observability;
pub mod perturbation;
pub mod quantile;
pub mod random;
pub mod symmetric;
#[cfg(test)]
mod testing;
pub mod tukey;
pub mod twist;

pub use executor::{Executor, ScopedThreads, Serial};
pub use kernel::RobustKernel;
pub use normal_equations::NormalEquations;
pub use observability::{Direction, Observability};
pub use random::Random;
pub use symmetric::Symmetric3;
pub use twist::Twist;
