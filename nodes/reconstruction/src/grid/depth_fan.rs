//! Where each direction of a depth image is free within a band of heights.
//!
//! Horizontal distance is cut into 128 steps, one bit each: a ray marks those in which it is low enough above the floor to show
//! that nothing stands there, up to where it ends.

use std::f64::consts::{PI, TAU};

use geometry::{DepthFrame, MaskedDepth, RayTable};
use nalgebra::{Isometry3, Point2, Point3, Vector2, Vector3};
use volume::{FARTHEST_SEEN_M, PlaneRay};

/// Directions in a turn: 0.25 degrees, 2 cm at 5 m.
const DIRECTIONS: usize = 1440;
const DIRECTION_RAD: f64 = TAU / DIRECTIONS as f64;
/// Rows are sampled so many times as far apart as columns.
const ROWS_PER_COLUMN: usize = 2;
/// A direction of which more than this share of the pixels (1 / 2) shows nothing, though something is in reach, says nothing: something
/// dark may be there.
const MOST_BLIND: u32 = 2;
/// Steps of horizontal distance.
const STEPS: u32 = u128::BITS;
const STEP_M: f32 = FARTHEST_SEEN_M as f32 / STEPS as f32;
/// A ray of this length alone says that something is at its end.
const HIT_M: f64 = 1e-3;
/// From a sampled row to the next a level surface rises by no more than this share of the way.
const LEVEL_SLOPE: f32 = 0.3;
/// A step from one surface to another one is longer than this share of the depth.
const LONGEST_WAY: f32 = 0.2;

/// Heights in the map.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Band {
    /// What is between this height ...
    pub(super) least_m: f64,
    /// ... and this one ends the space that is free.
    pub(super) most_m: f64,
    /// A place is free where a ray was no higher than this.
    pub(super) free_below_m: f64,
}

/// What is seen in a direction, by horizontal distance.
#[derive(Clone, Copy, Debug)]
struct Direction {
    /// The nearest thing in the band.
    nearest_m: f32,
    /// Whether it moves.
    moves: bool,
    /// The steps in which a ray was low enough.
    free: u128,
    /// Pixels with a depth, and blind ones.
    pixels: u32,
    /// Pixels without a depth, though the floor that they look at is no farther than what a pixel above them shows.
    blind: u32,
}

const UNSEEN: Direction =
    Direction { nearest_m: f32::INFINITY, moves: false, free: 0, pixels: 0, blind: 0 };

/// Makes rays of depth images; keeps the rays of the last camera's pixels.
#[derive(Clone, Debug)]
pub(super) struct DepthFan {
    /// What is farther is not used.
    farthest_m: f32,
    last_rays: Option<RayTable>,
    directions: Vec<Direction>,
}

impl DepthFan {
    /// Of images that are used up to `reach_m`.
    pub(super) fn new(reach_m: f64) -> Self {
        let farthest_m = reach_m.min(FARTHEST_SEEN_M) as f32;
        Self { farthest_m, last_rays: None, directions: Vec::new() }
    }

    /// The rays of an image, by azimuth: each free, up to `margin_m` before the nearest thing in the band, moving or not. One
    /// that ends there hits it, unless it moves.
    pub(super) fn rays(
        &mut self,
        depth: &MaskedDepth,
        map_from_camera: &Isometry3<f64>,
        band: Band,
        margin_m: f64,
    ) -> Vec<PlaneRay> {
        self.look(depth, map_from_camera, band);
        let from_m = Point2::from(map_from_camera.translation.vector.xy());
        let mut rays = Vec::new();
        for (index, seen) in self.directions.iter().enumerate() {
            let azimuth_rad = (index as f64 + 0.5) * DIRECTION_RAD - PI;
            let direction = Vector2::new(azimuth_rad.cos(), azimuth_rad.sin());
            let nearest_m = f64::from(seen.nearest_m);
            if nearest_m.is_finite() && !seen.moves {
                // A short one: up to there it may be too high above the floor. The cell of the surface itself is not free: what a
                // ray hits is half a cell behind its end.
                let end = |range_m: f64| from_m + direction * range_m;
                let end_m = nearest_m - margin_m;
                let (from_m, to_m) = (end(end_m - HIT_M), end(end_m));
                rays.push(PlaneRay { from_m, to_m, hits: true, joins_next: false });
            }
            if seen.free == 0 || seen.blind * MOST_BLIND > seen.pixels {
                continue;
            }
            let most_m = nearest_m - margin_m;
            let mut free = seen.free;
            while free != 0 {
                let first = free.trailing_zeros();
                let end = first + (!(free >> first)).trailing_zeros().min(STEPS - first);
                free &= !steps(first, end);
                let at_m = |step: u32| f64::from(step) * f64::from(STEP_M);
                let to_m = at_m(end).min(most_m);
                if to_m > at_m(first) {
                    let place = |range_m: f64| from_m + direction * range_m;
                    let (from_m, to_m) = (place(at_m(first)), place(to_m));
                    rays.push(PlaneRay { from_m, to_m, hits: false, joins_next: false });
                }
            }
        }
        rays
    }

    /// Calls `see` with the depth, the ray of 1 m depth in the axes of the map, and the place of the sampled pixels, column by
    /// column from above.
    fn sample(
        &mut self,
        frame: &DepthFrame,
        map_from_camera: &Isometry3<f64>,
        mut see: impl FnMut([usize; 2], Option<f32>, Vector3<f32>),
    ) {
        let (camera, table) = (frame.camera(), frame.rays());
        table.share_with(&mut self.last_rays);
        let rotation = map_from_camera.rotation.to_rotation_matrix().cast::<f32>();
        let step_px = ((camera.fx_px * DIRECTION_RAD) as usize).max(1);
        let image = frame.image();
        for column_px in (0..image.width_px()).step_by(step_px) {
            for row_px in (0..image.height_px()).step_by(step_px * ROWS_PER_COLUMN) {
                let Some(ray) = table.ray(column_px, row_px) else { continue };
                let depth_m = image.depth_m(column_px, row_px).filter(|depth_m| *depth_m > 0.0);
                see([column_px, row_px], depth_m, rotation * ray.push(1.0));
            }
        }
    }

    fn look(&mut self, depth: &MaskedDepth, map_from_camera: &Isometry3<f64>, band: Band) {
        let width_px = depth.frame().image().width_px();
        let moves = |[column_px, row_px]: [usize; 2]| {
            depth.is_moving().get(row_px * width_px + column_px).copied().unwrap_or_default()
        };
        let mut directions = std::mem::take(&mut self.directions);
        directions.clear();
        directions.resize(DIRECTIONS, UNSEEN);
        let camera_z_m = map_from_camera.translation.z as f32;
        let (least_m, most_m) = (band.least_m as f32, band.most_m as f32);
        let free_m = (band.free_below_m as f32).min(most_m);
        let farthest_m = self.farthest_m;
        // The farthest that a column has shown, from above, in horizontal distance.
        let (mut of_column_px, mut above_m) = (0, 0.0_f32);
        self.sample(depth.frame(), map_from_camera, |pixel, depth_m, along| {
            // Of a depth of 1 m.
            let length = along.x.hypot(along.y);
            let azimuth_rad = f64::from(along.y.atan2(along.x)) + PI;
            let index = (azimuth_rad / DIRECTION_RAD) as usize % DIRECTIONS;
            let Some(seen) = directions.get_mut(index) else { return };
            if pixel[0] != of_column_px {
                (of_column_px, above_m) = (pixel[0], 0.0);
            }
            let Some(depth_m) = depth_m else {
                // Along a corridor whose end is out of reach the floor is, too, from some distance on: nothing dark need be there.
                let to_floor_m = length * (least_m - camera_z_m) / along.z;
                if (0.0..=above_m).contains(&to_floor_m) {
                    (seen.pixels, seen.blind) = (seen.pixels + 1, seen.blind + 1);
                }
                return;
            };
            seen.pixels += 1;
            above_m = above_m.max(length * depth_m);
            let height_m = camera_z_m + along.z * depth_m;
            if depth_m <= farthest_m && (least_m..=most_m).contains(&height_m) {
                let range_m = length * depth_m;
                if range_m < seen.nearest_m {
                    (seen.nearest_m, seen.moves) = (range_m, moves(pixel));
                }
            }
            // The depths between which the ray is low enough.
            let at = |height_m: f32| (height_m - camera_z_m) / along.z;
            let is_low = (least_m..=free_m).contains(&camera_z_m);
            let (enter, exit) = if along.z.abs() > f32::EPSILON {
                let (one, other) = (at(least_m), at(free_m));
                (one.min(other).max(0.0), one.max(other))
            } else if is_low {
                (0.0, f32::INFINITY)
            } else {
                return;
            };
            let exit_m = length * exit.min(depth_m).min(farthest_m);
            // Whole steps alone; the casts saturate.
            let first = (length * enter / STEP_M).ceil() as u32;
            seen.free |= steps(first, (exit_m / STEP_M) as u32);
        });
        self.directions = directions;
    }

    /// Points of the level surfaces that an image shows, and the heights of all points that were looked at.
    pub(super) fn level_points(
        &mut self,
        frame: &DepthFrame,
        map_from_camera: &Isometry3<f64>,
    ) -> (Vec<Point3<f32>>, Vec<f32>) {
        let origin_m = Point3::from(map_from_camera.translation.vector.cast::<f32>());
        let (mut level, mut heights_m) = (Vec::new(), Vec::new());
        let farthest_m = self.farthest_m;
        let mut above: Option<(usize, Point3<f32>)> = None;
        self.sample(frame, map_from_camera, |[column, _], depth_m, along| {
            let usable_m = depth_m.filter(|depth_m| *depth_m <= farthest_m);
            let point = usable_m.map(|depth_m| origin_m + along * depth_m);
            if let (Some(point), Some((_, before))) = (point, above.filter(|(of, _)| *of == column))
            {
                let way = point - before;
                let across_m = way.x.hypot(way.y);
                // Seen from above.
                let is_floor_like = way.z.abs() <= LEVEL_SLOPE * across_m && along.z < 0.0;
                if is_floor_like && across_m <= LONGEST_WAY * (point - origin_m).norm() {
                    level.push(point);
                }
            }
            heights_m.extend(point.map(|point| point.z));
            above = point.map(|point| (column, point));
        });
        (level, heights_m)
    }
}

/// The bits from one on, up to but not with another one.
fn steps(first: u32, end: u32) -> u128 {
    let below = |step: u32| if step >= STEPS { u128::MAX } else { (1 << step) - 1 };
    if end > first { below(end) & !below(first) } else { 0 }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use geometry::{CameraModel, DepthImage, DepthPixels, Distortion, Stamp, pose_from_vector};

    use super::*;

    const CAMERA_M: f64 = 0.6;

    /// The depth of the floor in a direction that goes down by so much a metre, of a level camera.
    fn floor_m(down: f64) -> f64 {
        if down > 0.0 { CAMERA_M / down } else { f64::INFINITY }
    }

    /// How far the rays show that nothing stands there, along the middle of the image; `depth_m` has the depth of each direction that shows
    /// something.
    fn free_until_m(depth_m: impl Fn(f64) -> Option<f64>) -> f64 {
        let (width_px, height_px, f_px) = (64, 120, 100.0);
        let camera = CameraModel {
            width_px,
            height_px,
            fx_px: f_px,
            fy_px: f_px,
            cx_px: 31.5,
            cy_px: 59.5,
            distortion: Distortion::None,
        };
        let depth_mm = |pixel: usize| {
            let down = ((pixel / width_px) as f64 - camera.cy_px) / f_px;
            depth_m(down).map_or(0, |depth_m| (1e3 * depth_m) as u16)
        };
        let pixels = DepthPixels::Millimetres((0..width_px * height_px).map(depth_mm).collect());
        let size_px = (width_px, height_px);
        let image =
            DepthImage::new(Stamp::default(), "camera".to_owned(), size_px, pixels).unwrap();
        let frame = Arc::new(DepthFrame::new(image, camera).unwrap());
        let depth = MaskedDepth::new(frame, vec![false; width_px * height_px]).unwrap();
        let quarter = std::f64::consts::FRAC_PI_2;
        let map_from_camera = pose_from_vector(&[0.0, 0.0, CAMERA_M, -quarter, 0.0, -quarter]);
        let band = Band { least_m: 0.08, most_m: 1.5, free_below_m: 0.3 };
        let rays = DepthFan::new(FARTHEST_SEEN_M).rays(&depth, &map_from_camera, band, 0.05);
        let ahead = rays.iter().filter(|ray| !ray.hits && ray.to_m.y.abs() < 0.05 * ray.to_m.x);
        ahead.map(|ray| ray.to_m.x).fold(0.0, f64::max)
    }

    /// Regression: of a corridor whose end was out of reach more than half of the pixels had no depth, and the floor that the robot drove
    /// on stayed unknown.
    #[test]
    fn a_corridor_whose_end_is_out_of_reach_is_free() {
        let until_m = |most_m: f64| {
            free_until_m(|down| Some(floor_m(down)).filter(|depth_m| *depth_m <= most_m))
        };
        assert!((4.0..4.9).contains(&until_m(5.0)), "{}", until_m(5.0));
        // Something dark stands on the floor: it is free up to there.
        assert!((1.2..1.6).contains(&until_m(1.6)), "{}", until_m(1.6));
    }

    #[test]
    fn a_direction_that_is_half_blind_below_what_it_shows_says_nothing() {
        // Of a wall at 4 m so much is seen above the horizon; below it something dark stands 1.3 m away.
        let below_wall = |wall_up: f64| {
            free_until_m(|down| match down {
                down if down < -wall_up => None,
                down if down < 0.07 => Some(4.0),
                down => Some(floor_m(down)).filter(|depth_m| *depth_m <= 1.3),
            })
        };
        assert_eq!(below_wall(0.05), 0.0);
        // Less than half.
        assert!((0.9..1.3).contains(&below_wall(0.2)), "{}", below_wall(0.2));
    }
}
