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

    /// Whether a place of the map was in view and empty in enough of the cycles remembered. Where no ray returned at all a cycle
    /// counts when its camera was no farther than `no_return_reach_m` from the place.
    #[must_use]
    pub fn was_empty(&self, place_in_map: &Point3<f64>, no_return_reach_m: f64) -> bool {
        let was_empty = |view: &&TiledView| match view.sight(place_in_map, self.edge_m) {
            Sight::ReturnsBehind => true,
            Sight::NoReturn => distance(place_in_map, &view.camera_in_map_m()) <= no_return_reach_m,
            Sight::OutOfView | Sight::Returns => false,
        };
        self.views.iter().filter(was_empty).take(MIN_EMPTY).count() == MIN_EMPTY
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
