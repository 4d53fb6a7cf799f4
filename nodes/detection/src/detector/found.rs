//! What a method finds in a cycle, whichever it is.

use geometry::{DynamicZone, MovingBeam, ScanRay};
use nalgebra::Isometry3;

use crate::free_space::{MotionSearch, PoseJump};
use crate::zone_finder::{Unmeasured, ZoneSearch};

/// The zones, and what the statistics tell of them.
pub(super) struct Found {
    pub(super) zones: Vec<DynamicZone>,
    /// Of the whole scan, by their indices in it.
    pub(super) hits: Vec<MovingBeam>,
    pub(super) rays: Vec<ScanRay>,
    pub(super) filled_beams: usize,
    pub(super) max_std_dev_m: Option<f32>,
    pub(super) high_variability_beams: usize,
    pub(super) moving_beams: usize,
    pub(super) unknown_beams: usize,
    pub(super) unmeasured: Option<Unmeasured>,
    pub(super) pose_jump: Option<PoseJump>,
    /// Where the frame in which it was looked for is in the map, unless it is the map.
    pub(super) map_from_continuous: Option<Isometry3<f64>>,
}

impl Found {
    pub(super) fn by_variability(
        search: ZoneSearch,
        filled_beams: usize,
        unknown_beams: usize,
    ) -> Self {
        Self {
            zones: search.zone.into_iter().collect(),
            // It knows deviations of ranges, and not which returns are the object's.
            hits: Vec::new(),
            rays: Vec::new(),
            filled_beams,
            max_std_dev_m: search.max_std_dev_m,
            high_variability_beams: search.high_variability_beams,
            moving_beams: 0,
            unknown_beams,
            unmeasured: search.unmeasured,
            // It asks for no pose.
            pose_jump: None,
            map_from_continuous: None,
        }
    }

    /// This method fills nothing in.
    pub(super) fn by_free_space(
        search: MotionSearch,
        map_from_continuous: Option<Isometry3<f64>>,
    ) -> Self {
        Self {
            zones: search.zones,
            hits: search.hits,
            rays: search.rays,
            filled_beams: 0,
            max_std_dev_m: search.max_std_dev_m,
            high_variability_beams: search.high_variability_beams,
            moving_beams: search.moving_beams,
            unknown_beams: search.unknown_beams,
            unmeasured: search.unmeasured,
            pose_jump: search.pose_jump,
            map_from_continuous,
        }
    }
}
