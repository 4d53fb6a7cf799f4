//! Where nothing comes back any more, nothing stands any more.
//!
//! Rays to returns clear what they pass (module `clearing`). Behind a thing that goes away there may be nothing to
//! return any: a hall, a doorway, a black floor. There a direction that is blank from now on says that it has gone, if
//! less surely than a ray that passes. A voxel loses evidence when
//! - its direction is blank ([`CloudView::is_blank`]), although other directions have returns;
//! - the camera sees it as well as when the voxel was hit last ([`CloudView::sees_as_well_as`]);
//! - it stood there for no longer than [`LONGEST_STAY_S`].

mod open_directions;
mod search;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use geometry::{
    CloudView, DepthByDirection, FARTHEST_SEEN_M, LONGEST_STAY_S, SegmentedCycle, View, VoxelKey,
};
use nalgebra::Point3;

use super::StaticMap;
use super::anchor::Anchor;
use super::voxel::VoxelMean;
use search::Search;

/// Nothing farther away than this is looked for, in edges of the voxels: it bounds what a cycle costs where they are
/// small.
const FARTHEST_IN_EDGES: f64 = 100.0;
/// Cameras' places that are remembered: twenty minutes of the RPLIDAR A1, 20 bytes each.
const MOST_PLACES: usize = 8_192;

/// What the cameras of the cycles saw, by direction.
#[derive(Clone, Debug)]
pub(super) struct Blanks {
    /// The borders of all that was ever seen, or hidden by it.
    view: View,
    /// The farthest that was ever met, in each direction and in all.
    farthest: DepthByDirection,
    farthest_m: f64,
    /// Where the cameras of late were, in the order of their cycles.
    places: VecDeque<Place>,
}

/// Where the camera of a cycle was.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// The cycle's number, and its moment.
    cycle: u32,
    moment: Anchor,
    camera_in_map_m: Point3<f32>,
}

impl Default for Blanks {
    fn default() -> Self {
        let farthest = DepthByDirection::default();
        Self { view: View::default(), farthest, farthest_m: 0.0, places: VecDeque::new() }
    }
}

impl Blanks {
    pub(super) fn memory_bytes(&self) -> usize {
        self.places.capacity() * size_of::<Place>() + self.farthest.memory_bytes()
    }

    /// The map has moved under the cameras' places.
    pub(super) fn forget_places(&mut self) {
        self.places.clear();
    }

    /// Takes in a point of the rig frame that a cycle shows.
    fn meet(&mut self, point_in_rig: &Point3<f64>, sight: &mut CloudView) {
        let Some(met) = sight.meet(point_in_rig) else { return };
        self.view.widen(&(met.slopes - met.hides));
        self.view.widen(&(met.slopes + met.hides));
        self.farthest.keep_farthest(&met.slopes, &met.hides, met.depth_m);
        self.farthest_m = self.farthest_m.max(met.depth_m);
    }

    fn remember(&mut self, place: Place) {
        if self.places.len() == MOST_PLACES {
            self.places.pop_front();
        }
        self.places.push_back(place);
    }

    /// Whether the camera would see what is at a place of the map, and sees nothing.
    fn is_blank(&self, place_in_map: &Point3<f64>, sight: &CloudView) -> bool {
        sight
            .bearing_in_map(place_in_map)
            .is_some_and(|place| sight.is_blank(&place, &self.farthest))
    }

    /// Whether a voxel has not stood there for long, and was hit last from where it is seen no better now.
    fn would_be_seen(&self, voxel: &VoxelMean, sight: &CloudView) -> bool {
        let later = self.places.partition_point(|place| place.cycle < voxel.last_cycle);
        let last_hit = self.places.get(later).filter(|place| place.cycle == voxel.last_cycle);
        let (Some(last_hit), Some(first_s)) = (last_hit, voxel.anchor.seconds()) else {
            return false;
        };
        let stay_s = last_hit.moment.seconds().map_or(0.0, |last_s| last_s - first_s);
        let (then_m, at_m) = (last_hit.camera_in_map_m.cast(), voxel.mean().cast());
        stay_s <= LONGEST_STAY_S && sight.sees_as_well_as(&then_m, &at_m)
    }
}

/// How far away a cycle looks for what has gone, in metres.
fn reach_m(sight: &CloudView) -> f64 {
    FARTHEST_SEEN_M.min(FARTHEST_IN_EDGES * sight.edge_m)
}

impl StaticMap {
    /// The voxels that a cycle with these points says have gone, since their directions are blank.
    pub(super) fn find_blank(
        &mut self,
        blanks: &mut Blanks,
        cycle: &SegmentedCycle,
        points_in_map: impl Iterator<Item = Point3<f32>>,
    ) -> Vec<VoxelKey> {
        let map_from_rig = cycle.map_from_rig;
        let mut sight =
            CloudView::new(map_from_rig, cycle.setup.mounts.camera_in_rig_m(), self.grid.edge_m());
        for point in points_in_map {
            blanks.meet(&map_from_rig.inverse_transform_point(&point.cast()), &mut sight);
        }
        let camera_in_map_m = sight.camera_in_map_m().cast();
        blanks.remember(Place { cycle: self.cycles, moment: self.anchor, camera_in_map_m });
        let mut blank = Vec::new();
        // A camera that sees nothing at all may be covered.
        if sight.farthest_m() > 0.0 {
            let search = Search::of(blanks, &sight);
            for block in search.blocks(&self.grid) {
                self.find_blank_in(block, &search, &mut blank);
            }
        }
        blank
    }

    /// Appends those of one block, which may have to be fetched.
    fn find_blank_in(&mut self, block: VoxelKey, search: &Search<'_>, blank: &mut Vec<VoxelKey>) {
        if self.bits_of_block(block) == 0 {
            return;
        }
        let Search { blanks, sight, .. } = search;
        let Some(occupied) = &self.occupied else { return };
        // To look a voxel up costs more than to see that it cannot be one.
        let in_open = occupied.voxels_of(block).filter(|key| search.may_hold(*key, 1));
        blank.extend(in_open.filter(|key| {
            self.voxels.get(key).is_some_and(|voxel| {
                voxel.last_cycle != self.cycles
                    && blanks.is_blank(&voxel.mean().cast(), sight)
                    && blanks.would_be_seen(voxel, sight)
            })
        }));
    }
}
