//! The points of one cycle, with what is asked of each of them more than once.

use geometry::{DetectedCycle, VoxelGrid, VoxelKey};
use nalgebra::{Isometry3, Point3, Vector2, Vector3, distance};

/// A point nearer to the camera's plane than this has no slope that means anything.
pub(crate) const MIN_SLOPE_DEPTH_M: f64 = 0.1;

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
    /// The slopes of the ray from the camera to each, if it lies before the camera: sideways and upward, for each metre forward in the rig.
    pub slopes: Vec<Option<Vector2<f64>>>,
    continuous_from_rig: Isometry3<f64>,
}

impl<'a> CyclePoints<'a> {
    /// The points of a cycle whose pose is checked, with their voxels in a grid of the map.
    #[must_use]
    pub fn of(cycle: &'a DetectedCycle, grid: &VoxelGrid) -> Self {
        let continuous_from_rig = cycle.continuous_from_rig();
        let camera_in_rig_m = cycle.setup.mounts.camera_in_rig_m();
        let camera_in_map = continuous_from_rig * camera_in_rig_m;
        let points_in_rig_m = &cycle.reduced_cloud.points_m;
        let in_map: Vec<Point3<f64>> =
            points_in_rig_m.iter().map(|point| continuous_from_rig * point.cast::<f64>()).collect();
        Self {
            voxels: in_map.iter().map(|point| grid.key(point)).collect(),
            distances_m: in_map.iter().map(|point| distance(point, &camera_in_map)).collect(),
            slopes: points_in_rig_m
                .iter()
                .map(|point| slopes_of(&(point.cast::<f64>() - camera_in_rig_m)))
                .collect(),
            cycle,
            camera_in_map,
            in_map,
            continuous_from_rig,
        }
    }

    /// How many there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.in_map.len()
    }

    /// The ray from the camera to a place of the map, along the axes of the rig.
    #[must_use]
    pub fn ray_to_m(&self, place_in_map: &Point3<f64>) -> Vector3<f64> {
        let in_rig = self.continuous_from_rig.inverse_transform_point(place_in_map);
        in_rig - self.cycle.setup.mounts.camera_in_rig_m()
    }
}

/// Sideways and upward slope of a ray from the camera, for each metre forward in the rig; `None` beside or behind the camera, and for
/// what is not finite.
pub(crate) fn slopes_of(ray_m: &Vector3<f64>) -> Option<Vector2<f64>> {
    let is_finite = ray_m.iter().all(|along_m| along_m.is_finite());
    (is_finite && ray_m.x > MIN_SLOPE_DEPTH_M).then(|| Vector2::new(ray_m.y, ray_m.z) / ray_m.x)
}
