//! Where a camera should see a landmark.

use geometry::CameraModel;
use nalgebra::Isometry3;

use crate::map::{MapConfig, MapLine, MapPoint};
use crate::matching::lines::ProjectedLine;
use crate::matching::points::PredictedCorner;

/// Where a camera should see a point: in the image, from about where it was seen before, and on one of the levels
/// (PL-SLAM section 2.1, "Seguimiento del mapa local"). `None` where it should not.
pub(crate) fn predicted_point(
    point: &MapPoint,
    camera: &CameraModel,
    camera_from_map: &Isometry3<f64>,
    (map, max_viewing_angle_rad): (&MapConfig, f64),
) -> Option<PredictedCorner> {
    let in_camera = camera_from_map * point.position_m();
    let pixel = camera.project(&in_camera).filter(|pixel| camera.contains(pixel))?;
    let distance_m = in_camera.coords.norm();
    let look = point.look();
    // A level's step to either side: levels are whole numbers.
    let step = map.scale_factor;
    if distance_m < look.nearest_m / step || distance_m > look.farthest_m * step {
        return None;
    }
    let towards_camera = -(camera_from_map.rotation.inverse() * in_camera.coords) / distance_m;
    if look.towards_cameras.dot(&towards_camera) < max_viewing_angle_rad.cos() {
        return None;
    }
    let level = (look.farthest_m / distance_m).ln() / step.ln();
    let top = f64::from(map.levels) - 1.0;
    Some(PredictedCorner {
        pixel: pixel.cast(),
        level: level.round().clamp(0.0, top) as u8,
        angle_rad: None,
        descriptor: look.descriptor,
    })
}

/// Where a camera should see a line; `None` where less than half of it would be in view.
pub(crate) fn predicted_line(
    line: &MapLine,
    camera: &CameraModel,
    camera_from_map: &Isometry3<f64>,
) -> Option<ProjectedLine> {
    let [start, end] = line.ends_m().map(|end| camera.project(&(camera_from_map * end)));
    let (start_px, end_px) = (start?, end?);
    let middle_px = nalgebra::center(&start_px, &end_px);
    let inside = [start_px, middle_px, end_px].iter().filter(|px| camera.contains(px)).count();
    (inside >= 2).then_some(ProjectedLine { start_px, end_px, descriptor: *line.descriptor() })
}
