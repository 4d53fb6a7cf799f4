//! Data on their way while the map is corrected.
//!
//! A cloud takes a while through the nodes. One that was measured before a correction has a pose in the map of before, and
//! comes when the map stands elsewhere already.

use std::collections::VecDeque;

use nalgebra::Isometry3;

use super::PathCorrection;
use crate::Stamp;

/// Nothing is longer on its way: of what seems to be, the clock was set back.
const LONGEST_WAY_S: f64 = 10.0;
/// So many corrections within that time are remembered.
const MOST_REMEMBERED: usize = 64;

/// The latest corrections, and from when on poses are told with them: what takes late data into the map as it is.
#[derive(Clone, Debug, Default)]
pub struct LateCorrections {
    corrections: VecDeque<(Stamp, Isometry3<f64>)>,
}

impl LateCorrections {
    /// The map was corrected; poses have it from `since` on. The last knot's motion is that of whatever comes late: the
    /// platform has hardly moved since.
    pub fn corrected(&mut self, since: Stamp, made: &PathCorrection) {
        let Some(last) = made.knots().last() else { return };
        while self.corrections.len() >= MOST_REMEMBERED {
            self.corrections.pop_front();
        }
        self.corrections.push_back((since, last.now_from_before));
    }

    /// What takes a pose of this moment, `map_from_rig`, into the map as it is: `now_from_before`; `None` where it is told
    /// in it. What is too long ago for a pose of this moment is forgotten.
    pub fn missed_at(&mut self, stamp: Stamp) -> Option<Isometry3<f64>> {
        let is_over = |since: &Stamp| stamp.seconds_since(*since) > LONGEST_WAY_S;
        while self.corrections.front().is_some_and(|(since, _)| is_over(since)) {
            self.corrections.pop_front();
        }
        let is_missed = |(since, _): &&(Stamp, Isometry3<f64>)| {
            stamp < *since && since.seconds_since(stamp) <= LONGEST_WAY_S
        };
        let missed = self.corrections.iter().filter(is_missed);
        missed.map(|(_, made)| *made).reduce(|first, then| then * first)
    }
}
