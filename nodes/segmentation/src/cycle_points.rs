//! The points of one cycle, with what is asked of each of them more than once.

use geometry::{DetectedCycle, RigMounts, VoxelGrid, VoxelKey};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector2, Vector3, distance};

/// A point nearer to the camera's plane than this has no slope that means anything.
pub(crate) const MIN_SLOPE_DEPTH_M: f64 = 0.1;
/// An optical axis whose level part is shorter looks straight up or down: the rounding of its angles turns it anywhere.
const LEAST_LEVEL: f64 = 1e-6;
/// The axes are exact to so much of their length: a hundredth of a millimetre in 10 km.
const AXIS_STEP: f64 = 1.0 / (1_u64 << 30) as f64;

/// The points of a cycle's reduced cloud, in its order. "Map" is the frame that does not jump when the map is corrected.
#[derive(Clone, Debug)]
pub struct CyclePoints<'a> {
    /// The cycle that they are of.
    pub cycle: &'a DetectedCycle,
    /// The camera in the map.
    pub camera_in_map: Point3<f64>,
    /// Each in the map.
    pub in_map: Vec<Point3<f64>>,
    /// The voxel of each in the map.
    pub voxels: Vec<VoxelKey>,
    /// How far each is from the camera.
    pub distances_m: Vec<f64>,
    /// The slopes of the ray from the camera to each, if it lies before the camera: sideways and upward, for each metre forward.
    pub slopes: Vec<Option<Vector2<f64>>>,
    axes: LevelAxes,
    continuous_from_rig: Isometry3<f64>,
}

impl<'a> CyclePoints<'a> {
    /// The points of a cycle whose pose is checked, with their voxels in a grid of the map.
    #[must_use]
    pub fn of(cycle: &'a DetectedCycle, grid: &VoxelGrid) -> Self {
        Self::at(cycle, grid, cycle.continuous_from_rig())
    }

    /// The same, with the image turned about the camera by a turn of the map.
    #[must_use]
    pub fn turned(cycle: &'a DetectedCycle, grid: &VoxelGrid, turn: &UnitQuaternion<f64>) -> Self {
        let told = cycle.continuous_from_rig();
        let camera_in_map = told * cycle.setup.mounts.camera_in_rig_m();
        Self::at(cycle, grid, Isometry3::rotation_wrt_point(*turn, camera_in_map) * told)
    }

    fn at(cycle: &'a DetectedCycle, grid: &VoxelGrid, continuous_from_rig: Isometry3<f64>) -> Self {
        let camera_in_rig_m = cycle.setup.mounts.camera_in_rig_m();
        let camera_in_map = continuous_from_rig * camera_in_rig_m;
        let axes = LevelAxes::of_camera(&cycle.setup.mounts);
        let points_in_rig_m = &cycle.reduced_cloud.points_m;
        let in_map: Vec<Point3<f64>> =
            points_in_rig_m.iter().map(|point| continuous_from_rig * point.cast::<f64>()).collect();
        Self {
            voxels: in_map.iter().map(|point| grid.key(point)).collect(),
            distances_m: in_map.iter().map(|point| distance(point, &camera_in_map)).collect(),
            slopes: points_in_rig_m
                .iter()
                .map(|point| slopes_of(&axes.of_rig(&(point.cast::<f64>() - camera_in_rig_m))))
                .collect(),
            cycle,
            camera_in_map,
            in_map,
            axes,
            continuous_from_rig,
        }
    }

    /// How many there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.in_map.len()
    }

    /// The ray from the camera to a place of the map: forward, to the left and up.
    #[must_use]
    pub fn ray_to_m(&self, place_in_map: &Point3<f64>) -> Vector3<f64> {
        self.ray_m(&self.continuous_from_rig.inverse_transform_point(place_in_map))
    }

    /// How far forward of the camera a point is; `None` where there is no such point.
    #[must_use]
    pub fn forward_m(&self, point: usize) -> Option<f64> {
        let in_rig_m = self.cycle.reduced_cloud.points_m.get(point)?;
        Some(self.ray_m(&in_rig_m.cast()).x)
    }

    fn ray_m(&self, in_rig_m: &Point3<f64>) -> Vector3<f64> {
        self.axes.of_rig(&(in_rig_m - self.cycle.setup.mounts.camera_in_rig_m()))
    }
}

/// The axes of the camera in the rig's plane: forward as the camera looks, to the left and up, however it is tilted.
#[derive(Clone, Copy, Debug)]
struct LevelAxes {
    /// In the rig, of length 1.
    forward: Vector2<f64>,
}

impl LevelAxes {
    /// The rig's own for a camera that looks straight up or down.
    fn of_camera(mounts: &RigMounts) -> Self {
        let optical_axis = mounts.rig_from_camera * Vector3::z();
        let forward = optical_axis.xy().try_normalize(LEAST_LEVEL).unwrap_or_else(Vector2::x);
        // The sines of a mount's angles are not exact: one that looks along an axis of the rig has that axis.
        Self { forward: forward.map(|share| (share / AXIS_STEP).round() * AXIS_STEP) }
    }

    /// A vector of the rig along these axes.
    fn of_rig(&self, in_rig: &Vector3<f64>) -> Vector3<f64> {
        let (cos, sin) = (self.forward.x, self.forward.y);
        Vector3::new(cos * in_rig.x + sin * in_rig.y, cos * in_rig.y - sin * in_rig.x, in_rig.z)
    }
}

/// Sideways and upward slope of a ray from the camera, for each metre forward; `None` beside or behind the camera, and for what is not
/// finite.
pub(crate) fn slopes_of(ray_m: &Vector3<f64>) -> Option<Vector2<f64>> {
    let is_finite = ray_m.iter().all(|along_m| along_m.is_finite());
    (is_finite && ray_m.x > MIN_SLOPE_DEPTH_M).then(|| Vector2::new(ray_m.y, ray_m.z) / ray_m.x)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
    use std::sync::Arc;

    use geometry::{Cloud, CycleSetup, Stamp};

    use super::*;

    /// The slopes of points that lie before a camera that looks ahead, tilted by 0.2 rad, and how far forward of it they are: with
    /// all turned about the rig's z axis.
    fn seen(yaw_rad: f64) -> Vec<(Option<Vector2<f64>>, Option<f64>)> {
        let turn = Isometry3::rotation(Vector3::z() * yaw_rad);
        let ahead = CycleSetup::default();
        let tilt = Isometry3::rotation(Vector3::y() * 0.2);
        let points_m = [[2.0, 1.0, 0.0], [2.0, -0.6, 1.0], [3.0, 0.0, -0.4], [-3.0, 9.0, 0.0]]
            .map(|point_m| (turn * Point3::from(point_m)).cast::<f32>());
        let stamp = Stamp::default();
        let rig_from_camera = turn * tilt * ahead.mounts.rig_from_camera;
        let cycle = DetectedCycle {
            index: 0,
            setup: CycleSetup { mounts: RigMounts { rig_from_camera, ..ahead.mounts }, ..ahead },
            scan_stamp: stamp,
            voxel_points: vec![1; points_m.len()],
            points_before_reduction: points_m.len(),
            reduced_cloud: Cloud { stamp, frame_id: "rig".to_owned(), points_m: points_m.to_vec() },
            map_from_rig: Isometry3::identity(),
            map_from_continuous: None,
            map_frame_id: "map".to_owned(),
            zones: Vec::new(),
            moving_beams: Vec::new(),
            depth: None,
            scan_rays: Arc::default(),
        };
        let points = CyclePoints::of(&cycle, &VoxelGrid::new(0.08).unwrap());
        points.slopes.iter().copied().zip((0..4).map(|point| points.forward_m(point))).collect()
    }

    /// Regression: slopes were for each metre along the rig's x axis, so that a camera that looked back had none, and no tracks.
    #[test]
    fn a_camera_that_looks_anywhere_has_slopes() {
        let ahead = seen(0.0);
        assert_eq!(
            ahead[0],
            (Some(Vector2::new(0.5, 0.0)), Some(2.0)),
            "the rig's axes to the bit"
        );
        assert_eq!(ahead[3].0, None, "behind the camera");
        for yaw_rad in [FRAC_PI_4, FRAC_PI_2, PI, -FRAC_PI_2] {
            for ((ahead, ahead_m), (turned, turned_m)) in ahead.iter().zip(seen(yaw_rad)) {
                assert_eq!(ahead.is_some(), turned.is_some(), "{yaw_rad}");
                let (ahead, turned) = (ahead.unwrap_or_default(), turned.unwrap_or_default());
                assert!((ahead - turned).amax() < 1e-6, "{yaw_rad}: {ahead} {turned}");
                let apart_m = ahead_m.zip(turned_m).map(|(a_m, b_m)| (a_m - b_m).abs());
                assert!(apart_m.is_some_and(|apart_m| apart_m < 1e-6), "{yaw_rad}: {apart_m:?}");
            }
        }
    }
}
