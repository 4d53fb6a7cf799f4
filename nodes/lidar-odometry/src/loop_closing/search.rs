//! The search for loops: the answers are there at once, or later.

use std::sync::Arc;

use estimation::Executor;
use geometry::Stamp;
use nalgebra::{Isometry3, Point3};

use super::{KnownLoops, LoopCloser, LoopClosingConfig, LoopOutcome};
use crate::registration::ParameterError;

/// A place of the drive, to be kept and looked for among the earlier ones.
#[derive(Clone, PartialEq, Debug)]
pub struct Place {
    /// When the vehicle was there.
    pub stamp: Stamp,
    /// Where the odometry has it.
    pub odom_from_vehicle: Isometry3<f64>,
    /// The points seen from there, as if measured at once, in the vehicle's frame (z up).
    pub points_m: Vec<Point3<f32>>,
}

/// The outcome of the search for a place.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LoopAnswer {
    /// When the vehicle was there.
    pub stamp: Stamp,
    /// The outcome.
    pub outcome: LoopOutcome,
}

/// A searcher for loops.
pub trait LoopSearch {
    /// Whether the vehicle has travelled far enough for [`Self::take`] to use its scan.
    fn wants(&self, odom_from_vehicle: &Isometry3<f64>) -> bool;

    /// Hands over a place. `false` where too many wait: it is not taken then.
    fn take(&mut self, place: Place) -> bool;

    /// The outcomes since the last call, in the order of the drive; [`Self::known`] is as it was after it from then on.
    fn answers(&mut self) -> Vec<LoopAnswer>;

    /// The known loops as of the last answers that were taken.
    fn known(&self) -> Arc<KnownLoops>;

    /// Whether nothing is being looked for, and nothing waits.
    fn is_idle(&self) -> bool;

    /// Forgets everything: the next place is the first one. What waits is not answered any more.
    fn forget(&mut self);
}

/// Searches in the caller's thread, which waits: the same scans give the same answers at the same scans.
#[derive(Clone, Debug)]
pub struct InlineSearch {
    closer: LoopCloser,
    known: Arc<KnownLoops>,
    answers: Vec<LoopAnswer>,
}

impl InlineSearch {
    /// One that has seen nothing.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(
        config: LoopClosingConfig,
        executor: Arc<dyn Executor>,
    ) -> Result<Self, ParameterError> {
        let closer = LoopCloser::new(config, executor)?;
        Ok(Self { closer, known: Arc::default(), answers: Vec::new() })
    }
}

impl LoopSearch for InlineSearch {
    fn wants(&self, odom_from_vehicle: &Isometry3<f64>) -> bool {
        self.closer.wants(odom_from_vehicle)
    }

    fn take(&mut self, place: Place) -> bool {
        let Place { stamp, odom_from_vehicle, points_m } = place;
        let outcome = self.closer.take(stamp, &odom_from_vehicle, &points_m);
        self.answers.push(LoopAnswer { stamp, outcome });
        true
    }

    fn answers(&mut self) -> Vec<LoopAnswer> {
        if !self.answers.is_empty() {
            self.known = Arc::new(self.closer.known());
        }
        std::mem::take(&mut self.answers)
    }

    fn known(&self) -> Arc<KnownLoops> {
        Arc::clone(&self.known)
    }

    fn is_idle(&self) -> bool {
        true
    }

    fn forget(&mut self) {
        self.closer.forget();
        self.known = Arc::default();
        self.answers.clear();
    }
}
