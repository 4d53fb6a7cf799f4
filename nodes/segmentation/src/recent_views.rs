//! What the camera would have seen of late.
//!
//! Before black surfaces, glass and what is out of reach no ray comes back, so that no place there is ever seen
//! free. But a camera that sees a thing now would have seen it before, had it been there: a place in view, hidden by
//! nothing, in whose direction nothing so near was met, was empty, whatever is behind it. That holds as far as the camera
//! saw anything at all in that cycle: what comes into its range has not arrived. A dark or slanting surface comes into
//! range at a short distance, so that where nothing came back the place must have been near.

#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use geometry::{DepthByDirection, DetectedCycle, View, slopes_from};
use nalgebra::{Isometry3, Point3, Vector2, distance};

/// Cycles that are remembered: three seconds of the RPLIDAR A1. One who crosses the view uncovers what he hid in a
/// second, one who goes away from the camera at 15 degrees to its line of sight, 0.6 m wide and at 1 m/s, in 2.3 s.
const VIEWS: usize = 24;
/// In so many of them a place must have been empty: as for the passes of rays (module `evidence`).
const MIN_EMPTY: usize = 3;
/// What a point hides reaches so far around it: half the diagonal of its voxel.
const HALF_DIAGONAL: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// What was met must lie so many voxels behind a place for that to have been empty: a point is the mean over a
/// voxel.
const BEHIND_VOXELS: f64 = 1.5;

/// The last cycles' views.
#[derive(Clone, Debug, Default)]
pub struct RecentViews {
    frames: VecDeque<Frame>,
}

/// The nearest that one cycle saw in each direction.
#[derive(Clone, Debug)]
struct Frame {
    map_from_rig: Isometry3<f64>,
    camera_in_rig_m: Point3<f64>,
    nearest: DepthByDirection,
    /// The farthest that came back, in metres: nothing is known of what is beyond; 0 for an empty cycle.
    farthest_m: f64,
    /// The edge of the voxels that its points are means of.
    cell_m: f64,
}

impl RecentViews {
    /// Forgets them.
    pub fn clear(&mut self) {
        self.frames.clear();
    }

    /// Whether a place of the map was in view and empty in enough of the cycles remembered. The camera has had the
    /// same view then as now, whether or not anything came back from its borders. Where nothing came back at all a cycle
    /// counts when its camera was no farther than `blank_reach_m` from the place.
    #[must_use]
    pub fn was_empty(&self, place_in_map: &Point3<f64>, view: &View, blank_reach_m: f64) -> bool {
        let was_empty = |frame: &&Frame| frame.was_empty(place_in_map, view, blank_reach_m);
        let empty = self.frames.iter().filter(was_empty);
        empty.take(MIN_EMPTY).count() == MIN_EMPTY
    }

    /// Remembers a cycle. `cell_m` is the edge of the voxels that its points are means of.
    pub fn remember(&mut self, cycle: &DetectedCycle, cell_m: f64) {
        if self.frames.len() == VIEWS {
            self.frames.pop_front();
        }
        self.frames.push_back(Frame::of(cycle, cell_m));
    }
}

impl Frame {
    fn of(cycle: &DetectedCycle, cell_m: f64) -> Self {
        let mut frame = Self {
            map_from_rig: cycle.map_from_rig,
            camera_in_rig_m: cycle.camera_in_rig_m,
            nearest: DepthByDirection::default(),
            farthest_m: 0.0,
            cell_m,
        };
        for point in &cycle.reduced_cloud.points_m {
            frame.take(&point.cast());
        }
        frame
    }

    fn take(&mut self, point_in_rig: &Point3<f64>) {
        let Some(slopes) = slopes_from(&self.camera_in_rig_m, point_in_rig) else { return };
        let depth_m = point_in_rig.x - self.camera_in_rig_m.x;
        self.farthest_m = self.farthest_m.max(depth_m);
        let reach = Vector2::repeat(HALF_DIAGONAL * self.cell_m / depth_m);
        self.nearest.keep_nearest(&slopes, &reach, depth_m);
    }

    fn was_empty(&self, place_in_map: &Point3<f64>, view: &View, blank_reach_m: f64) -> bool {
        let in_rig = self.map_from_rig.inverse_transform_point(place_in_map);
        let Some(slopes) = slopes_from(&self.camera_in_rig_m, &in_rig) else { return false };
        let depth_m = in_rig.x - self.camera_in_rig_m.x;
        let is_free = match self.nearest.depth_m(&slopes) {
            Some(nearest_m) => nearest_m > depth_m + BEHIND_VOXELS * self.cell_m,
            None => distance(&in_rig, &self.camera_in_rig_m) <= blank_reach_m,
        };
        view.contains(&slopes) && depth_m <= self.farthest_m && is_free
    }
}
