//! Where nothing comes back any more, nothing is any more: less surely than where something is seen behind it.
//!
//! Behind a thing that goes away there may be nothing to return anything: a hall, a doorway, a black floor. A block loses
//! evidence when
//! - no pixel that it may cover has a return, though others have. The border of the image may cut it where it always cut the
//!   same part off: on a platform that stands, what it shows is all that the block has;
//! - from the directions of all these pixels something came back before, from as far away at least: otherwise something of
//!   the platform may stand before them, or the sensor may be blind there;
//! - it is neither too near nor too far for depth cameras;
//! - nothing nearer stands so close beside it that the projector's shadow may lie there;
//! - the camera sees it as well as when it was hit last: no farther away, and from the same side;
//! - it was there for no longer than [`LONGEST_STAY_S`]: who steps right before the lens, nearer than it can measure,
//!   blanks out all that is behind.
//!
//! It is of cameras with structured light or stereo alone: a turning LiDAR has no return from the sky as from a black car.

use geometry::{AS_NEAR, FARTHEST_SEEN_M, LONGEST_STAY_S, NEAREST_SEEN_M};
use nalgebra::Point3;

use super::block::SurfaceBlock;
use crate::depth_view::{DepthView, Kind};
use crate::projection::Covered;
use crate::ticks::TICK_S;

/// The cosine of the angle by which the side from which a surface is seen may have turned: 20 degrees. A dark surface that
/// slants comes back from one place and not from another.
const SAME_SIDE_COSINE: f64 = 0.94;
/// Projector and camera stand so far apart, at most: 0.075 m in the Kinect v1, 0.095 m in the widest of its successors.
const BASELINE_M: f32 = 0.1;
/// The nearest thing that throws a shadow: nearer ones are not seen.
const NEAREST_SHADOW_M: f32 = 0.4;

/// What the camera ever saw, by direction.
#[derive(Clone, Debug, Default)]
pub(super) struct SeenBefore {
    /// The farthest depth of each tile of the image.
    farthest_m: Vec<f32>,
    columns: usize,
}

impl SeenBefore {
    /// Takes in an image. One of another size is another camera's.
    pub(super) fn take_in(&mut self, view: &DepthView) {
        let (columns, farthest_m) = (view.tiles.columns(), view.tiles.most_m());
        if (self.columns, self.farthest_m.len()) != (columns, farthest_m.len()) {
            self.columns = columns;
            self.farthest_m.clear();
            self.farthest_m.extend_from_slice(farthest_m);
            return;
        }
        for (kept_m, seen_m) in self.farthest_m.iter_mut().zip(farthest_m) {
            *kept_m = kept_m.max(*seen_m);
        }
    }

    /// Whether an image in which nothing comes back from a block, which covers so much of it, says that it has gone.
    pub(super) fn says_gone(
        &self,
        view: &DepthView,
        covered: &Covered,
        middle_in_map_m: &Point3<f64>,
        block: &SurfaceBlock,
    ) -> bool {
        let lasted_s = f64::from(block.last_hit.saturating_sub(block.first_seen)) * TICK_S;
        let depths_m = [covered.nearest_m, covered.farthest_m].map(f64::from);
        matches!(view.kind, Kind::Pinhole(_))
            && lasted_s <= LONGEST_STAY_S
            && depths_m.iter().all(|depth_m| (NEAREST_SEEN_M..=FARTHEST_SEEN_M).contains(depth_m))
            && sees_as_well(view, middle_in_map_m, block)
            && self.reached(view, covered)
            && !may_be_in_shadow(view, covered)
    }

    fn reached(&self, view: &DepthView, covered: &Covered) -> bool {
        let (columns, rows) =
            (view.tiles.of_columns(covered.columns), view.tiles.of_rows(covered.rows));
        rows.into_iter().all(|row| {
            columns.clone().all(|column| {
                let farthest_m = self.farthest_m.get(row * self.columns + column);
                farthest_m.is_some_and(|farthest_m| *farthest_m >= covered.nearest_m)
            })
        })
    }
}

fn sees_as_well(view: &DepthView, middle_in_map_m: &Point3<f64>, block: &SurfaceBlock) -> bool {
    let camera_m = Point3::from(view.map_from_camera.translation.vector);
    let own = camera_m - middle_in_map_m;
    let other = Point3::from(block.hit_from_m).cast::<f64>() - middle_in_map_m;
    own.norm() <= AS_NEAR * other.norm()
        && own.dot(&other) >= SAME_SIDE_COSINE * own.norm() * other.norm()
}

/// Whether something nearer stands so close beside a block that it may hide it from the projector.
fn may_be_in_shadow(view: &DepthView, covered: &Covered) -> bool {
    let shift = |near_m: f32| BASELINE_M * (1.0 / near_m - 1.0 / covered.nearest_m);
    let widest_px = (shift(NEAREST_SHADOW_M) / view.pixel_slope()).max(0.0) as u32;
    let [left, right] = covered.columns;
    let around = [left.saturating_sub(widest_px), right.saturating_add(widest_px)];
    let tiles = &view.tiles;
    let beside = tiles.of_columns(around);
    tiles.of_rows(covered.rows).into_iter().any(|row| {
        beside.clone().any(|column| {
            let first_px = (column * tiles.tile_px()) as u32;
            let last_px = first_px + tiles.tile_px() as u32 - 1;
            let aside_px = left.saturating_sub(last_px).max(first_px.saturating_sub(right));
            let near_m =
                tiles.least_m().get(row * tiles.columns() + column).copied().unwrap_or(0.0);
            near_m > 0.0
                && near_m < covered.nearest_m
                && aside_px as f32 * view.pixel_slope() <= shift(near_m.max(NEAREST_SHADOW_M))
        })
    })
}
