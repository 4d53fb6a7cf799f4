//! What belongs to one cycle and travels together.

use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

use crate::{Cloud, DynamicZone, Stamp};

/// What detection hands to segmentation: the reduced cloud, the pose and the zones of one cycle.
/// They are one value so that a cloud can never meet the pose or the zone of another cycle.
#[derive(Clone, PartialEq, Debug)]
pub struct DetectedCycle {
    /// Counts the cycles from 0; a dropped scan takes no number.
    pub index: u32,
    /// The scan that this cycle stands for: the scan is the clock (Rec-HV 3.3.1).
    pub scan_stamp: Stamp,
    /// The reduced cloud in the rig frame, stamped with its own measurement.
    pub reduced_cloud: Cloud,
    /// How many points each of the reduced cloud's is the mean of, in their order.
    pub voxel_points: Vec<u32>,
    /// Points of the cloud before the reduction.
    pub points_before_reduction: usize,
    /// The pose at the cloud's stamp.
    pub map_from_rig: Isometry3<f64>,
    /// The frame that `map_from_rig` leads to.
    pub map_frame_id: String,
    /// The camera's optical centre in the rig frame: where the rays to the cloud's points start.
    pub camera_in_rig_m: Point3<f64>,
    /// Where something moves; empty when nothing does.
    pub zones: Vec<DynamicZone>,
}

/// What segmentation hands to reconstruction: both parts of one cycle's cloud, and from where they were
/// seen.
#[derive(Clone, PartialEq, Debug)]
pub struct SegmentedCycle {
    /// The cycle's number, as detection gave it.
    pub index: u32,
    /// The static points in the map frame: the thesis' PCL_k.
    pub static_cloud: Cloud,
    /// The moving points in the rig frame: the thesis' PCL_Din.
    pub dynamic_cloud: Cloud,
    /// The pose of the rig when the cloud was measured.
    pub map_from_rig: Isometry3<f64>,
    /// The camera's optical centre in the rig frame: where the rays to the points start.
    pub camera_in_rig_m: Point3<f64>,
}

/// Points of each stage of the segmentation, for Table 5 of the thesis.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct SegmentationCounts {
    /// Points of the reduced cloud.
    pub reduced: usize,
    /// Of these, points within a zone: PCL_ZD, what the angle stage takes.
    pub in_zone: usize,
    /// Of these, points of the object: PCL_Din, what the depth stage takes.
    pub dynamic: usize,
}
