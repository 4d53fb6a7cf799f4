//! A vehicle that is back where it was: how far the odometry has drifted since is known then, and taken out.
//!
//! | file | the idea |
//! |---|---|
//! | `config` | the parameters |
//! | `scan_context` | what a place looks like, whichever way the vehicle faces |
//! | `candidate` | the earlier places that this one may be |
//! | `verification` | the scan laid onto one of them: does what stands upright fit? |
//! | `correction` | the keyframes as a graph of poses; two loops that agree bend it |
//!
//! A street looks like the next one. So a place must pass four tests before it is believed: it lies where the drift may have
//! led; it looks alike; what stands there fits, and no other place fits as well; and another keyframe says the same.
//!
//! The odometry itself goes on undisturbed, as REP 105 asks: what changes is where its frame is in the map.

mod candidate;
mod config;
mod correction;
mod scan_context;
#[cfg(test)]
mod tests;
mod verification;

use std::collections::VecDeque;
use std::num::NonZeroUsize;

use geometry::{Stamp, VoxelGrid};
use nalgebra::{Isometry3, Point3};
use pose_graph::GraphError;

pub use self::config::LoopClosingConfig;
use self::correction::LoopEdge;
use self::scan_context::ScanContext;
use crate::registration::{ConfigError, is_finite_pose};

/// Knows the places of a drive, and finds them again.
///
/// Memory is bounded by `max_keyframes`. The same scans give the same poses, bit for bit, whatever the number of threads.
#[derive(Clone, Debug)]
pub struct LoopCloser {
    config: LoopClosingConfig,
    threads: NonZeroUsize,
    /// The places, in the order of the drive.
    keyframes: VecDeque<Keyframe>,
    /// How many have been forgotten: the number of the first of those that are left.
    forgotten: usize,
    /// Loops that were believed.
    loops: Vec<LoopEdge>,
    /// Those that wait for another one to say the same.
    unconfirmed: Vec<LoopEdge>,
    closed: usize,
    map_from_odom: Isometry3<f64>,
    /// The way at the last loop that was closed.
    closed_at_m: Option<f64>,
}

/// A place of the drive.
#[derive(Clone, Debug)]
struct Keyframe {
    stamp: Stamp,
    odom_from_vehicle: Isometry3<f64>,
    map_from_vehicle: Isometry3<f64>,
    /// From the first keyframe, along the drive.
    way_m: f64,
    /// What was seen from it, in the vehicle's frame.
    points_m: Vec<Point3<f32>>,
    context: ScanContext,
}

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

/// Where the vehicle was at a keyframe.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct KeyframePose {
    /// When.
    pub stamp: Stamp,
    /// By the odometry.
    pub odom_from_vehicle: Isometry3<f64>,
    /// With all loops that are known now.
    pub map_from_vehicle: Isometry3<f64>,
}

impl LoopCloser {
    /// One that has seen nothing.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(config: LoopClosingConfig, threads: NonZeroUsize) -> Result<Self, ConfigError> {
        config.validate()?;
        Ok(Self {
            config,
            threads,
            keyframes: VecDeque::new(),
            forgotten: 0,
            loops: Vec::new(),
            unconfirmed: Vec::new(),
            closed: 0,
            map_from_odom: Isometry3::identity(),
            closed_at_m: None,
        })
    }

    /// Forgets everything: the next scan is the first one.
    pub fn forget(&mut self) {
        self.keyframes.clear();
        self.forgotten = 0;
        self.loops.clear();
        self.unconfirmed.clear();
        self.closed = 0;
        self.map_from_odom = Isometry3::identity();
        self.closed_at_m = None;
    }

    /// Whether the vehicle has gone so far that [`Self::take`] has a use for its scan.
    #[must_use]
    pub fn wants(&self, odom_from_vehicle: &Isometry3<f64>) -> bool {
        is_finite_pose(odom_from_vehicle)
            && self.step_m(odom_from_vehicle).is_none_or(|m| m >= self.config.keyframe_distance_m)
    }

    /// Takes in a scan: its points as if measured at once, in the vehicle's frame (z up), and where the odometry has the
    /// vehicle.
    pub fn take(
        &mut self,
        stamp: Stamp,
        odom_from_vehicle: &Isometry3<f64>,
        points_m: &[Point3<f32>],
    ) -> LoopOutcome {
        if !self.wants(odom_from_vehicle) {
            return LoopOutcome::TooNear;
        }
        let step_m = self.step_m(odom_from_vehicle).unwrap_or(0.0);
        let way_m = self.keyframes.back().map_or(0.0, |last| last.way_m) + step_m;
        let within = |point: &&Point3<f32>| {
            f64::from(point.coords.norm_squared()) <= self.config.keyframe_range_m.powi(2)
        };
        let near_m: Vec<Point3<f32>> = points_m.iter().filter(within).copied().collect();
        // The edge was checked, and is a positive number.
        let points_m = VoxelGrid::new(self.config.keyframe_voxel_edge_m)
            .map(|grid| grid.reduce(&near_m))
            .unwrap_or_default();
        let keyframe = Keyframe {
            stamp,
            odom_from_vehicle: *odom_from_vehicle,
            map_from_vehicle: self.map_from_odom * odom_from_vehicle,
            way_m,
            context: ScanContext::of(&points_m),
            points_m,
        };
        self.keyframes.push_back(keyframe);
        self.forget_oldest();
        self.look_for_a_loop()
    }

    /// Where the odometry's frame is in the map: the identity until a loop was closed.
    #[must_use]
    pub fn map_from_odom(&self) -> Isometry3<f64> {
        self.map_from_odom
    }

    /// Where a pose of the odometry is in the map, by the keyframes before and after it.
    #[must_use]
    pub fn map_from_vehicle(
        &self,
        stamp: Stamp,
        odom_from_vehicle: &Isometry3<f64>,
    ) -> Isometry3<f64> {
        let by = |keyframe: &Keyframe| {
            keyframe.map_from_vehicle * keyframe.odom_from_vehicle.inverse() * odom_from_vehicle
        };
        let after = self.keyframes.partition_point(|keyframe| keyframe.stamp <= stamp);
        let before = after.checked_sub(1).and_then(|before| self.keyframes.get(before));
        match (before, self.keyframes.get(after)) {
            (Some(before), Some(after)) => {
                let whole_s = after.stamp.seconds_since(before.stamp);
                let share = stamp.seconds_since(before.stamp) / whole_s.max(f64::MIN_POSITIVE);
                let (from, to) = (by(before), by(after));
                // Half a turn between neighbours is none that a vehicle makes.
                from.try_lerp_slerp(&to, share.clamp(0.0, 1.0), f64::EPSILON).unwrap_or(from)
            }
            (Some(only), None) | (None, Some(only)) => by(only),
            (None, None) => *odom_from_vehicle,
        }
    }

    /// The keyframes that are remembered, in the order of the drive.
    pub fn keyframes(&self) -> impl ExactSizeIterator<Item = KeyframePose> + '_ {
        self.keyframes.iter().map(|keyframe| KeyframePose {
            stamp: keyframe.stamp,
            odom_from_vehicle: keyframe.odom_from_vehicle,
            map_from_vehicle: keyframe.map_from_vehicle,
        })
    }

    /// How often a loop was closed.
    #[must_use]
    pub fn closed_loops(&self) -> usize {
        self.closed
    }

    fn step_m(&self, odom_from_vehicle: &Isometry3<f64>) -> Option<f64> {
        let last = &self.keyframes.back()?.odom_from_vehicle;
        Some((odom_from_vehicle.translation.vector - last.translation.vector).norm())
    }

    /// The oldest places go, and the loops that lead there: what is left keeps where it is.
    fn forget_oldest(&mut self) {
        while self.keyframes.len() > self.config.max_keyframes {
            self.keyframes.pop_front();
            self.forgotten += 1;
        }
        let first = self.forgotten;
        self.loops.retain(|edge| edge.from >= first);
        self.unconfirmed.retain(|edge| edge.from >= first);
    }

    /// Four tests, from the cheapest to the dearest.
    fn look_for_a_loop(&mut self) -> LoopOutcome {
        let Some(now) = self.keyframes.back() else { return LoopOutcome::TooNear };
        let way_m = now.way_m;
        if self.closed_at_m.is_some_and(|at_m| way_m - at_m < self.config.closure_distance_m) {
            return LoopOutcome::NewPlace;
        }
        let candidates = self.candidates();
        if candidates.is_empty() {
            return LoopOutcome::NewPlace;
        }
        match self.verified(&candidates) {
            Ok(edge) => self.believe(edge),
            Err(reason) => LoopOutcome::Refused(reason),
        }
    }

    /// By how much the odometry may be off after a way: three standard deviations.
    fn drift(&self, way_m: f64) -> (f64, f64) {
        /// Of a right loop one in some hundred lies farther off.
        const DEVIATIONS: f64 = 3.0;
        let root_km = (way_m / 1000.0).sqrt();
        (
            DEVIATIONS * self.config.drift_m_per_km * root_km,
            DEVIATIONS * self.config.drift_deg_per_km.to_radians() * root_km,
        )
    }
}
