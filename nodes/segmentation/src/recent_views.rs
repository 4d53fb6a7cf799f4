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

use geometry::DetectedCycle;
use nalgebra::{Isometry3, Point3, Vector2, distance};

use crate::view::{MIN_DEPTH_M, View, slopes_from};

/// Cycles that are remembered: three seconds of the RPLIDAR A1. One who crosses the view uncovers what he hid in a
/// second, one who goes away from the camera at 15 degrees to its line of sight, 0.6 m wide and at 1 m/s, in 2.3 s.
const VIEWS: usize = 24;
/// In so many of them a place must have been empty: as for the passes of rays (module `evidence`).
const MIN_EMPTY: usize = 3;
/// The squares in which directions are gathered are so wide: a voxel of the thesis at 3 m.
const SQUARE_SLOPE: f64 = 0.027;
/// Squares along a side: a view of 120 degrees.
const SQUARES: usize = 128;
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
    /// Row by row from the lower right; infinite where nothing was met.
    nearest_m: Vec<f32>,
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
            nearest_m: vec![f32::INFINITY; SQUARES * SQUARES],
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
        let reach = Vector2::repeat(HALF_DIAGONAL * self.cell_m / depth_m.max(MIN_DEPTH_M));
        let (least, most) = (square(&(slopes - reach)), square(&(slopes + reach)));
        for row in least[1]..=most[1] {
            for column in least[0]..=most[0] {
                if let Some(nearest_m) = self.nearest_m.get_mut(row * SQUARES + column) {
                    *nearest_m = nearest_m.min(depth_m as f32);
                }
            }
        }
    }

    fn was_empty(&self, place_in_map: &Point3<f64>, view: &View, blank_reach_m: f64) -> bool {
        let in_rig = self.map_from_rig.inverse_transform_point(place_in_map);
        let Some(slopes) = slopes_from(&self.camera_in_rig_m, &in_rig) else { return false };
        let [column, row] = square(&slopes);
        let nearest_m = self.nearest_m.get(row * SQUARES + column).copied().map(f64::from);
        let depth_m = in_rig.x - self.camera_in_rig_m.x;
        let behind_m = depth_m + BEHIND_VOXELS * self.cell_m;
        view.contains(&slopes)
            && depth_m <= self.farthest_m
            && nearest_m.is_some_and(|nearest_m| {
                let is_blank = nearest_m.is_infinite();
                let was_near = || distance(&in_rig, &self.camera_in_rig_m) <= blank_reach_m;
                nearest_m > behind_m && (!is_blank || was_near())
            })
    }
}

/// Column and row of a direction, or of the nearest one that has any.
fn square(slopes: &Vector2<f64>) -> [usize; 2] {
    let from_corner = slopes / SQUARE_SLOPE + Vector2::repeat(0.5 * SQUARES as f64);
    // The casts saturate at 0.
    [from_corner.x, from_corner.y].map(|from_corner| (from_corner as usize).min(SQUARES - 1))
}
