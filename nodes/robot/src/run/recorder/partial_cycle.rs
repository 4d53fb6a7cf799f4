//! A cycle that not all stages have reported yet.

use std::collections::BTreeMap;
use std::sync::Arc;

use geometry::{Cloud, DynamicZone, SegmentationCounts, Stamp};
use nalgebra::{Isometry3, Point3};
use report::{CycleRecord, CycleView};

use super::{CyclePlace, Stage, StepDurations};

/// What is kept of detection's result.
pub(super) struct DetectedPart {
    /// Follows the corrections of the trajectory.
    pub(super) place: CyclePlace,
    pub(super) reported_map_from_rig: Isometry3<f64>,
    pub(super) scan_stamp: Stamp,
    pub(super) zones: Vec<DynamicZone>,
    pub(super) points_in: usize,
}

/// What is known of a cycle so far.
#[derive(Default)]
pub(super) struct PartialCycle {
    pub(super) detected: Option<DetectedPart>,
    pub(super) dynamic_cloud: Option<Arc<Cloud>>,
    /// The tracks' positions in the map frame as it was when they were published.
    pub(super) tracks_m: Option<BTreeMap<u32, Point3<f64>>>,
    pub(super) counts: Option<SegmentationCounts>,
    pub(super) map_points: Option<usize>,
    pub(super) durations: [StepDurations; Stage::ALL.len()],
}

impl PartialCycle {
    pub(super) fn first_missing_stage(&self) -> Option<Stage> {
        let has_segmentation =
            self.counts.is_some() && self.dynamic_cloud.is_some() && self.tracks_m.is_some();
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
        let DetectedPart { place, reported_map_from_rig, scan_stamp, zones, points_in } =
            self.detected?;
        let CyclePlace { cloud_stamp, map_from_rig, .. } = place;
        // The tracks keep their positions relative to the rig when the trajectory is corrected.
        let corrected_from_reported = map_from_rig * reported_map_from_rig.inverse();
        let tracks_m = self.tracks_m?.into_iter();
        Some(CycleRecord {
            index,
            scan_stamp,
            cloud_stamp,
            map_from_rig,
            zones,
            points_in,
            counts: self.counts?,
            map_points: self.map_points?,
            dynamic_points_m: Arc::unwrap_or_clone(self.dynamic_cloud?).points_m,
            tracks_m: tracks_m.map(|(id, at_m)| (id, corrected_from_reported * at_m)).collect(),
            view,
            step_durations_s: self.durations.into_iter().flatten().collect(),
        })
    }
}
