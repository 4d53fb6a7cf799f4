//! What the camera would have seen of late.
//!
//! From black surfaces, glass and what is out of reach no ray returns, so that no place before them is ever observed free. But
//! a camera that sees a thing now would have seen it before, had it been there: a place in view, hidden by nothing, in whose
//! direction nothing so near was hit, was empty, whatever is behind it. That holds as far as the camera saw anything at all
//! in that cycle: a surface that comes into range was there before. A dark or slanting surface comes into range at a short
//! distance, so that where no ray returned the place must have been near.
//!
//! For the same reason no ray ever passes the place of someone who stood there and left: the background that he was taken for
//! is cleared when the camera has seen nothing there for long enough since.

#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use geometry::{CloudView, DepthByDirection, DetectedCycle, Stamp, View};
use nalgebra::{Point3, distance};

/// Cycles that are remembered: three and a half seconds of the RPLIDAR A1. One who crosses the view uncovers what he hid in a
/// second, one who goes away from the camera at 15 degrees to its line of sight, 0.6 m wide and at 1 m/s, in 2.3 s.
const VIEWS: usize = 24;
/// In so many of them a place must have been empty: as for the passes of [`volume::Occupancy`].
const MIN_EMPTY: usize = 3;
/// In so many of them, since its last hit, a place of the background must have been empty to be cleared: a dark surface that
/// is seen in one cycle of ten is kept six times in seven.
const MIN_GONE: usize = 18;

/// The last cycles' views.
#[derive(Clone, Debug, Default)]
pub struct RecentViews {
    frames: VecDeque<Frame>,
    /// The farthest that was ever hit in each direction.
    farthest: DepthByDirection,
}

/// What one cycle saw.
#[derive(Clone, Debug)]
struct Frame {
    stamp: Stamp,
    sight: CloudView,
}

impl RecentViews {
    /// Forgets them.
    pub fn clear(&mut self) {
        self.frames.clear();
        self.farthest.clear();
    }

    /// Whether a place of the map was in view and empty in enough of the cycles remembered. The camera has had the
    /// same view then as now, whether or not rays returned from its borders. Where no ray returned at all a cycle
    /// counts when its camera was no farther than `blank_reach_m` from the place.
    #[must_use]
    pub fn was_empty(&self, place_in_map: &Point3<f64>, view: &View, blank_reach_m: f64) -> bool {
        let was_empty = |frame: &&Frame| frame.was_empty(place_in_map, view, blank_reach_m);
        let empty = self.frames.iter().filter(was_empty);
        empty.take(MIN_EMPTY).count() == MIN_EMPTY
    }

    /// Whether what was hit last at `last_hit` in a place of the map has left since: its direction was blank in enough of
    /// the cycles that were remembered from then on, or rays went past it. The cameras of these cycles saw the place as
    /// well as the one that is at `camera_in_map` now and shows something there.
    #[must_use]
    pub fn has_gone(
        &self,
        place_in_map: &Point3<f64>,
        last_hit: Stamp,
        camera_in_map: &Point3<f64>,
    ) -> bool {
        let since = self.frames.iter().rev().take_while(|frame| frame.stamp > last_hit);
        let shows_gone = |frame: &&Frame| {
            frame.sight.sees_as_well_as(camera_in_map, place_in_map)
                && frame.shows_gone(place_in_map, &self.farthest)
        };
        // Most places were hit a cycle ago.
        since.clone().count() >= MIN_GONE
            && since.filter(shows_gone).take(MIN_GONE).count() == MIN_GONE
    }

    /// Remembers a cycle. `cell_m` is the edge of the voxels that its points are means of.
    pub fn remember(&mut self, cycle: &DetectedCycle, cell_m: f64) {
        if self.frames.len() == VIEWS {
            self.frames.pop_front();
        }
        let mut sight =
            CloudView::new(cycle.map_from_rig, cycle.setup.mounts.camera_in_rig_m(), cell_m);
        for point in &cycle.reduced_cloud.points_m {
            if let Some(met) = sight.meet(&point.cast()) {
                self.farthest.keep_farthest(&met.slopes, &met.hides, met.depth_m);
            }
        }
        self.frames.push_back(Frame { stamp: cycle.reduced_cloud.stamp, sight });
    }
}

impl Frame {
    fn was_empty(&self, place_in_map: &Point3<f64>, view: &View, blank_reach_m: f64) -> bool {
        let Some(place) = self.sight.bearing_in_map(place_in_map) else { return false };
        let is_free = match self.sight.nearest().depth_m(&place.slopes) {
            Some(_) => self.sight.sees_past(&place),
            None => distance(place_in_map, &self.sight.camera_in_map_m()) <= blank_reach_m,
        };
        view.contains(&place.slopes) && place.depth_m <= self.sight.farthest_m() && is_free
    }

    /// Whether the camera would see what is at a place, and does not. One that meets nothing at all may be covered.
    fn shows_gone(&self, place_in_map: &Point3<f64>, farthest: &DepthByDirection) -> bool {
        self.sight.bearing_in_map(place_in_map).is_some_and(|place| {
            let is_blank = self.sight.farthest_m() > 0.0 && self.sight.is_blank(&place, farthest);
            is_blank || self.sight.sees_past(&place)
        })
    }
}
