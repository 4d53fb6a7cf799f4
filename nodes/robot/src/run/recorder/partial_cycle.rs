//! A cycle that not all stages have reported yet.

use std::collections::BTreeMap;

use geometry::{DetectedCycle, SegmentationCounts};
use nalgebra::{Isometry3, Point3};
use report::{CycleRecord, CycleView};

use super::{Stage, StepDurations};

/// What is known of a cycle so far.
#[derive(Default)]
pub(super) struct PartialCycle {
    pub(super) detected: Option<DetectedCycle>,
    /// The pose that detection reported; that of `detected` follows the corrections of the trajectory.
    pub(super) reported_map_from_rig: Isometry3<f64>,
    pub(super) dynamic_points_m: Option<Vec<Point3<f32>>>,
    /// The tracks' positions in the map frame as it was when they were published.
    pub(super) tracks_m: Option<BTreeMap<u32, Point3<f64>>>,
    pub(super) counts: Option<SegmentationCounts>,
    pub(super) map_points: Option<usize>,
    pub(super) durations: [StepDurations; Stage::ALL.len()],
}

impl PartialCycle {
    pub(super) fn first_missing_stage(&self) -> Option<Stage> {
        let has_segmentation =
            self.counts.is_some() && self.dynamic_points_m.is_some() && self.tracks_m.is_some();
        if self.detected.is_none() {
            Some(Stage::Detection)
        } else if !has_segmentation {
            Some(Stage::Segmentation)
        } else if self.map_points.is_none() {
            Some(Stage::Reconstruction)
        } else {
            None
        }
    }

    pub(super) fn into_record(self, index: u32, view: Option<CycleView>) -> Option<CycleRecord> {
        let detected = self.detected?;
        // The tracks keep their positions relative to the rig when the trajectory is corrected.
        let corrected_from_reported = detected.map_from_rig * self.reported_map_from_rig.inverse();
        let tracks_m = self.tracks_m?.into_iter();
        Some(CycleRecord {
            index,
            scan_stamp: detected.scan_stamp,
            cloud_stamp: detected.reduced_cloud.stamp,
            map_from_rig: detected.map_from_rig,
            zones: detected.zones,
            points_in: detected.points_before_reduction,
            counts: self.counts?,
            map_points: self.map_points?,
            dynamic_points_m: self.dynamic_points_m?,
            tracks_m: tracks_m.map(|(id, at_m)| (id, corrected_from_reported * at_m)).collect(),
            view,
            step_durations_s: self.durations.into_iter().flatten().collect(),
        })
    }
}
