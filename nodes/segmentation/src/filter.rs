//! What moves, at the moment of any scan, image or cloud: for filters of the sensors' own messages.
//!
//! A cycle says what moves at its own moment. For another moment, as of the images between two scans, its moving points are
//! carried on by the velocities of their tracks, and seen from where the rig has got to by then.

mod carried;
mod colour;
mod verdict;

use std::collections::{HashSet, VecDeque};
use std::sync::Arc;

use geometry::{
    BuildVoxelHasher, CameraModel, CloudCamera, DepthFrame, DepthFrameError, DepthImage,
    MovingBeam, OrganisedCloud, RobotBox, Scan, Stamp, VoxelGrid, VoxelKey,
};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::floor::Floor;
use crate::moving_pixels::MovingPixels;
use carried::rig_pose_at;
use colour::Views;
pub use verdict::Verdict;

/// A verdict is carried on for so long. A walker who turns is by then where no constant velocity leads.
const LONGEST_CARRY_S: f64 = 1.0;
/// More than the fastest scanner makes in that time.
const VERDICTS_KEPT: usize = 64;

/// Finds which beams, pixels and points of the scans, images and clouds of a rig move.
#[derive(Clone, Debug)]
pub struct MotionFilter {
    grid: VoxelGrid,
    /// Of the last cycles, by their order.
    verdicts: VecDeque<Verdict>,
    moving_pixels: MovingPixels,
    cloud_camera: CloudCamera,
    /// What the last images show that moves, for those of a colour camera.
    views: Views,
}

impl MotionFilter {
    /// A filter of cycles whose clouds were reduced by this grid.
    #[must_use]
    pub fn new(grid: VoxelGrid) -> Self {
        Self {
            grid,
            verdicts: VecDeque::new(),
            moving_pixels: MovingPixels::new(grid),
            cloud_camera: CloudCamera::default(),
            views: Views::default(),
        }
    }

    /// Takes the verdict of a cycle. One of an earlier time begins anew.
    pub fn take(&mut self, verdict: Verdict) {
        if self.verdicts.back().is_some_and(|last| verdict.scan_stamp <= last.scan_stamp) {
            self.clear();
        }
        self.views.forget_at(verdict.view_stamp);
        if self.verdicts.len() == VERDICTS_KEPT {
            self.verdicts.pop_front();
        }
        self.verdicts.push_back(verdict);
    }

    /// Forgets all verdicts.
    pub fn clear(&mut self) {
        self.verdicts.clear();
        self.views.clear();
    }

    /// Whether a scan of this stamp is decided: no later cycle says more of it.
    #[must_use]
    pub fn has_scan(&self, stamp: Stamp) -> bool {
        self.verdicts.back().is_some_and(|last| last.scan_stamp >= stamp)
    }

    /// Whether an image or a cloud of this stamp is decided.
    #[must_use]
    pub fn has_view(&self, stamp: Stamp) -> bool {
        self.verdicts.back().is_some_and(|last| last.view_stamp >= stamp)
    }

    /// The beams of a scan that hit what moves, or the robot itself, by rising index: those of the scan's own cycle, and those that end
    /// beside moving points. `None` where no cycle is near.
    #[must_use]
    pub fn beams(&self, scan: &Scan) -> Option<Vec<MovingBeam>> {
        let own = self.verdicts.iter().rev().find(|one| one.scan_stamp == scan.stamp);
        // The beams were measured one after the other: on average in the middle of the turn.
        let turn_s = f64::from(scan.time_increment_s) * scan.ranges_m.len() as f64;
        let middle = scan.stamp.plus_seconds(0.5 * turn_s.clamp(0.0, LONGEST_CARRY_S));
        let verdict = own.or_else(|| self.nearest(middle))?;
        let rig_from_lidar = verdict.mounts.rig_from_lidar;
        let voxels = self.voxels_of(&points_of(&self.moving_in_rig(verdict, middle)));
        let known = own.map_or(&[][..], |own| &own.beams);
        let beams = (0..scan.ranges_m.len()).filter_map(|index| {
            let beam = index as u32;
            if let Ok(place) = known.binary_search_by_key(&beam, |known| known.index) {
                return Some(known[place]);
            }
            let hit = rig_from_lidar * scan.hit_m(index)?;
            let is_of_robot = verdict.robot.is_some_and(|robot| robot.contains(&hit));
            let is_taken = is_of_robot || self.is_beside(&voxels, &hit.cast::<f32>());
            is_taken.then_some(MovingBeam { index: beam, background_m: None })
        });
        Some(beams.collect())
    }

    /// The pixels of a depth image that show what moves, or the robot itself, row by row; `None` where no cycle is near.
    ///
    /// # Errors
    /// When the image is not of this camera.
    pub fn pixels(
        &mut self,
        image: &Arc<DepthImage>,
        camera: &CameraModel,
    ) -> Result<Option<Vec<bool>>, DepthFrameError> {
        self.views.look_at(image.stamp);
        let Some(verdict) = self.nearest(image.stamp) else { return Ok(None) };
        let rig_from_camera = verdict.mounts.rig_from_camera;
        let moving = self.moving_in_rig(verdict, image.stamp);
        if let Some(depth) = &verdict.depth
            && verdict.view_stamp == image.stamp
            && depth.frame().camera() == camera
        {
            let is_moving = depth.is_moving().to_vec();
            let frame = Arc::clone(depth.frame());
            self.views.keep(&frame, &rig_from_camera, (&is_moving, &moving), &self.grid);
            return Ok(Some(is_moving));
        }
        let robot = verdict.robot;
        if moving.is_empty() && robot.is_none() {
            self.views.keep_nothing(image.stamp, &rig_from_camera);
            return Ok(Some(vec![false; image.pixels().len()]));
        }
        let frame = DepthFrame::new(Arc::clone(image), *camera)?;
        let floor_in_rig = self.floor_in_rig(verdict, image.stamp);
        let camera = (&rig_from_camera, robot.as_ref());
        Ok(Some(self.mask(&frame, camera, floor_in_rig.as_ref(), &moving)))
    }

    /// The points of a cloud of `places` points, row by row, that move, or are of the robot itself; `None` where no cycle is near. Where a pinhole camera has
    /// computed the cloud, they are the pixels of its depth image; otherwise the points beside moving ones.
    pub fn points(&mut self, cloud: &OrganisedCloud, places: usize) -> Option<Vec<bool>> {
        let stamp = cloud.cloud().stamp;
        self.views.look_at(stamp);
        let verdict = self.nearest(stamp)?;
        let rig_from_camera = verdict.mounts.rig_from_camera;
        let moving = self.moving_in_rig(verdict, stamp);
        let mut is_moving = vec![false; places];
        let robot = verdict.robot;
        if moving.is_empty() && robot.is_none() {
            self.views.keep_nothing(stamp, &rig_from_camera);
            return Some(is_moving);
        }
        let floor_in_rig = self.floor_in_rig(verdict, stamp);
        match self.cloud_camera.frame_of_organised(cloud) {
            Ok(frame) if frame.image().pixels().len() == places => {
                let camera = (&rig_from_camera, robot.as_ref());
                is_moving = self.mask(&frame, camera, floor_in_rig.as_ref(), &moving);
            }
            _ => {
                let voxels = self.voxels_of(&points_of(&moving));
                let rig_from_camera = rig_from_camera.cast::<f32>();
                for (point, [column, row]) in cloud.with_pixels() {
                    let in_rig = rig_from_camera * point;
                    let is_of_robot = robot.is_some_and(|robot| robot.contains(&in_rig.cast()));
                    if let Some(place) = is_moving.get_mut(row * cloud.width_px() + column) {
                        *place = is_of_robot || self.is_beside(&voxels, &in_rig);
                    }
                }
            }
        }
        Some(is_moving)
    }

    /// The mask of an image, which is kept for those of a colour camera.
    fn mask(
        &mut self,
        frame: &DepthFrame,
        (rig_from_camera, robot): (&Isometry3<f64>, Option<&RobotBox>),
        floor_in_rig: Option<&Floor>,
        moving: &[Moving],
    ) -> Vec<bool> {
        let points = moving.iter().map(|(point, _)| point);
        let is_moving =
            self.moving_pixels.mask(frame, (rig_from_camera, robot), floor_in_rig, points);
        self.views.keep(frame, rig_from_camera, (&is_moving, moving), &self.grid);
        is_moving
    }

    /// The verdict whose view is nearest in time, the earlier one of two.
    fn nearest(&self, stamp: Stamp) -> Option<&Verdict> {
        nearest_in_time(&self.verdicts, stamp, |verdict| verdict.view_stamp)
    }

    /// Where the verdict's moving points are in the rig at a moment, each with its velocity.
    fn moving_in_rig(&self, verdict: &Verdict, at: Stamp) -> Vec<Moving> {
        let after_s = at.seconds_since(verdict.view_stamp);
        let rig_from_map = self.map_from_rig(verdict, at).inverse();
        let carried = |point: &verdict::MovingPoint| {
            let in_map = point.in_map_m + point.velocity_m_per_s * after_s;
            ((rig_from_map * in_map).cast::<f32>(), point.velocity_m_per_s)
        };
        if after_s == 0.0 {
            // Not to the map and back: the points are to stay in their voxels.
            let own = |point: &verdict::MovingPoint| (point.in_rig_m, point.velocity_m_per_s);
            return verdict.points.iter().map(own).collect();
        }
        verdict.points.iter().map(carried).collect()
    }

    /// The verdict's floor as the rig sees it at a moment.
    fn floor_in_rig(&self, verdict: &Verdict, at: Stamp) -> Option<Floor> {
        let then_from_now = verdict.map_from_rig.inverse() * self.map_from_rig(verdict, at);
        verdict.floor_in_rig.map(|floor| floor.seen_from(&then_from_now))
    }

    fn map_from_rig(&self, verdict: &Verdict, at: Stamp) -> Isometry3<f64> {
        rig_pose_at(&self.verdicts, at).unwrap_or(verdict.map_from_rig)
    }

    fn voxels_of(&self, points: &[Point3<f32>]) -> HashSet<VoxelKey, BuildVoxelHasher> {
        points.iter().map(|point| self.grid.key(point)).collect()
    }

    /// Whether a point lies in a voxel of these, or beside one.
    fn is_beside(&self, voxels: &HashSet<VoxelKey, BuildVoxelHasher>, point: &Point3<f32>) -> bool {
        !voxels.is_empty()
            && self.grid.key(point).with_neighbours().any(|voxel| voxels.contains(&voxel))
    }
}

/// What is nearest in time by its stamp, if it may be carried on so far; the earlier one of two.
fn nearest_in_time<T>(
    all: &VecDeque<T>,
    stamp: Stamp,
    stamp_of: impl Fn(&T) -> Stamp,
) -> Option<&T> {
    let away_s = |one: &&T| stamp_of(one).seconds_since(stamp).abs();
    let near = all.iter().min_by(|a, b| away_s(a).total_cmp(&away_s(b)));
    near.filter(|one| away_s(one) <= LONGEST_CARRY_S)
}

/// A moving point in the rig, with its velocity in the map.
type Moving = (Point3<f32>, Vector3<f64>);

fn points_of(moving: &[Moving]) -> Vec<Point3<f32>> {
    moving.iter().map(|(point, _)| *point).collect()
}

#[cfg(test)]
mod tests;
