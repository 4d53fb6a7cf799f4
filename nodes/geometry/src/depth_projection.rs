//! From a depth image to points.

mod pixel_voxels;
#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use multiversion::multiversion;
use nalgebra::Isometry3;

use crate::camera::{RayRow, RayTable};
use crate::point_block::{BlockKeys, PointBlock};
use crate::rigid::RigidTransform;
use crate::{
    Cloud, DepthFrame, DepthImage, DepthPixels, RobotPixels, VoxelAccumulator, VoxelBox, VoxelGrid,
    VoxelKey,
};
pub use pixel_voxels::PixelVoxels;

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

impl DepthCameraError {
    /// Whether an image is as large as those of the camera.
    pub(crate) fn check(image: &DepthImage, rays: &RayTable) -> Result<(), Self> {
        let (image_width_px, image_height_px) = (image.width_px(), image.height_px());
        let (camera_width_px, camera_height_px) = (rays.width_px(), rays.height_px());
        if (image_width_px, image_height_px) == (camera_width_px, camera_height_px) {
            return Ok(());
        }
        Err(Self { image_width_px, image_height_px, camera_width_px, camera_height_px })
    }
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

    fn of(image: &DepthImage) -> Self {
        Self::whole(image.width_px(), image.height_px())
    }
}

/// Turns the depth images of one camera into clouds of one frame.
#[derive(Clone, PartialEq, Debug)]
pub struct DepthProjector {
    rays: RayTable,
    limits: DepthLimits,
    target_frame_id: String,
    target_from_camera: RigidTransform,
    robot: Option<RobotPixels>,
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
            robot: None,
        }
    }

    /// The same, whose clouds are without what these pixels show of the robot itself.
    #[must_use]
    pub fn without_robot(self, robot: RobotPixels) -> Self {
        Self { robot: Some(robot), ..self }
    }

    /// The rays of the camera.
    #[must_use]
    pub fn rays(&self) -> &RayTable {
        &self.rays
    }

    /// A depth image of the camera.
    ///
    /// # Errors
    /// When the image is of another size than the camera.
    pub fn image<'a>(
        &'a self,
        image: &'a Arc<DepthImage>,
    ) -> Result<ProjectableDepth<'a>, DepthCameraError> {
        DepthCameraError::check(image, &self.rays)?;
        Ok(ProjectableDepth { image, projector: self })
    }

    /// Calls `take` with the points of an area of an image of the camera's size, a part of a row at a time, and the index of the
    /// first one's pixel.
    pub(crate) fn for_each_block(
        &self,
        image: &DepthImage,
        area: PixelArea,
        take: impl FnMut(usize, &PointBlock),
    ) {
        for_each_block((image, &self.rays), &self.target_from_camera, self.limits, area, take);
    }
}

/// A depth image with the projector of its camera, which is of the same size.
#[derive(Clone, Copy, Debug)]
pub struct ProjectableDepth<'a> {
    image: &'a Arc<DepthImage>,
    projector: &'a DepthProjector,
}

impl ProjectableDepth<'_> {
    /// The image.
    #[must_use]
    pub fn image(&self) -> &DepthImage {
        self.image
    }

    /// The rays of its camera.
    #[must_use]
    pub fn rays(&self) -> &RayTable {
        &self.projector.rays
    }

    /// The image with its camera, in whole millimetres. Where it is in millimetres it is the same image, and nothing is copied.
    #[must_use]
    pub fn frame(&self) -> DepthFrame {
        DepthFrame::of_its_size(Arc::clone(self.image), self.projector.rays.clone())
    }

    /// The image without the robot.
    fn without_robot(&self) -> Cow<'_, DepthImage> {
        match &self.projector.robot {
            Some(robot) => Cow::Owned(self.image.without(robot.shown_in(self.image))),
            None => Cow::Borrowed(self.image),
        }
    }

    /// The points of the image, row by row.
    #[must_use]
    pub fn cloud(&self) -> Cloud {
        let projector = self.projector;
        let image = &*self.without_robot();
        let mut points_m = Vec::with_capacity(image.width_px() * image.height_px());
        projector.for_each_block(image, PixelArea::of(image), |_, block| {
            points_m.extend(block.finite_points());
        });
        Cloud { stamp: image.stamp, frame_id: projector.target_frame_id.clone(), points_m }
    }

    /// The points of the image reduced by the accumulator's grid (Rec-HV 3.2.3): the same as [`cloud`](Self::cloud) followed by
    /// [`VoxelGrid::reduce`](crate::VoxelGrid::reduce), to the bit, without the cloud in between. What the accumulator held before
    /// is dropped.
    #[must_use]
    pub fn reduce(&self, accumulator: &mut VoxelAccumulator) -> ReducedDepth {
        let image = &*self.without_robot();
        accumulator.clear();
        let mut keys = BlockKeys::default();
        self.projector.for_each_block(image, PixelArea::of(image), |_, block| {
            accumulator.push_block(block, &mut keys, |_, _| {});
        });
        self.reduced(image, accumulator)
    }

    /// The same, and notes the voxels of the pixels for those who ask the frame of this image for them again. Of an image whose
    /// frame has other pixels nothing is noted: of one in metres, and where the robot is left out.
    #[must_use]
    pub fn reduce_and_note(
        &self,
        accumulator: &mut VoxelAccumulator,
        noted: &mut PixelVoxels,
    ) -> ReducedDepth {
        let projector = self.projector;
        let is_of_frame = matches!(self.image.pixels(), DepthPixels::Millimetres(_))
            && projector.robot.is_none()
            && projector.limits == DepthLimits::default();
        if !is_of_frame {
            noted.forget();
            return self.reduce(accumulator);
        }
        accumulator.clear();
        let mut keys = BlockKeys::default();
        noted.begin(self.image, (accumulator.grid(), projector.target_from_camera));
        projector.for_each_block(self.image, PixelArea::of(self.image), |first, block| {
            let voxels = noted.of_block(first, block.len);
            accumulator.push_block(block, &mut keys, |place, voxel| voxels[place] = voxel);
        });
        noted.end(accumulator.keys());
        self.reduced(self.image, accumulator)
    }

    fn reduced(&self, image: &DepthImage, accumulator: &mut VoxelAccumulator) -> ReducedDepth {
        let points_before_reduction = accumulator.points() as usize;
        let (points_m, voxel_points) = accumulator.finish_counted();
        let frame_id = self.projector.target_frame_id.clone();
        let cloud = Cloud { stamp: image.stamp, frame_id, points_m };
        ReducedDepth { cloud, voxel_points, points_before_reduction }
    }
}

/// Calls `take` for each pixel of an area whose voxel is in a box, in the order of the pixels: with its index in the image and the
/// voxel that [`ProjectableDepth::reduce`] with this grid puts its point into.
pub(crate) fn for_each_voxel(
    image_and_rays: (&DepthImage, &RayTable),
    target_from_camera: &RigidTransform,
    area: PixelArea,
    (grid, within): (&VoxelGrid, &VoxelBox),
    mut take: impl FnMut(usize, VoxelKey),
) {
    let (limits, mut keys) = (DepthLimits::default(), BlockKeys::default());
    for_each_block(image_and_rays, target_from_camera, limits, area, |first, block| {
        block.find_keys(grid.edge_m(), &mut keys);
        let are_within = keys.are_within(within);
        if !are_within.contains(&true) {
            return;
        }
        let finite = block.finite_places();
        let places = 0..block.len.min(PointBlock::CAPACITY);
        for place in places.filter(|place| are_within[*place] && finite[*place]) {
            take(first + place, keys.at(place));
        }
    });
}

/// As [`DepthProjector::for_each_block`]. The image is as large as the camera of the rays.
fn for_each_block(
    (image, rays): (&DepthImage, &RayTable),
    target_from_camera: &RigidTransform,
    limits: DepthLimits,
    area: PixelArea,
    mut take: impl FnMut(usize, &PointBlock),
) {
    let (width_px, height_px) = (image.width_px(), image.height_px());
    let mut block = PointBlock::default();
    let mut depths_m = [0.0; PointBlock::CAPACITY];
    let PixelArea { columns_px, rows_px } = area;
    let end_px = columns_px.end.min(width_px);
    for row_px in rows_px.start..rows_px.end.min(height_px) {
        let Some(rays) = rays.row(row_px) else { break };
        for first_px in (columns_px.start..end_px).step_by(PointBlock::CAPACITY) {
            let columns = first_px..end_px.min(first_px + PointBlock::CAPACITY);
            let pixels = row_px * width_px + columns.start..row_px * width_px + columns.end;
            let depths_m = &mut depths_m[..columns.len()];
            image.pixels().load_m(pixels, depths_m);
            fill(target_from_camera, limits, &mut block, depths_m, rays.part(columns));
            take(row_px * width_px + first_px, &block);
        }
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
