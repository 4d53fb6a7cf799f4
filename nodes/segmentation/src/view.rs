//! What the camera can see, in slopes: how far to the side and up a ray goes for each metre forward.

use geometry::{DetectedCycle, View, slopes_from};
use nalgebra::{Point3, Vector2};

/// Takes in what a cycle shows.
pub fn widen(view: &mut View, cycle: &DetectedCycle) {
    for point in &cycle.reduced_cloud.points_m {
        if let Some(slopes) = slopes(cycle, &point.cast::<f64>()) {
            view.widen(&slopes);
        }
    }
}

/// Whether a point of the map lies between the view's right and left borders, however high.
pub(crate) fn has_bearing_of(
    view: &View,
    cycle: &DetectedCycle,
    point_in_map: &Point3<f64>,
) -> bool {
    let in_rig = cycle.map_from_rig.inverse_transform_point(point_in_map);
    slopes(cycle, &in_rig).is_some_and(|slopes| (view.least.x..=view.most.x).contains(&slopes.x))
}

/// Sideways and upward slope of the ray from the camera to a point; `None` beside or behind the camera.
pub(crate) fn slopes(cycle: &DetectedCycle, point_in_rig: &Point3<f64>) -> Option<Vector2<f64>> {
    slopes_from(&cycle.setup.mounts.camera_in_rig_m(), point_in_rig)
}
