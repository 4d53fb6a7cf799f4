//! Where nothing comes back any more, nothing stands any more.
//!
//! Rays to returns clear what they pass (module `clearing`). Behind a thing that goes away there may be nothing to
//! return any: a hall, a doorway, a black floor. But a camera that has seen a thing from here sees it again, while it is
//! there; so a direction that is blank from now on says that it has gone, if less surely than a ray that passes. A
//! voxel loses evidence when
//! - nothing at all came back from the square of directions around it, although other directions have returns;
//! - the camera has met something as far away in that direction of its own: nothing of the platform stands before it
//!   there, and no border of the image;
//! - the camera sees it as well as when the voxel was hit last: no farther away ([`AS_NEAR`]) and from the same side
//!   ([`SAME_SIDE_COSINE`]). A dark surface that slants comes back from one place and not from another;
//! - nothing nearer stands so close beside it that the projector's shadow may lie there;
//! - it is neither too near nor too far for depth cameras ([`NEAREST_M`], [`FARTHEST_M`]);
//! - it stood there for no longer than [`LONGEST_STAY_S`]. Who steps right before the lens, nearer than it can measure,
//!   blanks out all that is behind; what has stood there for longer does not hang on that.

mod open_directions;
mod search;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use geometry::{DepthByDirection, SegmentedCycle, View, VoxelKey, slopes_from};
use nalgebra::{Isometry3, Point3, Vector2};

use super::StaticMap;
use super::anchor::Anchor;
use super::voxel::VoxelMean;
use search::Search;

/// A place that the camera saw from so much farther away it sees as well now: noise of poses.
const AS_NEAR: f64 = 1.02;
/// The cosine of the angle by which the side from which a surface is seen may have turned: 20 degrees.
const SAME_SIDE_COSINE: f64 = 0.94;
/// Nearer by, a camera with structured light is blind: the Kinect from 0.8 m on, later ones from less.
const NEAREST_M: f64 = 0.8;
/// Farther than this they see nothing that can be relied on.
const FARTHEST_M: f64 = 8.0;
/// The same in edges of the voxels. It bounds what a cycle costs where voxels are small.
const FARTHEST_IN_EDGES: f64 = 100.0;
/// Projector and camera stand so far apart, at most: 0.075 m in the Kinect v1, 0.095 m in the widest of its successors.
const BASELINE_M: f64 = 0.1;
/// What is 0.4 m away throws its shadow over so many squares of directions, on what is far behind; nearer things are not
/// seen.
const SHADOW_SQUARES: u8 = 10;
/// What a point hides reaches so far around it: half the diagonal of its voxel's face.
const HALF_DIAGONAL_IN_EDGES: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// What lies so little nearer is of the same surface, and throws no shadow on it.
const SAME_SURFACE_IN_EDGES: f64 = 1.5;
/// What was hit for longer than this, from the first time to the last, is there to stay.
const LONGEST_STAY_S: f64 = 10.0;
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
    /// The nearest that this cycle met.
    nearest: DepthByDirection,
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
        let [farthest, nearest] = [(); 2].map(|()| DepthByDirection::default());
        Self { view: View::default(), farthest, farthest_m: 0.0, nearest, places: VecDeque::new() }
    }
}

impl Blanks {
    pub(super) fn memory_bytes(&self) -> usize {
        let directions = [&self.farthest, &self.nearest];
        self.places.capacity() * size_of::<Place>()
            + directions.map(DepthByDirection::memory_bytes).into_iter().sum::<usize>()
    }

    /// The map has moved under the cameras' places.
    pub(super) fn forget_places(&mut self) {
        self.places.clear();
    }

    /// Takes in what a cycle sees. Returns whether it sees anything.
    fn see(&mut self, points_in_rig: &[Point3<f64>], camera: &Camera) -> bool {
        self.nearest.clear();
        let mut sees = false;
        for point in points_in_rig {
            let Some(slopes) = slopes_from(&camera.in_rig_m, point) else { continue };
            let depth_m = point.x - camera.in_rig_m.x;
            let hidden = Vector2::repeat(HALF_DIAGONAL_IN_EDGES * camera.edge_m / depth_m);
            self.view.widen(&(slopes - hidden));
            self.view.widen(&(slopes + hidden));
            self.farthest.keep_farthest(&slopes, &hidden, depth_m);
            self.farthest_m = self.farthest_m.max(depth_m);
            self.nearest.keep_nearest(&slopes, &hidden, depth_m);
            sees = true;
        }
        sees
    }

    fn remember(&mut self, place: Place) {
        if self.places.len() == MOST_PLACES {
            self.places.pop_front();
        }
        self.places.push_back(place);
    }

    /// Whether the camera would see what is at a place of the map, and sees nothing.
    fn is_blank(&self, place_in_map: &Point3<f64>, camera: &Camera) -> bool {
        let in_rig = camera.map_from_rig.inverse_transform_point(place_in_map);
        let Some(slopes) = slopes_from(&camera.in_rig_m, &in_rig) else { return false };
        let depth_m = in_rig.x - camera.in_rig_m.x;
        let same_surface_m = SAME_SURFACE_IN_EDGES * camera.edge_m;
        (NEAREST_M..=camera.reach_m()).contains(&depth_m)
            && self.nearest.depth_m(&slopes).is_none()
            && self.farthest.depth_m(&slopes).is_some_and(|met_m| met_m + same_surface_m >= depth_m)
            && !self.may_be_in_shadow(&slopes, depth_m, depth_m - same_surface_m)
    }

    /// Whether something before `before_m` stands so near beside a direction that it may hide what is at `depth_m` from
    /// the projector.
    fn may_be_in_shadow(&self, slopes: &Vector2<f64>, depth_m: f64, before_m: f64) -> bool {
        (1..=SHADOW_SQUARES).any(|squares| {
            let aside = f64::from(squares) * DepthByDirection::SQUARE_SLOPE;
            // Both may lie anywhere in their squares.
            let at_least = aside - DepthByDirection::SQUARE_SLOPE;
            [aside, -aside].into_iter().any(|aside| {
                self.nearest.depth_m(&(slopes + Vector2::new(aside, 0.0))).is_some_and(|met_m| {
                    met_m < before_m && at_least <= BASELINE_M * (1.0 / met_m - 1.0 / depth_m)
                })
            })
        })
    }

    /// Whether a voxel has not stood there for long, and was hit last from where it is seen no better now.
    fn would_be_seen(&self, voxel: &VoxelMean, camera: &Camera) -> bool {
        let later = self.places.partition_point(|place| place.cycle < voxel.last_cycle);
        let last_hit = self.places.get(later).filter(|place| place.cycle == voxel.last_cycle);
        let (Some(last_hit), Some(first_s)) = (last_hit, voxel.anchor.seconds()) else {
            return false;
        };
        let stay_s = last_hit.moment.seconds().map_or(0.0, |last_s| last_s - first_s);
        let at_m: Point3<f64> = voxel.mean().cast();
        let (then, now) = (last_hit.camera_in_map_m.cast() - at_m, camera.in_map_m() - at_m);
        stay_s <= LONGEST_STAY_S
            && now.norm() <= AS_NEAR * then.norm()
            && now.dot(&then) >= SAME_SIDE_COSINE * now.norm() * then.norm()
    }
}

/// Where a cycle's camera was, and how large the voxels are.
#[derive(Clone, Copy, Debug)]
struct Camera {
    in_rig_m: Point3<f64>,
    map_from_rig: Isometry3<f64>,
    edge_m: f64,
}

impl Camera {
    fn in_map_m(&self) -> Point3<f64> {
        self.map_from_rig * self.in_rig_m
    }

    fn reach_m(&self) -> f64 {
        FARTHEST_M.min(FARTHEST_IN_EDGES * self.edge_m)
    }
}

impl StaticMap {
    /// The voxels that a cycle with these points says have gone, since their directions are blank.
    pub(super) fn find_blank(
        &mut self,
        cycle: &SegmentedCycle,
        points_in_map: impl Iterator<Item = Point3<f32>>,
    ) -> Vec<VoxelKey> {
        let Some(mut blanks) = self.blanks.take() else { return Vec::new() };
        let (map_from_rig, in_rig_m) = (cycle.map_from_rig, cycle.camera_in_rig_m);
        let camera = Camera { in_rig_m, map_from_rig, edge_m: self.grid.edge_m() };
        let to_rig = |point: Point3<f32>| map_from_rig.inverse_transform_point(&point.cast());
        let points_in_rig: Vec<Point3<f64>> = points_in_map.map(to_rig).collect();
        let mut blank = Vec::new();
        let camera_in_map_m = camera.in_map_m().cast();
        blanks.remember(Place { cycle: self.cycles, moment: self.anchor, camera_in_map_m });
        if blanks.see(&points_in_rig, &camera) {
            let search = Search::of(&blanks, camera);
            for block in search.blocks(&self.grid) {
                self.find_blank_in(block, &search, &mut blank);
            }
        }
        self.blanks = Some(blanks);
        blank
    }

    /// Appends those of one block, which may have to be fetched.
    fn find_blank_in(&mut self, block: VoxelKey, search: &Search<'_>, blank: &mut Vec<VoxelKey>) {
        if self.bits_of_block(block) == 0 {
            return;
        }
        let Search { blanks, camera, .. } = search;
        let Some(occupied) = &self.occupied else { return };
        // To look a voxel up costs more than to see that it cannot be one.
        let in_open = occupied.voxels_of(block).filter(|key| search.may_hold(*key, 1));
        blank.extend(in_open.filter(|key| {
            self.voxels.get(key).is_some_and(|voxel| {
                voxel.last_cycle != self.cycles
                    && blanks.is_blank(&voxel.mean().cast(), camera)
                    && blanks.would_be_seen(voxel, camera)
            })
        }));
    }
}
