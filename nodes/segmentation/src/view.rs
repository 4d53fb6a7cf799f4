//! What the camera can see, in slopes: how far to the side and up a ray goes for each metre forward.

use geometry::DetectedCycle;
use nalgebra::{Point3, Vector2};

/// A point nearer to the camera's plane than this has no slope that means anything.
pub(crate) const MIN_DEPTH_M: f64 = 0.1;

/// The camera's view. Nothing tells it but the points themselves, so it is the widest that was ever seen.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct View {
    /// The slopes of its right and lower borders.
    pub(crate) least: Vector2<f64>,
    /// The slopes of its left and upper borders.
    pub(crate) most: Vector2<f64>,
}

impl Default for View {
    fn default() -> Self {
        Self { least: Vector2::repeat(f64::INFINITY), most: Vector2::repeat(f64::NEG_INFINITY) }
    }
}

impl View {
    /// Takes in what a cycle shows.
    pub fn widen(&mut self, cycle: &DetectedCycle) {
        for point in &cycle.reduced_cloud.points_m {
            if let Some(slopes) = slopes(cycle, &point.cast::<f64>()) {
                self.least = self.least.inf(&slopes);
                self.most = self.most.sup(&slopes);
            }
        }
    }

    /// Whether a direction lies within all its borders.
    pub(crate) fn contains(&self, slopes: &Vector2<f64>) -> bool {
        *slopes >= self.least && *slopes <= self.most
    }

    /// Whether a point of the map lies between its right and left borders, however high.
    pub(crate) fn has_bearing_of(&self, cycle: &DetectedCycle, point_in_map: &Point3<f64>) -> bool {
        let in_rig = cycle.map_from_rig.inverse_transform_point(point_in_map);
        slopes(cycle, &in_rig)
            .is_some_and(|slopes| (self.least.x..=self.most.x).contains(&slopes.x))
    }
}

/// Sideways and upward slope of the ray from the camera to a point; `None` beside or behind the camera.
pub(crate) fn slopes(cycle: &DetectedCycle, point_in_rig: &Point3<f64>) -> Option<Vector2<f64>> {
    slopes_from(&cycle.camera_in_rig_m, point_in_rig)
}

/// The same from a camera at `camera_in_rig_m`.
pub(crate) fn slopes_from(
    camera_in_rig_m: &Point3<f64>,
    point_in_rig: &Point3<f64>,
) -> Option<Vector2<f64>> {
    let ray = point_in_rig - camera_in_rig_m;
    let finite = ray.iter().all(|value| value.is_finite());
    (finite && ray.x > MIN_DEPTH_M).then(|| Vector2::new(ray.y, ray.z) / ray.x)
}
