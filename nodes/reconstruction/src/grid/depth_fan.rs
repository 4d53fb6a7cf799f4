//! Up to where each direction of a depth image is free within a band of heights.

use std::f64::consts::{PI, TAU};
use std::ops::RangeInclusive;

use geometry::{CameraModelError, DepthFrame, FARTHEST_SEEN_M, RayTable};
use nalgebra::{Isometry3, Point2, Vector2};
use volume::PlaneRay;

/// Directions in a turn: 0.25 degrees, 2 cm at 5 m.
const DIRECTIONS: usize = 1440;
const DIRECTION_RAD: f64 = TAU / DIRECTIONS as f64;
/// Rows are sampled so many times as far apart as columns.
const ROWS_PER_COLUMN: usize = 2;
/// A direction of which this share of the pixels (1 / 2) shows nothing says nothing: something dark may be there.
const MOST_BLIND: u32 = 2;

/// What is seen in a direction, by horizontal distance.
#[derive(Clone, Copy, Debug)]
struct Direction {
    /// The nearest thing in the band.
    nearest_m: f32,
    /// From here on rays are in the band.
    enter_m: f32,
    /// Up to here rays were in the band.
    exit_m: f32,
    pixels: u32,
    blind: u32,
}

const UNSEEN: Direction = Direction {
    nearest_m: f32::INFINITY,
    enter_m: f32::INFINITY,
    exit_m: 0.0,
    pixels: 0,
    blind: 0,
};

/// Makes rays of depth images; keeps the rays of the last camera's pixels.
#[derive(Clone, Debug, Default)]
pub(super) struct DepthFan {
    table: Option<RayTable>,
    directions: Vec<Direction>,
}

impl DepthFan {
    /// The rays of an image, by azimuth: each free up to `margin_m` before the nearest thing in the band of heights, moving or
    /// not. None ends at a hit: occupied is what the map says.
    ///
    /// # Errors
    /// When the camera is none.
    pub(super) fn rays(
        &mut self,
        frame: &DepthFrame,
        map_from_camera: &Isometry3<f64>,
        band_m: &RangeInclusive<f64>,
        margin_m: f64,
    ) -> Result<Vec<PlaneRay>, CameraModelError> {
        self.look(frame, map_from_camera, band_m)?;
        let from_m = Point2::from(map_from_camera.translation.vector.xy());
        let ray = |index: usize| {
            let seen = self.directions.get(index)?;
            if seen.pixels == 0 || seen.blind * MOST_BLIND > seen.pixels {
                return None;
            }
            let azimuth_rad = (index as f64 + 0.5) * DIRECTION_RAD - PI;
            let direction = Vector2::new(azimuth_rad.cos(), azimuth_rad.sin());
            let to_m = (f64::from(seen.nearest_m) - margin_m).min(f64::from(seen.exit_m));
            let enter_m = f64::from(seen.enter_m);
            (to_m > enter_m).then(|| PlaneRay {
                from_m: from_m + direction * enter_m,
                to_m: from_m + direction * to_m,
                hits: false,
                joins_next: false,
            })
        };
        let mut rays = Vec::new();
        let mut last = None;
        for index in 0..DIRECTIONS {
            let Some(ray) = ray(index) else { continue };
            if let Some(before) = rays.last_mut()
                && last.is_some_and(|last: usize| last + 1 == index)
            {
                let before: &mut PlaneRay = before;
                before.joins_next = true;
            }
            rays.push(ray);
            last = Some(index);
        }
        Ok(rays)
    }

    fn look(
        &mut self,
        frame: &DepthFrame,
        map_from_camera: &Isometry3<f64>,
        band_m: &RangeInclusive<f64>,
    ) -> Result<(), CameraModelError> {
        let camera = frame.camera();
        let known = self.table.take().filter(|table| table.camera() == camera);
        let table = match known {
            Some(table) => table,
            None => RayTable::new(camera)?,
        };
        self.directions.clear();
        self.directions.resize(DIRECTIONS, UNSEEN);
        let rotation = map_from_camera.rotation.to_rotation_matrix().cast::<f32>();
        let camera_z_m = map_from_camera.translation.z as f32;
        let (least_m, most_m) = (*band_m.start() as f32, *band_m.end() as f32);
        let farthest_m = FARTHEST_SEEN_M as f32;
        let step_px = ((camera.fx_px * DIRECTION_RAD) as usize).max(1);
        let image = frame.image();
        for row_px in (0..image.height_px()).step_by(step_px * ROWS_PER_COLUMN) {
            for column_px in (0..image.width_px()).step_by(step_px) {
                let Some(ray) = table.ray(column_px, row_px) else { continue };
                let along = rotation * ray.push(1.0);
                // Of a depth of 1 m.
                let length = along.x.hypot(along.y);
                let azimuth_rad = f64::from(along.y.atan2(along.x)) + PI;
                let index = (azimuth_rad / DIRECTION_RAD) as usize % DIRECTIONS;
                let Some(seen) = self.directions.get_mut(index) else { continue };
                seen.pixels += 1;
                let Some(depth_m) =
                    image.depth_m(column_px, row_px).filter(|depth_m| *depth_m > 0.0)
                else {
                    seen.blind += 1;
                    continue;
                };
                let height_m = camera_z_m + along.z * depth_m;
                if depth_m <= farthest_m && (least_m..=most_m).contains(&height_m) {
                    seen.nearest_m = seen.nearest_m.min(length * depth_m);
                }
                // The depths at which the ray crosses both ends of the band; it is in the band between.
                let at = |end_m: f32| (end_m - camera_z_m) / along.z;
                let is_level = along.z.abs() < f32::EPSILON;
                let (enter, exit) = if is_level && (least_m..=most_m).contains(&camera_z_m) {
                    (0.0, f32::INFINITY)
                } else if is_level {
                    continue;
                } else {
                    let (one, other) = (at(least_m), at(most_m));
                    (one.min(other).max(0.0), one.max(other))
                };
                let exit = exit.min(depth_m).min(farthest_m);
                if exit > enter {
                    seen.enter_m = seen.enter_m.min(length * enter);
                    seen.exit_m = seen.exit_m.max(length * exit);
                }
            }
        }
        self.table = Some(table);
        Ok(())
    }
}
