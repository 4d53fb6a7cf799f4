//! The method `free_space` ([`crate::free_space`]) on the whole turn of the scanner, in a frame that does not jump.

use geometry::{ContinuousFrame, MapPath};
use nalgebra::Isometry3;

use super::super::cycle::{CycleInput, Step};
use super::super::found::Found;
use super::super::surround::ScanBeams;
use crate::config::DetectionConfig;
use crate::free_space::{MotionFinder, MotionInput};

/// Finds the zones by the free space that was observed before.
#[derive(Clone, Debug)]
pub(in crate::detector) struct FreeSpaceFinder {
    motion: MotionFinder,
    continuous: ContinuousFrame,
}

impl FreeSpaceFinder {
    pub(super) fn new(config: &DetectionConfig) -> Self {
        Self { motion: MotionFinder::new(config), continuous: ContinuousFrame::default() }
    }

    pub(super) fn find(
        &mut self,
        input: &CycleInput<'_>,
        beams: &ScanBeams,
        rig_from_lidar: &Isometry3<f64>,
        observe: &mut impl FnMut(Step),
    ) -> Found {
        let map_from_continuous =
            self.continuous.map_from_continuous(input.view.stamp(), input.map_frame_id);
        // Where the map was corrected the pose jumps, and the platform has not moved.
        let continuous_from_rig = match &map_from_continuous {
            None => *input.map_from_rig,
            Some(map_from_continuous) => map_from_continuous.inverse() * input.map_from_rig,
        };
        observe(Step::GapFill);
        let motion_input = MotionInput {
            scan: input.scan,
            beams: &beams.all,
            rig_from_lidar,
            map_from_rig: &continuous_from_rig,
            map_frame_id: input.map_frame_id,
            pose_stamp: input.view.stamp(),
        };
        let deviations = self.motion.take_in(&motion_input);
        observe(Step::Variability);
        let mut search = self.motion.find(&deviations, &beams.within);
        observe(Step::ZoneSearch);
        for hit in &mut search.hits {
            hit.index = beams.all[hit.index as usize].index as u32;
        }
        search.hits.sort_by_key(|hit| hit.index);
        Found::by_free_space(search, map_from_continuous)
    }

    pub(super) fn set_aperture(&mut self, aperture_rad: f64) {
        self.motion.set_aperture(aperture_rad);
    }

    /// The scan's geometry is another than before.
    pub(super) fn clear_window(&mut self) {
        self.motion.clear_window();
    }

    pub(super) fn clear(&mut self) {
        self.continuous.clear();
        self.motion.clear();
    }

    /// Motion is looked for in a frame that does not jump when the map is corrected ([`ContinuousFrame`]). Without a path, and as
    /// long as none has moved, that is the map, to the bit.
    pub(super) fn follow_path(&mut self, path: MapPath) {
        self.continuous.take(path);
    }
}
