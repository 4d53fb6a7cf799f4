//! The views of the cycles as the page carries them, in groups that it reads when they are wanted.

use std::collections::HashSet;

use geometry::{BuildVoxelHasher, VoxelEdgeError, VoxelGrid, VoxelKey};
use nalgebra::{Isometry3, Point2, Point3};

use super::planes::{push_differences_8, push_differences_16};
use crate::cycle_view::cloud_steps;
use crate::{CycleRecord, CycleView, RigCamera, RunRecord, ScanView, SmallDepth};

/// Views that are compressed together: enough to compress well, few enough to be read at once.
pub(super) const VIEWS_PER_GROUP: usize = 16;
/// The depths that a code tells apart: from this one ...
const NEAREST_M: f32 = 0.2;
/// ... to this one, in steps of 2.2 %.
const FARTHEST_M: f32 = 50.0;
const CODES: f32 = 254.0;

/// The groups of views, before compression.
pub(super) fn encode(run: &RunRecord) -> Result<Vec<Vec<u8>>, VoxelEdgeError> {
    let grid = VoxelGrid::new(run.voxel_edge_m)?;
    let viewed: Vec<(&CycleRecord, &CycleView)> =
        run.cycles.iter().filter_map(|cycle| Some((cycle, cycle.view.as_ref()?))).collect();
    let group = |views: &[(&CycleRecord, &CycleView)]| {
        let mut bytes = Vec::new();
        for (cycle, view) in views {
            push_scan(&mut bytes, view.scan.as_ref());
            push_cloud(&mut bytes, cycle, view);
            push_depth(&mut bytes, cycle, view, &grid, run.camera.as_ref());
        }
        bytes
    };
    Ok(viewed.chunks(VIEWS_PER_GROUP).map(group).collect())
}

fn push_scan(bytes: &mut Vec<u8>, scan: Option<&ScanView>) {
    let none = ScanView::default();
    let scan = scan.unwrap_or(&none);
    // A scan of more beams is cut: there is none.
    let beams = scan.ranges.len().min(usize::from(u16::MAX));
    bytes.extend((beams as u16).to_le_bytes());
    bytes.extend(scan.first_azimuth_rad.to_le_bytes());
    bytes.extend(scan.azimuth_step_rad.to_le_bytes());
    push_differences_16(bytes, scan.ranges.iter().copied().take(beams));
}

/// The static points first, and then those that were classified as moving.
fn push_cloud(bytes: &mut Vec<u8>, cycle: &CycleRecord, view: &CycleView) {
    let dynamic: HashSet<[i16; 3]> =
        cycle.dynamic_points_m.iter().filter_map(cloud_steps).collect();
    let (moving, fixed): (Vec<[i16; 3]>, Vec<[i16; 3]>) =
        view.cloud.iter().partition(|steps| dynamic.contains(*steps));
    bytes.extend((view.cloud.len() as u32).to_le_bytes());
    bytes.extend((moving.len() as u32).to_le_bytes());
    for axis in 0..3 {
        let points = fixed.iter().chain(&moving);
        push_differences_16(bytes, points.map(|steps| steps[axis].cast_unsigned()));
    }
}

/// A code a pixel, and a bit a pixel for what moves: the pixels whose point is in the voxel of a moving point.
fn push_depth(
    bytes: &mut Vec<u8>,
    cycle: &CycleRecord,
    view: &CycleView,
    grid: &VoxelGrid,
    camera: Option<&RigCamera>,
) {
    let (Some(depth), Some(camera)) = (&view.depth, camera) else {
        bytes.extend([0; 4]);
        return;
    };
    bytes.extend((depth.columns as u16).to_le_bytes());
    bytes.extend((depth.rows as u16).to_le_bytes());
    push_differences_8(bytes, depth.depths_mm.iter().map(|depth_mm| depth_code(*depth_mm)));
    let moving: HashSet<VoxelKey, BuildVoxelHasher> =
        cycle.dynamic_points_m.iter().map(|point_m| grid.key(point_m)).collect();
    let mut bits = vec![0_u8; depth.depths_mm.len().div_ceil(8)];
    if !moving.is_empty() {
        let rig_from_camera: Isometry3<f32> = camera.rig_from_camera.cast();
        for (pixel, depth_mm) in depth.depths_mm.iter().enumerate() {
            let point_m = point_m(depth, camera, pixel, *depth_mm);
            if point_m.is_some_and(|at_m| moving.contains(&grid.key(&(rig_from_camera * at_m)))) {
                bits[pixel / 8] |= 1 << (pixel % 8);
            }
        }
    }
    bytes.append(&mut bits);
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

/// 0 where nothing was measured, and 1 to 255 by the logarithm of the depth.
fn depth_code(depth_mm: u16) -> u8 {
    if depth_mm == 0 {
        return 0;
    }
    let relative = (f32::from(depth_mm) * 1e-3 / NEAREST_M).ln() / (FARTHEST_M / NEAREST_M).ln();
    1 + (relative * CODES).round().clamp(0.0, CODES) as u8
}
