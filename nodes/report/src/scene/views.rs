//! The views of the cycles as the page carries them, in groups that it reads when they are wanted.

use std::collections::HashSet;

use geometry::{BuildVoxelHasher, VoxelEdgeError, VoxelGrid, VoxelKey};
use nalgebra::{Isometry3, Point2, Point3};

use crate::cycle_view::cloud_steps;
use crate::payload::{self, push_scan};
use crate::{CycleRecord, CycleView, RigCamera, RunRecord, SmallDepth};

/// Views that are compressed together: enough to compress well, few enough to be read at once.
pub(super) const VIEWS_PER_GROUP: usize = 16;

/// The groups of views, before compression.
pub(super) fn encode(run: &RunRecord) -> Result<Vec<Vec<u8>>, VoxelEdgeError> {
    let grid = VoxelGrid::new(run.voxel_edge_m)?;
    let camera = run.rig_camera();
    let viewed: Vec<(&CycleRecord, &CycleView)> =
        run.cycles.iter().filter_map(|cycle| Some((cycle, cycle.view.as_ref()?))).collect();
    let group = |views: &[(&CycleRecord, &CycleView)]| {
        let mut bytes = Vec::new();
        for (cycle, view) in views {
            push_scan(&mut bytes, view.scan.as_ref());
            push_cloud(&mut bytes, cycle, view);
            push_depth(&mut bytes, cycle, view, &grid, camera.as_ref());
        }
        bytes
    };
    Ok(viewed.chunks(VIEWS_PER_GROUP).map(group).collect())
}

/// The static points first, and then those that were classified as moving.
fn push_cloud(bytes: &mut Vec<u8>, cycle: &CycleRecord, view: &CycleView) {
    let dynamic: HashSet<[i16; 3]> =
        cycle.dynamic_points_m.iter().filter_map(cloud_steps).collect();
    let (moving, fixed): (Vec<[i16; 3]>, Vec<[i16; 3]>) =
        view.cloud.iter().partition(|steps| dynamic.contains(*steps));
    payload::push_cloud(bytes, &fixed, &moving);
}

/// What moves are the pixels whose point is in the voxel of a moving point.
fn push_depth(
    bytes: &mut Vec<u8>,
    cycle: &CycleRecord,
    view: &CycleView,
    grid: &VoxelGrid,
    camera: Option<&RigCamera>,
) {
    let (Some(depth), Some(camera)) = (&view.depth, camera) else {
        return payload::push_depth(bytes, None, |_| false);
    };
    let moving: HashSet<VoxelKey, BuildVoxelHasher> =
        cycle.dynamic_points_m.iter().map(|point_m| grid.key(point_m)).collect();
    let rig_from_camera: Isometry3<f32> = camera.rig_from_camera.cast();
    payload::push_depth(bytes, Some(depth), |pixel| {
        let point_m = || point_m(depth, camera, pixel, depth.depths_mm[pixel]);
        !moving.is_empty()
            && point_m().is_some_and(|at_m| moving.contains(&grid.key(&(rig_from_camera * at_m))))
    });
}

/// The point of a kept pixel in the camera's frame.
fn point_m(
    depth: &SmallDepth,
    camera: &RigCamera,
    pixel: usize,
    depth_mm: u16,
) -> Option<Point3<f32>> {
    let at = |index: usize| (index * depth.pixel_step) as f64;
    let (column_px, row_px) = (at(pixel % depth.columns), at(pixel / depth.columns));
    let ray = camera.model.ray(&Point2::new(column_px, row_px)).filter(|_| depth_mm > 0)?;
    Some(Point3::from(ray.push(1.0).cast::<f32>() * (f32::from(depth_mm) * 1e-3)))
}
