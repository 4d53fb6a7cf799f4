//! The ends of a line of the map, by the segment that a keyframe saw of it.

use geometry::CameraModel;
use nalgebra::{Point2, Point3, Vector3};

use super::PluckerLine;

impl PluckerLine {
    /// The points of a line of the camera frame that belong to the ends of the segment seen of it: where the line intersects the
    /// plane through the camera's centre and through the straight line of the image that crosses the segment at right
    /// angles at its end (PL-SLAM, Figure 9).
    ///
    /// `None` when the segment has no length, when the line runs along such a plane, or when an end would lie behind the
    /// camera.
    #[must_use]
    pub fn ends_of(
        &self,
        camera: &CameraModel,
        start_px: &Point2<f64>,
        end_px: &Point2<f64>,
    ) -> Option<[Point3<f64>; 2]> {
        let along = (end_px - start_px).try_normalize(f64::EPSILON)?;
        let end = |pixel: &Point2<f64>| {
            // The crossing line in the image, then the plane that shows as it: K' times the line (Hartley and Zisserman
            // 2004, result 8.2).
            let (a, b, c) = (along.x, along.y, -along.dot(&pixel.coords));
            let (by_column, by_row) = (camera.fx_px * a, camera.fy_px * b);
            let normal = Vector3::new(by_column, by_row, camera.cx_px * a + camera.cy_px * b + c);
            self.intersection(&normal).filter(|point| point.z > 0.0)
        };
        Some([end(start_px)?, end(end_px)?])
    }
}
