//! From a depth image to points.

#[cfg(test)]
mod tests;

use std::ops::Range;

use multiversion::multiversion;
use nalgebra::Isometry3;

use crate::camera::{RayRow, RayTable};
use crate::point_block::PointBlock;
use crate::rigid::RigidTransform;
use crate::{Cloud, DepthImage, VoxelAccumulator, VoxelGrid, VoxelKey};

/// Which depths are taken for real, bounds included. Depth is measured along the optical axis.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DepthLimits {
    /// Nearer depths are left out.
    pub min_m: f32,
    /// Farther depths are left out.
    pub max_m: f32,
}

impl Default for DepthLimits {
    /// Everything that the camera measured.
    fn default() -> Self {
        Self { min_m: 0.0, max_m: f32::MAX }
    }
}

/// The depth image is not one of this camera.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error(
    "a depth image of {image_width_px} x {image_height_px} pixels does not fit a camera of \
     {camera_width_px} x {camera_height_px}: the calibration must be the one of the depth image"
)]
pub struct DepthCameraError {
    /// Columns of the image.
    pub image_width_px: usize,
    /// Rows of the image.
    pub image_height_px: usize,
    /// Columns of the camera.
    pub camera_width_px: usize,
    /// Rows of the camera.
    pub camera_height_px: usize,
}

/// A rectangle of an image.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PixelArea {
    /// Its columns.
    pub columns_px: Range<usize>,
    /// Its rows.
    pub rows_px: Range<usize>,
}

impl PixelArea {
    /// All of an image of this size.
    #[must_use]
    pub fn whole(width_px: usize, height_px: usize) -> Self {
        Self { columns_px: 0..width_px, rows_px: 0..height_px }
    }
}

/// Turns the depth images of one camera into clouds of one frame.
#[derive(Clone, PartialEq, Debug)]
pub struct DepthProjector {
    rays: RayTable,
    limits: DepthLimits,
    target_frame_id: String,
    target_from_camera: RigidTransform,
}

/// A depth image's points after the voxel grid.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct ReducedDepth {
    /// The mean point of each occupied cell, in the projector's frame.
    pub cloud: Cloud,
    /// How many points each of the cloud's is the mean of.
    pub voxel_points: Vec<u32>,
    /// How many points the image had.
    pub points_before_reduction: usize,
}

impl DepthProjector {
    /// A projector to the frame `target_frame_id`, into which `target_from_camera` takes the points
    /// of the camera's optical frame.
    #[must_use]
    pub fn new(
        rays: RayTable,
        limits: DepthLimits,
        target_from_camera: &Isometry3<f64>,
        target_frame_id: &str,
    ) -> Self {
        Self {
            rays,
            limits,
            target_frame_id: target_frame_id.to_owned(),
            target_from_camera: RigidTransform::new(target_from_camera),
        }
    }

    /// The rays of the camera.
    #[must_use]
    pub fn rays(&self) -> &RayTable {
        &self.rays
    }

    /// The points of a depth image, row by row.
    ///
    /// # Errors
    /// When the image is of another size than the camera.
    pub fn cloud(&self, image: &DepthImage) -> Result<Cloud, DepthCameraError> {
        let mut points_m = Vec::with_capacity(image.width_px() * image.height_px());
        let whole = PixelArea::whole(image.width_px(), image.height_px());
        self.for_each_block(image, whole, |_, block| points_m.extend(block.finite_points()))?;
        let frame_id = self.target_frame_id.clone();
        Ok(Cloud { stamp: image.stamp, frame_id, points_m })
    }

    /// Calls `take` for each pixel of an area that has a depth, in the order of the pixels: with its index in the image and the
    /// voxel that [`reduce`](Self::reduce) with this grid puts its point into.
    ///
    /// # Errors
    /// When the image is of another size than the camera.
    pub fn for_each_voxel(
        &self,
        image: &DepthImage,
        area: PixelArea,
        grid: &VoxelGrid,
        mut take: impl FnMut(usize, VoxelKey),
    ) -> Result<(), DepthCameraError> {
        self.for_each_block(image, area, |first, block| {
            let (keys, finite) = (block.keys(grid.edge_m()), block.finite_places());
            for place in (0..block.len.min(PointBlock::CAPACITY)).filter(|place| finite[*place]) {
                take(first + place, keys.at(place));
            }
        })
    }

    /// The points of a depth image reduced by the accumulator's grid (Rec-HV 3.2.3): the same as
    /// [`cloud`](Self::cloud) followed by [`VoxelGrid::reduce`](crate::VoxelGrid::reduce), to the
    /// bit, without the cloud in between. What the accumulator held before is dropped.
    ///
    /// # Errors
    /// When the image is of another size than the camera.
    pub fn reduce(
        &self,
        image: &DepthImage,
        accumulator: &mut VoxelAccumulator,
    ) -> Result<ReducedDepth, DepthCameraError> {
        accumulator.clear();
        let whole = PixelArea::whole(image.width_px(), image.height_px());
        self.for_each_block(image, whole, |_, block| accumulator.push_block(block))?;
        let points_before_reduction = accumulator.points() as usize;
        let (points_m, voxel_points) = accumulator.finish_counted();
        let frame_id = self.target_frame_id.clone();
        let cloud = Cloud { stamp: image.stamp, frame_id, points_m };
        Ok(ReducedDepth { cloud, voxel_points, points_before_reduction })
    }

    /// Calls `take` with the points of an area, a part of a row at a time, and the index of the first one's pixel.
    pub(crate) fn for_each_block(
        &self,
        image: &DepthImage,
        area: PixelArea,
        mut take: impl FnMut(usize, &PointBlock),
    ) -> Result<(), DepthCameraError> {
        let (width_px, height_px) = (image.width_px(), image.height_px());
        if (width_px, height_px) != (self.rays.width_px(), self.rays.height_px()) {
            return Err(DepthCameraError {
                image_width_px: width_px,
                image_height_px: height_px,
                camera_width_px: self.rays.width_px(),
                camera_height_px: self.rays.height_px(),
            });
        }
        let mut block = PointBlock::default();
        let mut depths_m = [0.0; PointBlock::CAPACITY];
        let PixelArea { columns_px, rows_px } = area;
        let end_px = columns_px.end.min(width_px);
        for row_px in rows_px.start..rows_px.end.min(height_px) {
            let Some(rays) = self.rays.row(row_px) else { break };
            for first_px in (columns_px.start..end_px).step_by(PointBlock::CAPACITY) {
                let columns = first_px..end_px.min(first_px + PointBlock::CAPACITY);
                let pixels = row_px * width_px + columns.start..row_px * width_px + columns.end;
                let depths_m = &mut depths_m[..columns.len()];
                image.pixels().load_m(pixels, depths_m);
                self.fill(&mut block, depths_m, rays.part(columns));
                take(row_px * width_px + first_px, &block);
            }
        }
        Ok(())
    }

    /// Puts the points that `depths_m` are the depths of into `block`, holes where there is none.
    fn fill(&self, block: &mut PointBlock, depths_m: &[f32], rays: RayRow<'_>) {
        fill(&self.target_from_camera, self.limits, block, depths_m, rays);
    }
}

#[multiversion(targets("x86_64+avx2"))]
fn fill(
    target_from_camera: &RigidTransform,
    limits: DepthLimits,
    block: &mut PointBlock,
    depths_m: &[f32],
    rays: RayRow<'_>,
) {
    let DepthLimits { min_m, max_m } = limits;
    let PointBlock { x_m, y_m, z_m, len } = block;
    let places = depths_m.iter().zip(x_m).zip(y_m).zip(z_m);
    let place = |depth_m: f32, x: f32, y: f32| {
        // NaN marks the hole, and spreads to all three coordinates.
        let real = (depth_m > 0.0) & (depth_m >= min_m) & (depth_m <= max_m);
        let depth_m = if real { depth_m } else { f32::NAN };
        target_from_camera.apply([x * depth_m, y * depth_m, depth_m])
    };
    match rays {
        RayRow::Straight { x, y } => {
            for ((((&depth_m, x_m), y_m), z_m), &x) in places.zip(x) {
                [*x_m, *y_m, *z_m] = place(depth_m, x, y);
            }
        }
        RayRow::Bent { x, y } => {
            for (((((&depth_m, x_m), y_m), z_m), &x), &y) in places.zip(x).zip(y) {
                [*x_m, *y_m, *z_m] = place(depth_m, x, y);
            }
        }
    }
    *len = depths_m.len();
}
