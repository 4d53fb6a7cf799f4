//! The data of one cycle, which travel together.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

use crate::{
    Cloud, ColourSizeError, CycleSetup, DepthFrame, DynamicZone, MaskedDepth, MovingBeam, ScanRay,
    Stamp,
};

/// The output of detection to segmentation: the reduced cloud, the pose and the zones of one cycle.
/// They are one value so that a cloud is never combined with the pose or the zone of another cycle.
#[derive(Clone, PartialEq, Debug)]
pub struct DetectedCycle {
    /// Counts the cycles from 0; a dropped scan takes no number.
    pub index: u32,
    /// The setup it was made with: the pipeline's configuration, and the mounts as they were in this cycle.
    pub setup: CycleSetup,
    /// The scan of this cycle: the scan is the clock (Rec-HV 3.3.1).
    pub scan_stamp: Stamp,
    /// The reduced cloud in the rig frame, stamped with its own measurement.
    pub reduced_cloud: Cloud,
    /// How many points each of the reduced cloud's is the mean of, in their order.
    pub voxel_points: Vec<u32>,
    /// Points of the cloud before the reduction.
    pub points_before_reduction: usize,
    /// The pose at the cloud's stamp.
    pub map_from_rig: Isometry3<f64>,
    /// The pose, in the map, of a frame that does not jump when the map is corrected ([`ContinuousFrame`](crate::ContinuousFrame));
    /// absent while that is the map itself. What moves is looked for in it.
    pub map_from_continuous: Option<Isometry3<f64>>,
    /// The frame that `map_from_rig` leads to.
    pub map_frame_id: String,
    /// Zones with moving objects; empty when there are none.
    pub zones: Vec<DynamicZone>,
    /// The beams of the scan that hit something that moves, by rising index, in whatever direction; none where the method does
    /// not know single beams (`rec_hv`).
    pub moving_beams: Vec<MovingBeam>,
    /// The depth image of the cloud, or one that is made of the cloud, with its stamp, and its colours where the cycle has a
    /// colour image; absent where the method has no use for it
    /// ([`PipelineConfig::needs_depth`](crate::PipelineConfig::needs_depth)).
    pub depth: Option<Arc<DepthFrame>>,
    /// The rays of the scan; none where the method does not know single beams (`rec_hv`).
    pub scan_rays: Arc<Vec<ScanRay>>,
}

impl DetectedCycle {
    /// The pose at the cloud's stamp in the frame that does not jump: to the bit that in the map while it is the map.
    #[must_use]
    pub fn continuous_from_rig(&self) -> Isometry3<f64> {
        match &self.map_from_continuous {
            None => self.map_from_rig,
            Some(map_from_continuous) => map_from_continuous.inverse() * self.map_from_rig,
        }
    }

    /// Gives the depth image the colours of its pixels; see [`DepthFrame::with_colours`]. A cycle without a depth image has no use
    /// for them.
    ///
    /// # Errors
    /// When they are not as many as the pixels; the cycle is then without colours.
    pub fn colour(&mut self, colours: Vec<[u8; 3]>) -> Result<(), ColourSizeError> {
        if let Some(frame) = &mut self.depth {
            Arc::make_mut(frame).set_colours(colours)?;
        }
        Ok(())
    }
}

/// The output of segmentation to reconstruction: both parts of one cycle's cloud, and from where they were
/// seen.
#[derive(Clone, PartialEq, Debug)]
pub struct SegmentedCycle {
    /// The cycle's number, as detection gave it.
    pub index: u32,
    /// The setup it was made with, as detection gave it.
    pub setup: CycleSetup,
    /// The static points in the map frame: the thesis' PCL_k.
    pub static_cloud: Cloud,
    /// The moving points in the rig frame: the thesis' PCL_Din.
    pub dynamic_cloud: Cloud,
    /// The pose of the rig when the cloud was measured.
    pub map_from_rig: Isometry3<f64>,
    /// The depth image and what moves in it; absent where [`DetectedCycle::depth`] is.
    pub depth: Option<MaskedDepth>,
    /// The rays of the scan, as [`DetectedCycle::scan_rays`].
    pub scan_rays: Arc<Vec<ScanRay>>,
    /// Points that were static in earlier cycles, in the map frame, and are known by now to be of an object that has gone from there:
    /// the map is to forget what it has within a voxel of them.
    pub retracted_m: Vec<Point3<f32>>,
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
