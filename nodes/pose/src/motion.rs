//! The prediction of the camera's pose: by its own motion so far, by a gyroscope, by wheels.
//!
//! Every prediction comes with a covariance, of the perturbation of [`estimation::perturbation::left`]; none is made where nothing is
//! known, and the reason is said ([`NoPrediction`]).

mod config;
mod constant_velocity;
mod gyro;
#[cfg(test)]
mod tests;
mod wheels;

use geometry::Stamp;
use nalgebra::{Isometry3, Matrix6, Vector3, Vector6};

pub use config::MotionConfig;
pub use constant_velocity::constant_velocity;
pub use gyro::{GyroSample, Turn, integrated_turn, turned};
pub use wheels::{WheelStep, by_wheels};

use crate::solve::PoseGuess;

/// A pose of the past.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct KnownPose {
    /// When.
    pub stamp: Stamp,
    /// The pose.
    pub camera_from_map: Isometry3<f64>,
    /// The covariance of its perturbation.
    pub covariance: Matrix6<f64>,
}

/// Why there is no prediction.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum NoPrediction {
    /// The stamps do not grow: the clock jumped, a frame came twice, or a bag began anew.
    #[error("time went back by {by_s} s (or did not advance)")]
    TimeWentBack {
        /// By how much; 0 for stamps that are the same.
        by_s: f64,
    },
    /// The last pose is too old.
    #[error("{gap_s} s have passed, and {max_gap_s} s is the most")]
    Gap {
        /// The time passed.
        gap_s: f64,
        /// The most that may.
        max_gap_s: f64,
    },
    /// There is only one pose so far, or none: nothing is known of the velocity.
    #[error("it takes two poses to know a velocity")]
    NoVelocity,
    /// The samples of the gyroscope do not reach over the interval.
    #[error("no samples of the gyroscope for {missing_s} s of the interval")]
    NotCovered {
        /// For how long there are none.
        missing_s: f64,
    },
    /// A number is not finite.
    #[error("a pose, a covariance or a sample has a number that is not finite")]
    NotFinite,
}

/// The interval between two stamps, if it is one that a prediction can be made over.
fn interval_s(from: Stamp, to: Stamp, max_gap_s: f64) -> Result<f64, NoPrediction> {
    let gap_s = to.seconds_since(from);
    if gap_s <= 0.0 {
        Err(NoPrediction::TimeWentBack { by_s: -gap_s })
    } else if gap_s > max_gap_s {
        Err(NoPrediction::Gap { gap_s, max_gap_s })
    } else {
        Ok(gap_s)
    }
}

/// A prediction, if its numbers are finite.
fn finite(
    camera_from_map: Isometry3<f64>,
    covariance: Matrix6<f64>,
) -> Result<PoseGuess, NoPrediction> {
    let finite = estimation::perturbation::is_rigid(&camera_from_map)
        && covariance.iter().all(|value| value.is_finite());
    let guess = PoseGuess { camera_from_map, covariance: Some(covariance) };
    if finite { Ok(guess) } else { Err(NoPrediction::NotFinite) }
}

/// A covariance by the standard deviations of the shifts and of the turns along the camera's axes.
fn by_std_devs(shifts_m: &Vector3<f64>, turns_rad: &Vector3<f64>) -> Matrix6<f64> {
    let std_devs = Vector6::from_iterator(shifts_m.iter().chain(turns_rad.iter()).copied());
    Matrix6::from_diagonal(&std_devs.component_mul(&std_devs))
}
