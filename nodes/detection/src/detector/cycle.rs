//! What goes into one cycle of detection, and what comes out of it.

use geometry::{
    Cloud, DetectedCycle, OrganisedCloud, PinholeFitError, ProjectableDepth, Scan, ScanError,
    Stamp, UnusablePose,
};
use nalgebra::Isometry3;

use crate::free_space::PoseJump;
use crate::zone_finder::Unmeasured;

/// What the camera saw in a cycle.
#[derive(Clone, Copy, Debug)]
pub enum View<'a> {
    /// Points in the camera's optical frame.
    PointsInCamera(&'a Cloud),
    /// Points of a camera's pixels, in its optical frame.
    OrganisedPoints(&'a OrganisedCloud),
    /// A depth image, of a projector from [`Detector::depth_projector`](super::Detector::depth_projector).
    Depth(ProjectableDepth<'a>),
}

impl View<'_> {
    /// When it was seen: the cycle's pose is that of this moment.
    pub(super) fn stamp(&self) -> Stamp {
        match self {
            Self::PointsInCamera(cloud) => cloud.stamp,
            Self::OrganisedPoints(cloud) => cloud.cloud().stamp,
            Self::Depth(depth) => depth.image().stamp,
        }
    }
}

/// What one cycle is computed from.
#[derive(Clone, Copy, Debug)]
pub struct CycleInput<'a> {
    /// The scan, which is the clock.
    pub scan: &'a Scan,
    /// The camera's view nearest to it.
    pub view: View<'a>,
    /// The pose at the view's stamp.
    pub map_from_rig: &'a Isometry3<f64>,
    /// The frame that `map_from_rig` leads to.
    pub map_frame_id: &'a str,
}

/// A stage of [`Detector::step`](super::Detector::step), for whoever times them.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Step {
    /// Cropping the scan and filling its gaps (3.2.1.1).
    GapFill,
    /// Mean and deviation over the window (3.2.1.2).
    Variability,
    /// The search for the zone (3.2.2).
    ZoneSearch,
    /// The voxel grid of the cloud (3.2.3).
    Reduction,
}

impl Step {
    /// The step's name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::GapFill => "gap_fill",
            Self::Variability => "variability",
            Self::ZoneSearch => "zone_search",
            Self::Reduction => "reduction",
        }
    }
}

/// What detection makes of a cycle.
#[derive(Clone, PartialEq, Debug)]
pub struct Detected {
    /// What segmentation needs.
    pub cycle: DetectedCycle,
    /// What a report needs.
    pub statistics: CycleStatistics,
}

/// What a report tells of a cycle.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CycleStatistics {
    /// Beams in the aperture: the thesis' l.
    pub beams: usize,
    /// Of these, beams whose range was filled in. Without two returns none is, and the method `free_space`
    /// fills nothing.
    pub filled_beams: usize,
    /// The largest deviation, once the window is full.
    pub max_std_dev_m: Option<f32>,
    /// Beams of high variability.
    pub high_variability_beams: usize,
    /// Beams in measured zones that end where free space was seen; 0 with the method `rec_hv`, which does
    /// not look for them.
    pub moving_beams: usize,
    /// Beams without a return, which say nothing of their own.
    pub unknown_beams: usize,
    /// Why the cycle has no measured zone, if it has none.
    pub unmeasured: Option<Unmeasured>,
    /// The scan's angles or number of beams are not those of the scan before: the window has started
    /// anew.
    pub window_restarted: bool,
    /// Why the cycle's depth image was rendered from the points of an organised cloud, if it was: no pinhole camera is known
    /// that the cloud was computed with.
    pub not_pinhole: Option<PinholeFitError>,
    /// The step of the pose since the last cycle, if no platform makes it: what earlier cycles saw was forgotten. None with the
    /// method `rec_hv`, which compares no poses.
    pub pose_jump: Option<PoseJump>,
}

impl CycleStatistics {
    /// Whether nothing could be found for want of returns.
    #[must_use]
    pub fn is_blind(&self) -> bool {
        matches!(self.unmeasured, Some(Unmeasured::TooFewReturns { .. }))
    }
}

/// A cycle that cannot be computed.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum DetectionError {
    /// The scan says nothing.
    #[error(transparent)]
    Scan(#[from] ScanError),
    /// The pose cannot carry a cloud.
    #[error(transparent)]
    Pose(#[from] UnusablePose),
}
