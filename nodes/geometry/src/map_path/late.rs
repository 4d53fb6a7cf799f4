//! Data in transit while the map is corrected.
//!
//! A cloud takes some time through the nodes. One that was measured before a correction has a pose in the earlier map, and
//! arrives when the map has already been corrected.

use std::collections::VecDeque;

use nalgebra::Isometry3;

use super::PathCorrection;
use crate::Stamp;

/// The longest time in transit: where data seem older, the clock was set back.
const LONGEST_WAY_S: f64 = 10.0;
/// The most corrections within that time that are remembered.
const MOST_REMEMBERED: usize = 64;

/// The latest corrections, and from when on poses include them: they take late data into the current map.
#[derive(Clone, Debug, Default)]
pub struct LateCorrections {
    corrections: VecDeque<(Stamp, Isometry3<f64>)>,
}

impl LateCorrections {
    /// The map was corrected; poses include it from `since` on. Late data get the last knot's motion: the
    /// platform has hardly moved since.
    pub fn corrected(&mut self, since: Stamp, made: &PathCorrection) {
        let Some(last) = made.knots().last() else { return };
        while self.corrections.len() >= MOST_REMEMBERED {
            self.corrections.pop_front();
        }
        self.corrections.push_back((since, last.now_from_before));
    }

    /// The motion that takes a pose of this moment, `map_from_rig`, into the current map: `now_from_before`; `None` where the pose is
    /// in it already. Corrections too old for a pose of this moment are forgotten.
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
