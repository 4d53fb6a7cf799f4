//! A vehicle that is back where it was: how far the odometry has drifted since is known then, and taken out.
//!
//! | file | the idea |
//! |---|---|
//! | `config` | the parameters |
//! | `scan_context` | the appearance of a place, independent of the vehicle's heading |
//! | `candidate` | the earlier places that this one may be |
//! | `verification` | the scan registered to one of them: do the upright surfaces fit? |
//! | `correction` | the keyframes as a graph of poses; two loops that agree bend it |
//! | `outcome` | the outcome of a search for a loop |
//! | `known` | the loops known of a drive, independent of the searcher |
//! | `search`, `background` | the searcher: the caller's thread, or a thread of its own |
//!
//! Streets look alike. So a place must pass four tests before it is accepted: it is within the possible
//! drift; it looks alike; the surfaces there fit, and those of no other place as well; and another keyframe confirms it.
//!
//! The odometry itself continues undisturbed, as REP 105 requires: only the pose of its frame in the map changes.

mod candidate;
mod config;
mod correction;
mod known;
mod outcome;
mod scan_context;
mod search;
#[cfg(test)]
mod tests;
mod verification;

use std::collections::VecDeque;
use std::sync::Arc;

use estimation::Executor;
use geometry::{Stamp, VoxelGrid};
use nalgebra::{Isometry3, Point3};

pub use self::config::LoopClosingConfig;
use self::correction::LoopEdge;
pub use self::known::{KeyframePose, KnownLoops};
pub use self::outcome::{ClosedLoop, LoopOutcome, NotALoop};
use self::scan_context::ScanContext;
pub use self::search::{InlineSearch, LoopAnswer, LoopSearch, Place};
use crate::registration::ParameterError;

/// Knows the places of a drive, and finds them again.
///
/// Memory is bounded by `max_keyframes`. The same scans give the same poses, bit for bit, whatever the number of threads.
#[derive(Clone, Debug)]
pub struct LoopCloser {
    config: LoopClosingConfig,
    executor: Arc<dyn Executor>,
    /// The places, in the order of the drive.
    keyframes: VecDeque<Keyframe>,
    /// How many have been forgotten: the number of the first of those that are left.
    forgotten: usize,
    /// Loops that were accepted.
    loops: Vec<LoopEdge>,
    /// Those that wait for another one to say the same.
    unconfirmed: Vec<LoopEdge>,
    closed: usize,
    map_from_odom: Isometry3<f64>,
    /// The distance travelled at the last closed loop.
    closed_at_m: Option<f64>,
}

/// A place of the drive.
#[derive(Clone, Debug)]
struct Keyframe {
    stamp: Stamp,
    odom_from_vehicle: Isometry3<f64>,
    map_from_vehicle: Isometry3<f64>,
    /// From the first keyframe, along the drive.
    travelled_m: f64,
    /// The points seen from it, in the vehicle's frame.
    points_m: Vec<Point3<f32>>,
    context: ScanContext,
}

impl LoopCloser {
    /// One that has seen nothing.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(
        config: LoopClosingConfig,
        executor: Arc<dyn Executor>,
    ) -> Result<Self, ParameterError> {
        config.validate()?;
        Ok(Self {
            config,
            executor,
            keyframes: VecDeque::new(),
            forgotten: 0,
            loops: Vec::new(),
            unconfirmed: Vec::new(),
            closed: 0,
            map_from_odom: Isometry3::identity(),
            closed_at_m: None,
        })
    }

    /// The parameters.
    #[must_use]
    pub fn config(&self) -> &LoopClosingConfig {
        &self.config
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

    /// Whether the vehicle has travelled far enough for [`Self::take`] to use its scan.
    #[must_use]
    pub fn wants(&self, odom_from_vehicle: &Isometry3<f64>) -> bool {
        let last = self.keyframes.back().map(|last| &last.odom_from_vehicle);
        self.config.is_far_enough(last, odom_from_vehicle)
    }

    /// Takes in a scan, and looks whether the vehicle is back where it was: its points as if measured at once, in the
    /// vehicle's frame (z up), and where the odometry has the vehicle.
    pub fn take(
        &mut self,
        stamp: Stamp,
        odom_from_vehicle: &Isometry3<f64>,
        points_m: &[Point3<f32>],
    ) -> LoopOutcome {
        if !self.keep(stamp, odom_from_vehicle, points_m) {
            return LoopOutcome::TooNear;
        }
        self.look(&|| false)
    }

    /// Takes in a scan as a keyframe, if the vehicle has gone far enough, and looks for nothing: this is quick.
    pub fn keep(
        &mut self,
        stamp: Stamp,
        odom_from_vehicle: &Isometry3<f64>,
        points_m: &[Point3<f32>],
    ) -> bool {
        if !self.wants(odom_from_vehicle) {
            return false;
        }
        let last = self.keyframes.back();
        let travelled_m = last.map_or(0.0, |last| {
            let step_m =
                last.odom_from_vehicle.translation.vector - odom_from_vehicle.translation.vector;
            last.travelled_m + step_m.norm()
        });
        let within = |point: &&Point3<f32>| {
            f64::from(point.coords.norm_squared()) <= self.config.keyframe_range_m.powi(2)
        };
        let near_m: Vec<Point3<f32>> = points_m.iter().filter(within).copied().collect();
        // The edge was checked, and is a positive number.
        let points_m = VoxelGrid::new(self.config.keyframe_voxel_edge_m)
            .map(|grid| grid.reduce(&near_m))
            .unwrap_or_default();
        self.keyframes.push_back(Keyframe {
            stamp,
            odom_from_vehicle: *odom_from_vehicle,
            map_from_vehicle: self.map_from_odom * odom_from_vehicle,
            travelled_m,
            context: ScanContext::of(&points_m),
            points_m,
        });
        self.forget_oldest();
        true
    }

    /// Checks whether the last keyframe is an earlier place, by four tests, from the cheapest to the dearest. This takes a
    /// second where there are many points; it ends soon after `is_aborted` returns true.
    pub fn look(&mut self, is_aborted: &dyn Fn() -> bool) -> LoopOutcome {
        let Some(now) = self.keyframes.back() else { return LoopOutcome::TooNear };
        let travelled_m = now.travelled_m;
        if self.closed_at_m.is_some_and(|at_m| travelled_m - at_m < self.config.closure_distance_m)
        {
            return LoopOutcome::NewPlace;
        }
        let candidates = self.candidates();
        if candidates.is_empty() {
            return LoopOutcome::NewPlace;
        }
        match self.verified(&candidates, is_aborted) {
            Ok(edge) => self.accept(edge),
            Err(reason) => LoopOutcome::Refused(reason),
        }
    }

    /// The current state of the drive.
    #[must_use]
    pub fn known(&self) -> KnownLoops {
        let keyframes = self.keyframes.iter().map(|keyframe| KeyframePose {
            stamp: keyframe.stamp,
            odom_from_vehicle: keyframe.odom_from_vehicle,
            map_from_vehicle: keyframe.map_from_vehicle,
        });
        KnownLoops {
            map_from_odom: self.map_from_odom,
            keyframes: keyframes.collect(),
            closed: self.closed,
        }
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

    /// The largest error of the odometry after a distance: three standard deviations.
    fn drift(&self, travelled_m: f64) -> (f64, f64) {
        /// Of a right loop one in some hundred lies farther off.
        const DEVIATIONS: f64 = 3.0;
        let root_km = (travelled_m / 1000.0).sqrt();
        (
            DEVIATIONS * self.config.drift_m_per_km * root_km,
            DEVIATIONS * self.config.drift_deg_per_km.to_radians() * root_km,
        )
    }
}
