//! Cycles on their way while the map is corrected.

use std::borrow::Cow;

use geometry::{Cloud, SegmentedCycle};

use super::super::StaticMap;

impl StaticMap {
    /// The cloud where the map has it by now.
    pub(in super::super) fn cloud_brought_over<'a>(&mut self, cloud: &'a Cloud) -> Cow<'a, Cloud> {
        match self.corrections.missed_at(cloud.stamp) {
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
        match self.corrections.missed_at(cloud.stamp) {
            None => Cow::Borrowed(cycle),
            Some(missed) => Cow::Owned(SegmentedCycle {
                static_cloud: cloud.transformed(&missed, &cloud.frame_id),
                map_from_rig: missed * cycle.map_from_rig,
                ..cycle.clone()
            }),
        }
    }
}
