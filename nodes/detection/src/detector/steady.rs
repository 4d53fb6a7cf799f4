//! A map that is corrected is no motion.

use geometry::MapPath;
use nalgebra::Isometry3;

use super::{CycleInput, Detector};

impl Detector {
    /// Takes the way of the platform as the map of its poses has it by now. Where the map was corrected, the pose jumps, and
    /// the platform has not moved: motion is looked for in a frame that does not jump ([`geometry::SteadyFrame`]). Without a
    /// path, and as long as none has moved, that is the map, to the bit. Cycles have the pose that they are given.
    pub fn follow_path(&mut self, path: MapPath) {
        self.steady.take(path);
    }

    /// Where the platform is in the frame in which motion is looked for.
    pub(super) fn steady_from_rig(&mut self, input: &CycleInput<'_>) -> Isometry3<f64> {
        match self.steady.map_from_steady(input.view.stamp(), input.map_frame_id) {
            None => *input.map_from_rig,
            Some(map_from_steady) => map_from_steady.inverse() * input.map_from_rig,
        }
    }
}
