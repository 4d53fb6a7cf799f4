//! The result of each scan.

use geometry::Stamp;
use nalgebra::{Isometry3, Matrix6};

use crate::registration::{Direction, RegistrationError};
use crate::revolution::LONGEST_S;

/// Where the sensor was.
#[derive(Clone, PartialEq, Debug)]
pub struct LidarPose {
    /// When: the middle of the scan where its points have times.
    pub stamp: Stamp,
    /// Takes points of the sensor to the frame of the first scan.
    pub odom_from_lidar: Isometry3<f64>,
    /// Of the pose against the map, of a shift (m) and a turn (rad) along the axes of the odometry's frame
    /// ([`estimation::perturbation::composite`]). The map's own drift is not in it.
    pub covariance: Matrix6<f64>,
    /// How well the scan fits.
    pub quality: Quality,
}

/// How well a scan fits the map.
#[derive(Clone, PartialEq, Debug)]
pub struct Quality {
    /// The outcome of the scan.
    pub outcome: Outcome,
    /// Its points after thinning out.
    pub points: usize,
    /// Occupied voxels of the map.
    pub map_voxels: usize,
    /// How far correspondences reached.
    pub reach_m: f64,
    /// Steps that were taken.
    pub iterations: usize,
    /// Whether they became small.
    pub converged: bool,
    /// The share of the points that have a place in the map.
    pub overlap: f64,
    /// The root of the mean square of what they miss it by, across the surface.
    pub residual_rms_m: f64,
    /// How long before it the motion was not measured, where that is longer than it can be predicted: scans are missing. 0 elsewhere.
    pub unknown_s: f64,
    /// The directions that were predicted, since the scene does not determine them.
    pub degenerate: Vec<Direction>,
}

/// The outcome of a scan.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Outcome {
    /// It is the first one.
    Started,
    /// It was registered to the map.
    Matched,
    /// It does not fit: the pose is the prediction.
    Held(RegistrationError),
    /// Too many scans in a row did not fit: the map begins anew with this one.
    BegunAnew(RegistrationError),
}

/// A scan is of no use.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum Refusal {
    /// There is nothing in it.
    #[error("the scan has no usable point: of {points} none is finite and within range")]
    NoPoints {
        /// The points that were given.
        points: usize,
    },
    /// It does not come after the one before.
    #[error(
        "the scan was measured {since_s} s after the last one: scans must come one after another in time"
    )]
    NotLater {
        /// From the last one to this one; negative when it is earlier.
        since_s: f64,
    },
    /// Points and times do not belong together.
    #[error("the scan has {points} points and {times} times: each point needs one")]
    Times {
        /// The points that were given.
        points: usize,
        /// The times.
        times: usize,
    },
    /// The times are none since the stamp, in seconds.
    #[error(
        "{far} of the scan's {points} points were measured more than {LONGEST_S} s from its stamp: times are seconds since the stamp"
    )]
    FarTimes {
        /// The points that were given.
        points: usize,
        /// Those whose time is farther away.
        far: usize,
    },
}
