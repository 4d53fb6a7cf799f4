//! Where nothing comes back any more, nothing is any more: less surely than where something is seen behind it.
//!
//! Behind a thing that goes away there may be nothing to return anything: a hall, a doorway, a black floor. An image says that
//! it has gone where
//! - pixels that it may cover have no return, though others have, and what comes back from the rest of these is clearly behind
//!   it: floor and walls begin to return again between its feet. The border of the image may cut it where it always cut the
//!   same part off: on a platform that stands, what it shows is all that there is;
//! - from most of these directions something came back before, from as far away at least: otherwise something of the platform
//!   may stand before them, or the sensor may be blind there;
//! - it is neither too near nor too far for depth cameras;
//! - nothing nearer stands so close beside it that the projector's shadow may lie there;
//! - the camera sees it as well as when it was hit last: no farther away, and from the same side;
//! - it has been missed for a share of the time for which it was there ([`is_missed_long_enough`]).
//!
//! It is of cameras with structured light or stereo alone: a turning LiDAR has no return from the sky as from a black car.

use nalgebra::Point3;

use crate::depth_view::{DepthView, Kind};
use crate::projection::Covered;
use crate::tiled_view::{Sight, TiledView};

/// Nearer by, a camera with structured light is blind: the Kinect from 0.8 m on, later ones from less.
pub const NEAREST_SEEN_M: f64 = 0.8;
/// Farther than this they see nothing that can be relied on.
pub const FARTHEST_SEEN_M: f64 = 8.0;
/// The share of the time from the first hit to the last for which nothing must have come back: 15 s for a chair of a minute. A person
/// right before the lens, nearer than the camera can measure, blanks out what is behind, and does not stay for so long.
const LEAST_MISSED_SHARE: f64 = 0.25;

/// A place that the camera saw from this many times the distance is seen as well now: the margin is the noise of poses.
pub const AS_NEAR: f64 = 1.02;
/// The cosine of the angle by which the side from which a surface is seen may have turned: 20 degrees. A dark surface that
/// slants comes back from one place and not from another.
const SAME_SIDE_COSINE: f64 = 0.94;
/// Projector and camera stand so far apart, at most: 0.075 m in the Kinect v1, 0.095 m in the widest of its successors.
const BASELINE_M: f32 = 0.1;
/// The nearest thing that throws a shadow: nearer ones are not seen.
const NEAREST_SHADOW_M: f32 = 0.4;

/// Whether a camera sees a place as well as another one did.
#[must_use]
pub fn sees_as_well(
    camera_in_map_m: &Point3<f64>,
    other_in_map_m: &Point3<f64>,
    place_in_map_m: &Point3<f64>,
) -> bool {
    let (own, other) = (camera_in_map_m - place_in_map_m, other_in_map_m - place_in_map_m);
    own.norm() <= AS_NEAR * other.norm()
        && own.dot(&other) >= SAME_SIDE_COSINE * own.norm() * other.norm()
}

/// Whether what was hit for so long, from the first hit to the last, has been missed since then for long enough to be gone.
#[must_use]
pub fn is_missed_long_enough(missed_s: f64, lasted_s: f64) -> bool {
    missed_s >= LEAST_MISSED_SHARE * lasted_s
}

/// What the camera ever saw, by direction.
#[derive(Clone, Debug, Default)]
pub struct SeenBefore {
    /// The farthest depth of each tile of the image.
    farthest_m: Vec<f32>,
    /// The tiles of a row.
    columns: usize,
}

impl SeenBefore {
    /// Takes in an image. One of another size is another camera's, whose tiles are of other directions: with it this begins anew.
    pub fn take_in(&mut self, view: &TiledView) {
        let is_of_same_size =
            self.columns == view.columns && self.farthest_m.len() == view.most_m.len();
        if !is_of_same_size {
            self.columns = view.columns;
            self.farthest_m.clone_from(&view.most_m);
            return;
        }
        for (kept_m, seen_m) in self.farthest_m.iter_mut().zip(&view.most_m) {
            *kept_m = kept_m.max(*seen_m);
        }
    }

    /// Whether an image shows that nothing is in a place of the map: all that came back from its direction is behind it, or
    /// nothing came back where something would have.
    #[must_use]
    pub fn shows_nothing(
        &self,
        view: &TiledView,
        place_in_map_m: &Point3<f64>,
        voxel_edge_m: f64,
    ) -> bool {
        match view.sight(place_in_map_m, voxel_edge_m) {
            Sight::ReturnsBehind => true,
            Sight::NoReturn => view
                .covered(place_in_map_m, voxel_edge_m)
                .is_some_and(|covered| self.would_return(view, &covered)),
            Sight::OutOfView | Sight::Returns => false,
        }
    }

    /// Whether something would have come back from a cube that covers so much of an image, were it there.
    pub(crate) fn would_return(&self, view: &TiledView, covered: &Covered) -> bool {
        let depths_m = [covered.nearest_m, covered.farthest_m].map(f64::from);
        matches!(view.kind, Kind::Pinhole(_))
            && depths_m.iter().all(|depth_m| (NEAREST_SEEN_M..=FARTHEST_SEEN_M).contains(depth_m))
            && self.reached(view, covered)
            && !may_be_in_shadow(view, covered)
    }

    fn reached(&self, view: &TiledView, covered: &Covered) -> bool {
        let (mut reached, mut all) = (0, 0);
        for tile in view.tiles(covered.columns, covered.rows) {
            let farthest_m = self.farthest_m.get(tile).copied().unwrap_or(0.0);
            reached += usize::from(farthest_m >= covered.nearest_m);
            all += 1;
        }
        2 * reached > all
    }
}

/// Whether no pixel that a cube may cover has a return from it or from before it, while some have none at all.
pub(crate) fn shows_none(view: &DepthView, covered: &Covered, before_m: f32) -> bool {
    let free_from_m = covered.farthest_m + before_m;
    let [left, right] = covered.columns.map(|column| column as usize);
    let mut has_blank = false;
    for row in covered.rows[0] as usize..=covered.rows[1] as usize {
        let line = row * view.width_px;
        for depth_m in view.depths_m.get(line + left..=line + right).unwrap_or_default() {
            // What is negative is not used as a surface; see `DepthView`.
            let depth_m = depth_m.abs();
            has_blank |= depth_m == 0.0;
            if depth_m > 0.0 && depth_m <= free_from_m {
                return false;
            }
        }
    }
    has_blank
}

/// Whether something nearer stands so close beside a cube that it may hide it from the projector.
fn may_be_in_shadow(view: &TiledView, covered: &Covered) -> bool {
    let shift = |near_m: f32| BASELINE_M * (1.0 / near_m - 1.0 / covered.nearest_m);
    let widest_px = (shift(NEAREST_SHADOW_M) / view.pixel_slope()).max(0.0) as u32;
    let [left, right] = covered.columns;
    let around = [left.saturating_sub(widest_px), right.saturating_add(widest_px)];
    view.tiles(around, covered.rows).any(|tile| {
        let first_px = (tile % view.columns * view.tile_px) as u32;
        let last_px = first_px + view.tile_px as u32 - 1;
        let aside_px = left.saturating_sub(last_px).max(first_px.saturating_sub(right));
        let near_m = view.least_m.get(tile).copied().unwrap_or(0.0);
        near_m > 0.0
            && near_m < covered.nearest_m
            && aside_px as f32 * view.pixel_slope() <= shift(near_m.max(NEAREST_SHADOW_M))
    })
}
