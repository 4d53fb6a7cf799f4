//! What comes of looking for a loop.

use geometry::Stamp;
use pose_graph::GraphError;

/// What a scan was good for.
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
    /// What stands upright does not fit.
    #[error("of what stands there {percent:.0} % fits, of {places} places that look alike", percent = 100.0 * share)]
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
    /// No odometry drifts so far.
    #[error("the odometry would have drifted by {gap_m:.1} m and {gap_deg:.1} degrees on {way_m:.0} m", gap_deg = gap_rad.to_degrees())]
    TooFarOff {
        /// What it would be off by.
        gap_m: f64,
        /// And by what turn.
        gap_rad: f64,
        /// On what way.
        way_m: f64,
    },
    /// It contradicts the other loops.
    #[error("it contradicts the way between: {chi2:.0} squared standard deviations")]
    Contradicted {
        /// Its own error where it was not believed.
        chi2: f64,
    },
    /// Nobody waits for the answer any more.
    #[error("the search was given up")]
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
    pub way_m: f64,
    /// By how much the pose has changed.
    pub gap_m: f64,
    /// And by what turn.
    pub gap_rad: f64,
    /// How much of what stands there fits.
    pub fit_share: f64,
}
