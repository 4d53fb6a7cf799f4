//! The outcome of a search for a loop.

use geometry::Stamp;
use pose_graph::GraphError;

/// The outcome of a scan.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum LoopOutcome {
    /// The vehicle has not gone far enough since the last keyframe.
    TooNear,
    /// It is a new keyframe, and no earlier one may be the same place.
    NewPlace,
    /// Earlier places look alike, but it is none of them.
    Refused(NotALoop),
    /// It is an earlier place; another keyframe must say so, too.
    Unconfirmed,
    /// A loop was closed.
    Closed(ClosedLoop),
}

/// Why a place that looks like an earlier one is not taken for it.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum NotALoop {
    /// The upright surfaces do not fit.
    #[error("{percent:.0} % of the upright surfaces fit, of {places} places that look alike", percent = 100.0 * share)]
    DoesNotFit {
        /// How many places were tried.
        places: usize,
        /// The largest share that fits one of them.
        share: f64,
    },
    /// Two places fit alike.
    #[error("two places that lie {apart_m:.1} m apart fit alike")]
    Ambiguous {
        /// How far apart they would put the vehicle.
        apart_m: f64,
    },
    /// The odometry cannot drift this far.
    #[error("the odometry would have drifted by {gap_m:.1} m and {gap_deg:.1} degrees on {travelled_m:.0} m", gap_deg = gap_rad.to_degrees())]
    TooFarOff {
        /// The drift that the loop implies.
        gap_m: f64,
        /// And by what turn.
        gap_rad: f64,
        /// Over this distance.
        travelled_m: f64,
    },
    /// It contradicts the other loops.
    #[error("it contradicts the odometry between: {chi2:.0} squared standard deviations")]
    Contradicted {
        /// Its own error where it was not accepted.
        chi2: f64,
    },
    /// The answer is not needed any more.
    #[error("the search was aborted")]
    GivenUp,
    /// The graph cannot be optimised.
    #[error(transparent)]
    Graph(#[from] GraphError),
}

/// A loop that was closed.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ClosedLoop {
    /// When the vehicle was there before.
    pub before: Stamp,
    /// How far it has driven since.
    pub travelled_m: f64,
    /// By how much the pose has changed.
    pub gap_m: f64,
    /// And by what turn.
    pub gap_rad: f64,
    /// The share of the upright surfaces that fits.
    pub fit_share: f64,
}
