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
pub(crate) mod tests;

use std::collections::VecDeque;

use geometry::Stamp;
use nalgebra::{Point3, distance};
use volume::{DepthView, SeenBefore, Sight, TiledView, sees_as_well};

/// Cycles that are remembered: three and a half seconds of the RPLIDAR A1. One who crosses the view uncovers what he hid in a
/// second, one who goes away from the camera at 15 degrees to its line of sight, 0.6 m wide and at 1 m/s, in 2.3 s.
const VIEWS: usize = 24;
/// In so many of them a place must have been empty: as for the passes of [`volume::Occupancy`].
const MIN_EMPTY: usize = 3;
/// In so many of them, since its last hit, a place of the background must have been empty to be cleared: a dark surface that
/// is seen in one cycle of ten is kept six times in seven.
const MIN_GONE: usize = 18;

/// Whether a place was in view and empty in enough of the cycles remembered.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct WasEmpty {
    /// By all cycles.
    pub from_anywhere: bool,
    /// Without those in which no ray returned at all and the camera was farther from the place than the distance asked for.
    pub from_near: bool,
}

/// The last cycles' views.
#[derive(Clone, Debug)]
pub struct RecentViews {
    /// The edge of the voxels that points are means of.
    edge_m: f64,
    views: VecDeque<TiledView>,
    seen_before: SeenBefore,
}

impl RecentViews {
    /// No view yet, of places that are voxels with this edge.
    #[must_use]
    pub fn new(edge_m: f64) -> Self {
        Self { edge_m, views: VecDeque::new(), seen_before: SeenBefore::default() }
    }

    /// Forgets them.
    pub fn clear(&mut self) {
        *self = Self::new(self.edge_m);
    }

    /// Whether a place of the map was in view and empty in enough of the cycles remembered; see [`WasEmpty`].
    #[must_use]
    pub fn was_empty(&self, place_in_map: &Point3<f64>, near_m: f64) -> WasEmpty {
        let (mut cycles, mut near_cycles) = (0, 0);
        for view in &self.views {
            let is_near = match view.sight(place_in_map, self.edge_m) {
                Sight::ReturnsBehind => true,
                Sight::NoReturn => distance(place_in_map, &view.camera_in_map_m()) <= near_m,
                Sight::OutOfView | Sight::Returns => continue,
            };
            cycles += 1;
            near_cycles += usize::from(is_near);
            if near_cycles == MIN_EMPTY {
                break;
            }
        }
        WasEmpty { from_anywhere: cycles >= MIN_EMPTY, from_near: near_cycles >= MIN_EMPTY }
    }

    /// Whether what was hit last at `last_hit` in a place of the map has left since: enough of the cycles that were remembered
    /// from then on show that nothing is there. The cameras of these cycles saw the place as well as the one that is at
    /// `camera_in_map` now and shows something there.
    #[must_use]
    pub fn has_gone(
        &self,
        place_in_map: &Point3<f64>,
        last_hit: Stamp,
        camera_in_map: &Point3<f64>,
    ) -> bool {
        let since = self.views.iter().rev().take_while(|view| view.stamp() > last_hit);
        let shows_gone = |view: &&TiledView| {
            sees_as_well(&view.camera_in_map_m(), camera_in_map, place_in_map)
                && self.seen_before.shows_nothing(view, place_in_map, self.edge_m)
        };
        // Most places were hit a cycle ago.
        since.clone().count() >= MIN_GONE
            && since.filter(shows_gone).take(MIN_GONE).count() == MIN_GONE
    }

    /// The last one.
    #[must_use]
    pub fn latest(&self) -> Option<&TiledView> {
        self.views.back()
    }

    /// Remembers the image of a cycle.
    pub fn remember(&mut self, view: &DepthView) {
        if self.views.len() == VIEWS {
            self.views.pop_front();
        }
        let view = TiledView::of(view);
        self.seen_before.take_in(&view);
        self.views.push_back(view);
    }
}
