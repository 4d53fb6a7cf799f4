//! Cycles on their way while the map is corrected.
//!
//! A cloud takes a while through the nodes. One that was measured before the correction has a pose in the map of before,
//! and comes when the map stands elsewhere already.

use std::borrow::Cow;
use std::collections::VecDeque;

use geometry::{Cloud, PathCorrection, SegmentedCycle, Stamp};
use nalgebra::Isometry3;

use super::super::StaticMap;

/// No cycle is longer on its way.
const LONGEST_WAY_S: f64 = 10.0;
/// So many corrections within that time are remembered.
const MOST_REMEMBERED: usize = 64;

/// The latest corrections, and from when on poses have them.
#[derive(Clone, Debug, Default)]
pub(super) struct LateCycles {
    corrections: VecDeque<(Stamp, Isometry3<f64>)>,
}

impl LateCycles {
    /// The map was corrected; poses have it from `since` on.
    pub(super) fn corrected(&mut self, since: Stamp, made: &PathCorrection) {
        while self.corrections.len() >= MOST_REMEMBERED {
            self.corrections.pop_front();
        }
        let last =
            made.knots().last().map_or_else(Isometry3::identity, |knot| knot.now_from_before);
        self.corrections.push_back((since, last));
    }

    /// What takes a cycle of this moment into the map as it is; `None` where it is told in it.
    fn missed_at(&mut self, stamp: Stamp) -> Option<Isometry3<f64>> {
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

impl StaticMap {
    /// The cloud where the map has it by now.
    pub(in super::super) fn cloud_brought_over<'a>(&mut self, cloud: &'a Cloud) -> Cow<'a, Cloud> {
        match self.missed_at(cloud.stamp) {
            None => Cow::Borrowed(cloud),
            Some(missed) => Cow::Owned(cloud.transformed(&missed, &cloud.frame_id)),
        }
    }

    /// The cycle where the map has it by now.
    pub(in super::super) fn cycle_brought_over<'a>(
        &mut self,
        cycle: &'a SegmentedCycle,
    ) -> Cow<'a, SegmentedCycle> {
        let cloud = &cycle.static_cloud;
        match self.missed_at(cloud.stamp) {
            None => Cow::Borrowed(cycle),
            Some(missed) => Cow::Owned(SegmentedCycle {
                static_cloud: cloud.transformed(&missed, &cloud.frame_id),
                map_from_rig: missed * cycle.map_from_rig,
                ..cycle.clone()
            }),
        }
    }

    fn missed_at(&mut self, stamp: Stamp) -> Option<Isometry3<f64>> {
        let missed = self.corrections.late.missed_at(stamp);
        self.corrections.counts.late_cycles += u64::from(missed.is_some());
        missed
    }
}
