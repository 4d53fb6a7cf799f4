//! The verdict on voxels as a mask on the pixels of the depth image.
//!
//! The reduced cloud has a point a voxel, and a voxel at the border of an object holds both the object and what is behind or
//! below it: it is judged as a whole, by its mean. So
//! 1. the pixels of the voxels that move are the object, and the mask grows from them to the object's edge: to neighbouring
//!    pixels of continuous depth, as far as a voxel that was judged static may reach, but not over the floor;
//! 2. a margin is added, whatever the depths: a camera sees, at the edge of an object, depths between it and the background.
//!
//! So the mask may cover some background: the map sees that surface when the object has moved on. Pixels of an object that
//! were missing from it would stay in the map.

#[cfg(test)]
mod tests;

use std::collections::HashSet;
use std::ops::Range;

use geometry::{
    BuildVoxelHasher, CameraModel, DepthFrame, PixelArea, RayTable, RobotBox, RobotPixels,
    VoxelBox, VoxelGrid, VoxelKey,
};
use nalgebra::{Isometry3, Point3};
use volume::DepthNoise;

use crate::floor::Floor;

/// The mask grows by so many edges of the reduction's voxels: a pixel of the voxel beside one that moves is no farther.
const REACH_IN_EDGES: f64 = 2.0;
/// Depths of one surface differ by so many standard deviations of the noise, ...
const NOISE_SIGMAS: f32 = 4.0;
/// ... and, from one pixel to the next, by what a slope of 75 degrees adds.
const STEEPEST_SLOPE: f32 = 3.7;
/// What is this high above the floor, and noise, may be floor: the plane is known so well, and soles are as thick.
const SOLE_M: f32 = 0.02;
/// Pixels added around the mask. Of 640 columns the mixed depths of structured light span one or two.
pub(crate) const MARGIN_PX: usize = 2;
/// Pixels that are looked at together: a register of AVX2.
const AT_ONCE_PX: usize = 32;

/// Makes the masks of a pipeline's cycles. Keeps the rays of the camera from one to the next.
#[derive(Clone, Debug)]
pub(crate) struct MovingPixels {
    grid: VoxelGrid,
    last_rays: Option<RayTable>,
    last_robot: Option<RobotPixels>,
    margin: Margin,
}

impl MovingPixels {
    /// For clouds that were reduced by this grid.
    pub(crate) fn new(grid: VoxelGrid) -> Self {
        Self { grid, last_rays: None, last_robot: None, margin: Margin::default() }
    }

    /// Which pixels show what is no part of the static scene: what moves, and the robot itself, where its box is known. Row by row.
    /// `moving` are the points of the reduced cloud, in the rig frame, that move, and the floor is that which the rig sees.
    pub(crate) fn mask<'a>(
        &mut self,
        frame: &DepthFrame,
        (rig_from_camera, robot): (&Isometry3<f64>, Option<&RobotBox>),
        floor_in_rig: Option<&Floor>,
        moving: impl Iterator<Item = &'a Point3<f32>> + Clone,
    ) -> Vec<bool> {
        let depths_mm = frame.depths_mm();
        let mut is_moving = vec![false; depths_mm.len()];
        frame.rays().share_with(&mut self.last_rays);
        let rows_px = self.mark(frame, rig_from_camera, moving, &mut is_moving);
        if !rows_px.is_empty() {
            let growth = Growth {
                depths_mm,
                rays: frame.rays(),
                floor_in_camera: floor_in_rig.map(|floor| floor.seen_from(rig_from_camera)),
                reach: Reach::new(frame.camera(), &self.grid),
            };
            growth.grow(&mut is_moving, rows_px);
        }
        if let Some(robot) = robot {
            let last = self.last_robot.take();
            let pixels = RobotPixels::kept_or_new(last, robot, frame.rays(), rig_from_camera);
            pixels.shown_in(frame.image()).for_each(|pixel| is_moving[pixel] = true);
            self.last_robot = Some(pixels);
        }
        self.margin.add(&mut is_moving, frame.camera().width_px);
        is_moving
    }

    /// Marks the pixels of the voxels of these points. Returns the rows that they may be in.
    fn mark<'a>(
        &self,
        frame: &DepthFrame,
        rig_from_camera: &Isometry3<f64>,
        moving: impl Iterator<Item = &'a Point3<f32>> + Clone,
        is_moving: &mut [bool],
    ) -> Range<usize> {
        let grid = self.grid;
        let voxels: HashSet<VoxelKey, BuildVoxelHasher> =
            moving.clone().map(|point| grid.key(point)).collect();
        let Some(around) = VoxelBox::around(&voxels) else { return 0..0 };
        let area = area_of(frame.camera(), rig_from_camera, moving, grid.edge_m());
        let (rows_px, mut last) = (area.rows_px.clone(), None);
        frame.for_each_voxel(rig_from_camera, area, (&grid, &around), |pixel, voxel| {
            let is_of_object = match last {
                Some((last, is_of_object)) if last == voxel => is_of_object,
                _ => voxels.contains(&voxel),
            };
            last = Some((voxel, is_of_object));
            is_moving[pixel] = is_of_object;
        });
        rows_px
    }
}

/// The pixels that the voxels of these points may be seen in.
pub(crate) fn area_of<'a>(
    camera: &CameraModel,
    rig_from_camera: &Isometry3<f64>,
    points_in_rig: impl Iterator<Item = &'a Point3<f32>>,
    edge_m: f64,
) -> PixelArea {
    let whole = PixelArea::whole(camera.width_px, camera.height_px);
    if !camera.distortion.is_none() {
        return whole;
    }
    // From a point of a voxel to any other.
    let reach_m = 3.0_f64.sqrt() * edge_m;
    let mut columns_px = Bounds::default();
    let mut rows_px = Bounds::default();
    for point in points_in_rig {
        let point = rig_from_camera.inverse_transform_point(&point.cast::<f64>());
        if point.z <= 2.0 * reach_m {
            return whole;
        }
        let aside = |slope: f64| (1.0 + slope.abs()) * reach_m / (point.z - reach_m);
        let CameraModel { fx_px, fy_px, cx_px, cy_px, .. } = *camera;
        let (x, y) = (point.x / point.z, point.y / point.z);
        columns_px.join(cx_px + fx_px * x, fx_px * aside(x));
        rows_px.join(cy_px + fy_px * y, fy_px * aside(y));
    }
    PixelArea {
        columns_px: columns_px.within(camera.width_px),
        rows_px: rows_px.within(camera.height_px),
    }
}

/// The least and the greatest of some coordinates of the image, in pixels.
struct Bounds {
    least_px: f64,
    most_px: f64,
}

impl Default for Bounds {
    fn default() -> Self {
        Self { least_px: f64::INFINITY, most_px: f64::NEG_INFINITY }
    }
}

impl Bounds {
    fn join(&mut self, middle_px: f64, aside_px: f64) {
        self.least_px = self.least_px.min(middle_px - aside_px);
        self.most_px = self.most_px.max(middle_px + aside_px);
    }

    /// The whole pixels; none where nothing was joined.
    fn within(&self, size_px: usize) -> Range<usize> {
        if self.least_px > self.most_px {
            return 0..0;
        }
        // The casts saturate.
        (self.least_px.floor() as usize).min(size_px)
            ..(self.most_px.ceil() as usize).saturating_add(1).min(size_px)
    }
}

/// How far the pixels of an object go on, from those of the voxels that move.
pub(crate) struct Reach {
    noise: DepthNoise,
    focal_px: f32,
    reach_m: f32,
}

impl Reach {
    /// In images of this camera, whose clouds were reduced by this grid.
    pub(crate) fn new(camera: &CameraModel, grid: &VoxelGrid) -> Self {
        Self {
            noise: DepthNoise::default(),
            focal_px: camera.fx_px.max(camera.fy_px) as f32,
            reach_m: (REACH_IN_EDGES * grid.edge_m()) as f32,
        }
    }

    /// Whether it goes on from a pixel of this depth, which is so many pixels away.
    pub(crate) fn goes_on(&self, grown_px: u32, depth_m: f32) -> bool {
        grown_px as f32 * depth_m <= self.reach_m * self.focal_px
    }

    /// Whether a pixel beside one shows the same surface, by their depths.
    pub(crate) fn joins(&self, depth_m: f32, other_m: f32) -> bool {
        let steepest_m = STEEPEST_SLOPE * depth_m / self.focal_px;
        let joins_m = NOISE_SIGMAS * self.noise.sigma_m(depth_m) + steepest_m;
        other_m > 0.0 && (other_m - depth_m).abs() <= joins_m
    }
}

/// The pixels beside one; of those in the last row some are beyond the image.
pub(crate) fn pixels_beside(pixel: usize, width_px: usize) -> impl Iterator<Item = usize> {
    let column_px = pixel % width_px.max(1);
    let beside = [
        (column_px > 0).then(|| pixel - 1),
        (column_px + 1 < width_px).then(|| pixel + 1),
        pixel.checked_sub(width_px),
        Some(pixel + width_px),
    ];
    beside.into_iter().flatten()
}

/// How the mask grows.
struct Growth<'a> {
    depths_mm: &'a [u16],
    rays: &'a RayTable,
    floor_in_camera: Option<Floor>,
    reach: Reach,
}

impl Growth<'_> {
    /// Grows from the pixels of the object, which are in these rows, a pixel to each side at a time.
    fn grow(&self, is_moving: &mut [bool], rows_px: Range<usize>) {
        let width_px = self.rays.width_px();
        let mut border = border_of(is_moving, width_px, rows_px);
        let mut next = Vec::new();
        for grown_px in 0_u32.. {
            for &pixel in &border {
                let pixel = pixel as usize;
                let depth_m = self.depth_m(pixel);
                if !self.reach.goes_on(grown_px, depth_m) {
                    continue;
                }
                for beside in pixels_beside(pixel, width_px) {
                    let Some(is_moving) = is_moving.get_mut(beside) else { continue };
                    let other_m = self.depth_m(beside);
                    let is_of_surface = self.reach.joins(depth_m, other_m);
                    if !*is_moving && is_of_surface && !self.is_of_floor(beside, other_m) {
                        *is_moving = true;
                        next.push(beside as u32);
                    }
                }
            }
            if next.is_empty() {
                return;
            }
            std::mem::swap(&mut border, &mut next);
            next.clear();
        }
    }

    /// Whether what a pixel shows, at this depth, may be floor.
    fn is_of_floor(&self, pixel: usize, depth_m: f32) -> bool {
        let width_px = self.rays.width_px().max(1);
        let (Some(floor), Some(ray)) =
            (&self.floor_in_camera, self.rays.ray(pixel % width_px, pixel / width_px))
        else {
            return false;
        };
        let in_camera_m = depth_m * ray.push(1.0);
        let height_m = floor.height_above_m(&in_camera_m.cast().into()) as f32;
        // Noise of the depth moves the point along its ray.
        let per_depth = floor.along(&ray.push(1.0).cast()).abs() as f32;
        height_m.abs() <= SOLE_M + NOISE_SIGMAS * self.reach.noise.sigma_m(depth_m) * per_depth
    }

    /// 0 where nothing was measured.
    fn depth_m(&self, pixel: usize) -> f32 {
        self.depths_mm.get(pixel).map_or(0.0, |depth_mm| f32::from(*depth_mm) / 1e3)
    }
}

/// The pixels of the mask, which are in these rows, that one beside them is not of.
fn border_of(is_moving: &[bool], width_px: usize, rows_px: Range<usize>) -> Vec<u32> {
    let mut border = Vec::new();
    let line = |row: usize| is_moving.get(row * width_px..(row + 1) * width_px).unwrap_or_default();
    let mut is_border = vec![false; width_px];
    for row in rows_px.start..rows_px.end.min(is_moving.len() / width_px.max(1)) {
        let (here, below) = (line(row), line(row + 1));
        let above = row.checked_sub(1).map_or(&[][..], line);
        is_border.fill(false);
        for beside in [above, below, here.get(1..).unwrap_or_default()] {
            for ((is_border, here), beside) in is_border.iter_mut().zip(here).zip(beside) {
                *is_border |= here & !beside;
            }
        }
        let right = is_border.iter_mut().zip(here).skip(1);
        for ((is_border, here), left) in right.zip(here) {
            *is_border |= here & !left;
        }
        // Most pixels are none: several at once are passed over.
        for (part, is_border) in is_border.chunks(AT_ONCE_PX).enumerate() {
            if !is_border.iter().fold(false, |is_any, is_border| is_any | is_border) {
                continue;
            }
            let first = row * width_px + part * AT_ONCE_PX;
            let of_part = (first as u32..).zip(is_border).filter(|(_, is_border)| **is_border);
            border.extend(of_part.map(|(pixel, _)| pixel));
        }
    }
    border
}

/// Adds the margin.
#[derive(Clone, Debug, Default)]
struct Margin {
    /// The pixels before they were widened. Kept for its memory.
    before: Vec<bool>,
}

impl Margin {
    /// Along the rows and then along the columns.
    fn add(&mut self, is_moving: &mut [bool], width_px: usize) {
        let (Some(first), Some(last)) = (
            is_moving.iter().position(|is_moving| *is_moving),
            is_moving.iter().rposition(|is_moving| *is_moving),
        ) else {
            return;
        };
        // The rows that the margin may reach.
        let width_px = width_px.max(1);
        let first_row = (first / width_px).saturating_sub(MARGIN_PX);
        let end = ((last / width_px + 1 + MARGIN_PX) * width_px).min(is_moving.len());
        let Some(is_moving) = is_moving.get_mut(first_row * width_px..end) else { return };
        for row in is_moving.chunks_mut(width_px) {
            if row.contains(&true) {
                self.spread(row, 1);
            }
        }
        self.spread(is_moving, width_px);
    }

    /// Adds to each pixel those up to the margin before and behind it, `step` apart.
    fn spread(&mut self, is_moving: &mut [bool], step: usize) {
        let before = &mut self.before;
        before.clear();
        before.extend_from_slice(is_moving);
        for shift in (1..=MARGIN_PX).map(|pixels| pixels * step) {
            let behind = is_moving.iter_mut().skip(shift).zip(&*before);
            behind.for_each(|(to, from)| *to |= *from);
            let ahead = is_moving.iter_mut().zip(before.iter().skip(shift));
            ahead.for_each(|(to, from)| *to |= *from);
        }
    }
}
