//! One cycle's cloud into its static and dynamic parts.

use std::sync::Arc;

use geometry::{
    Cloud, DetectedCycle, DynamicZone, MaskSizeError, MaskedDepth, Method, ParameterError,
    SegmentationCounts, SegmentedCycle, Track, UnusablePose, check_pose,
};

use nalgebra::Point3;
use volume::{OccupancyConfigError, ViewError};

use crate::config::SegmentationConfig;
use crate::floor::Floor;
use crate::free_space::FreeSpaceSegmenter;
use crate::moving_pixels::MovingPixels;
use crate::two_stages::TwoStages;

/// A stage of [`Segmenter::step`], for whoever times them.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Step {
    /// What is known of the points' places, asked and learned; of `free_space` alone, and ends twice a cycle.
    Evidence,
    /// The angular stage, of all zones (3.2.5); in `free_space` all seeds.
    Angular,
    /// The depth stage, of all zones (3.2.6); in `free_space` the growth from the seeds.
    DepthClustering,
    /// The objects followed; of `free_space` alone.
    Tracking,
    /// The static part taken to the map frame (3.2.7).
    Transform,
    /// The verdict as a mask on the depth image, where the map is made of depth images.
    Mask,
}

impl Step {
    /// The step's name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Evidence => "evidence",
            Self::Angular => "angular",
            Self::DepthClustering => "depth_clustering",
            Self::Tracking => "tracking",
            Self::Transform => "transform",
            Self::Mask => "mask",
        }
    }
}

/// What segmentation makes of a cycle.
#[derive(Clone, PartialEq, Debug)]
pub struct Segmented {
    /// What reconstruction needs.
    pub cycle: SegmentedCycle,
    /// What moves, followed over the cycles, by rising id; empty where nothing is followed.
    pub tracks: Vec<Track>,
    /// How many points each stage took.
    pub counts: SegmentationCounts,
    /// The floor as the rig sees it, where one is known.
    pub floor_in_rig: Option<Floor>,
}

/// A cycle that cannot be segmented.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum SegmentationError {
    /// A bound of a zone is not a number, or the bounds are the wrong way round.
    #[error(
        "cycle {index}: the dynamic zone from {azimuth_min_rad} to {azimuth_max_rad} rad is none; its bounds \
         must be finite and in this order"
    )]
    Zone {
        /// The cycle.
        index: u32,
        /// The right-hand bound.
        azimuth_min_rad: f64,
        /// The left-hand bound.
        azimuth_max_rad: f64,
    },
    /// The mask is not one of the depth image.
    #[error(transparent)]
    Mask(#[from] MaskSizeError),
    /// The pose cannot carry a cloud: the static points would be lost.
    #[error("cycle {index}: {source}")]
    Pose {
        /// The cycle.
        index: u32,
        /// Why.
        source: UnusablePose,
    },
}

/// A segmenter cannot be made with these parameters.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum SegmenterError {
    /// One is out of its range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// There is no evidence with them.
    #[error(transparent)]
    Occupancy(#[from] OccupancyConfigError),
    /// There is no range of depths with them.
    #[error(transparent)]
    View(#[from] ViewError),
}

/// What one cycle's points are.
#[derive(Clone, PartialEq, Debug)]
pub struct Judged {
    /// For each point of the reduced cloud, whether it moves, or is newly occupied and may move.
    pub is_dynamic: Vec<bool>,
    /// The objects followed, by rising number.
    pub tracks: Vec<Track>,
    /// Points within a zone.
    pub in_zone: usize,
    /// As [`SegmentedCycle::retracted_m`].
    pub retracted_m: Vec<Point3<f32>>,
    /// The floor as the rig sees it, where one is known.
    pub floor_in_rig: Option<Floor>,
}

/// Cuts the moving objects out of each cycle's cloud (Rec-HV 3.3.3).
#[derive(Clone, Debug)]
pub struct Segmenter {
    implementation: Implementation,
    /// Where the map is made of depth images.
    moving_pixels: Option<MovingPixels>,
}

/// The two methods: each a whole implementation, chosen once.
#[derive(Clone, Debug)]
enum Implementation {
    RecHv(TwoStages),
    FreeSpace(Box<FreeSpaceSegmenter>),
}

impl Segmenter {
    /// A segmenter with these parameters.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(config: SegmentationConfig) -> Result<Self, SegmenterError> {
        config.validate()?;
        let edge_m = config.pipeline.voxel_edge_m;
        let grid = config.pipeline.voxel_grid()?;
        let implementation = match config.pipeline.method {
            Method::RecHv => Implementation::RecHv(TwoStages { cell_m: edge_m }),
            Method::FreeSpace => Implementation::FreeSpace(Box::new(FreeSpaceSegmenter::new(
                config.free_space,
                grid,
            )?)),
        };
        let moving_pixels = config.pipeline.needs_depth().then(|| MovingPixels::new(grid));
        Ok(Self { implementation, moving_pixels })
    }

    /// Blocks of evidence held now, at most `max_evidence_blocks`; the method of Rec-HV holds none.
    #[must_use]
    pub fn evidence_blocks(&self) -> usize {
        match &self.implementation {
            Implementation::RecHv(_) => 0,
            Implementation::FreeSpace(free_space) => free_space.evidence_blocks(),
        }
    }

    /// Whether all that the last cycle's image showed has joined the evidence. Otherwise the view has more blocks than
    /// `max_evidence_blocks`, or than the 30,000 that an image may update, and what moves is not found everywhere.
    #[must_use]
    pub fn evidence_is_whole(&self) -> bool {
        match &self.implementation {
            Implementation::RecHv(_) => true,
            Implementation::FreeSpace(free_space) => free_space.evidence_is_whole(),
        }
    }

    /// Splits the reduced cloud of a cycle that was made with the configuration's own pipeline: every point of it lands in
    /// exactly one of the two clouds, in the order it had. `observe` is called at the end of each stage.
    ///
    /// # Errors
    /// When a zone or the pose holds numbers that mean nothing.
    pub fn step(
        &mut self,
        cycle: &DetectedCycle,
        mut observe: impl FnMut(Step),
    ) -> Result<Segmented, SegmentationError> {
        check(cycle)?;
        let judged = match &mut self.implementation {
            Implementation::RecHv(two_stages) => two_stages.step(cycle, &mut observe),
            Implementation::FreeSpace(free_space) => free_space.step(cycle, &mut observe),
        };
        let Judged { is_dynamic, tracks, in_zone, retracted_m, floor_in_rig } = judged;

        // Eq. 7: PCL_est = PCL_ze || PCL_Oe. Eq. 8: PCL_k = Mt_k * PCL_est.
        let static_cloud = part_of(&cycle.reduced_cloud, &is_dynamic, false)
            .transformed(&cycle.map_from_rig, &cycle.map_frame_id);
        let dynamic_cloud = part_of(&cycle.reduced_cloud, &is_dynamic, true);
        observe(Step::Transform);
        let depth = match (&cycle.depth, &mut self.moving_pixels) {
            (Some(frame), Some(moving_pixels)) => {
                let frame = Arc::clone(frame);
                let (mounts, robot) = (&cycle.setup.mounts, cycle.setup.robot.as_ref());
                let camera = (&mounts.rig_from_camera, robot);
                let moving = dynamic_cloud.points_m.iter();
                let is_moving = moving_pixels.mask(&frame, camera, floor_in_rig.as_ref(), moving);
                observe(Step::Mask);
                Some(MaskedDepth::new(frame, is_moving)?)
            }
            _ => None,
        };

        let counts = SegmentationCounts {
            reduced: is_dynamic.len(),
            in_zone,
            dynamic: dynamic_cloud.points_m.len(),
        };
        let cycle = SegmentedCycle {
            index: cycle.index,
            setup: cycle.setup,
            static_cloud,
            dynamic_cloud,
            map_from_rig: cycle.map_from_rig,
            depth,
            scan_rays: Arc::clone(&cycle.scan_rays),
            retracted_m,
        };
        Ok(Segmented { cycle, tracks, counts, floor_in_rig })
    }
}

fn check(cycle: &DetectedCycle) -> Result<(), SegmentationError> {
    let index = cycle.index;
    for &DynamicZone { azimuth_min_rad, azimuth_max_rad, .. } in &cycle.zones {
        let in_order = azimuth_min_rad <= azimuth_max_rad;
        if !(in_order && azimuth_min_rad.is_finite() && azimuth_max_rad.is_finite()) {
            return Err(SegmentationError::Zone { index, azimuth_min_rad, azimuth_max_rad });
        }
    }
    check_pose(&cycle.map_from_rig).map_err(|source| SegmentationError::Pose { index, source })
}

/// The points of `cloud` that move, or those that do not, in their order.
fn part_of(cloud: &Cloud, is_dynamic: &[bool], wanted: bool) -> Cloud {
    let points_m = cloud
        .points_m
        .iter()
        .zip(is_dynamic)
        .filter_map(|(point, is_dynamic)| (*is_dynamic == wanted).then_some(*point))
        .collect();
    Cloud { stamp: cloud.stamp, frame_id: cloud.frame_id.clone(), points_m }
}

#[cfg(test)]
mod tests;
