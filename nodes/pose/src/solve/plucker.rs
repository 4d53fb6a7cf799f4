//! Lines of space: Plücker coordinates, four numbers to correct one by, its image, and its ends.
//!
//! Bartoli and Sturm 2005, "Structure-from-motion using lines: representation, triangulation, and bundle adjustment"; the
//! map of PL-SLAM keeps its lines so (section 2.2, Figure 9).

mod ends;
mod orthonormal;
#[cfg(test)]
mod tests;

use geometry::CameraModel;
use nalgebra::{Isometry3, Point2, Point3, Vector3};

pub use orthonormal::OrthonormalLine;

/// Directions shorter than this share of the farther point's distance are rounding.
const LEAST_DIRECTION: f64 = 1e-12;

/// A line without ends. Both vectors may be scaled together: it stays the same line.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PluckerLine {
    /// The normal of the plane through the line and the origin: any point of the line, times the direction (cross
    /// product).
    pub moment: Vector3<f64>,
    /// Along the line; at right angles to the moment.
    pub direction: Vector3<f64>,
}

impl PluckerLine {
    /// The line through two points. `None` when they are one, or not finite.
    #[must_use]
    pub fn through(start: &Point3<f64>, end: &Point3<f64>) -> Option<Self> {
        let direction = end - start;
        let size = start.coords.amax().max(end.coords.amax());
        let moment = start.coords.cross(&direction);
        let usable = direction.norm() > LEAST_DIRECTION * size && moment.norm().is_finite();
        usable.then_some(Self { moment, direction })
    }

    /// The line in another frame.
    #[must_use]
    pub fn transformed(&self, target_from_source: &Isometry3<f64>) -> Self {
        let direction = target_from_source.rotation * self.direction;
        let lever = target_from_source.translation.vector.cross(&direction);
        Self { moment: target_from_source.rotation * self.moment + lever, direction }
    }

    /// The point of the line nearest to the origin.
    #[must_use]
    pub fn nearest_to_origin(&self) -> Point3<f64> {
        Point3::from(self.direction.cross(&self.moment) / self.direction.norm_squared())
    }

    /// How far a point lies from the line.
    #[must_use]
    pub fn distance_to(&self, point: &Point3<f64>) -> f64 {
        (point.coords.cross(&self.direction) - self.moment).norm() / self.direction.norm()
    }

    /// Where the line intersects a plane through the origin. `None` when it is parallel to the plane.
    #[must_use]
    pub fn intersection(&self, normal_of_plane: &Vector3<f64>) -> Option<Point3<f64>> {
        let slant = normal_of_plane.dot(&self.direction);
        let point = Point3::from(normal_of_plane.cross(&self.moment) / slant);
        let parallel =
            slant.abs() <= LEAST_DIRECTION * normal_of_plane.norm() * self.direction.norm();
        (!parallel).then_some(point)
    }

    /// The line's image, for a line of the camera frame: `(a, b, c)` with `a * column + b * row + c = 0`, in any scale.
    #[must_use]
    pub fn image(&self, camera: &CameraModel) -> Vector3<f64> {
        image_of_moment(camera, &self.moment)
    }

    /// The distance of a pixel from the line's image, for a line of the camera frame; the sign gives the side. And how the
    /// distance changes with the moment. `None` for a line through the camera's centre, whose image is a point.
    #[must_use]
    pub fn distance_px(
        &self,
        camera: &CameraModel,
        pixel: &Point2<f64>,
    ) -> Option<(f64, Vector3<f64>)> {
        distance_px(camera, &self.moment, pixel)
    }
}

/// See [`PluckerLine::image`].
#[inline]
fn image_of_moment(camera: &CameraModel, moment: &Vector3<f64>) -> Vector3<f64> {
    let CameraModel { fx_px: fx, fy_px: fy, cx_px: cx, cy_px: cy, .. } = *camera;
    let (a, b) = (fy * moment.x, fx * moment.y);
    Vector3::new(a, b, fx * fy * moment.z - a * cx - b * cy)
}

/// See [`PluckerLine::distance_px`].
#[inline]
pub(super) fn distance_px(
    camera: &CameraModel,
    moment: &Vector3<f64>,
    pixel: &Point2<f64>,
) -> Option<(f64, Vector3<f64>)> {
    let CameraModel { fx_px: fx, fy_px: fy, cx_px: cx, cy_px: cy, .. } = *camera;
    let image = image_of_moment(camera, moment);
    let slope2 = image.x * image.x + image.y * image.y;
    let per_slope = slope2.sqrt().recip();
    if !per_slope.is_finite() {
        return None;
    }
    let distance = (image.x * pixel.x + image.y * pixel.y + image.z) * per_slope;
    // By the image's three numbers first, then by the moment's.
    let by_a = (pixel.x - distance * image.x * per_slope) * per_slope;
    let by_b = (pixel.y - distance * image.y * per_slope) * per_slope;
    let by_moment = Vector3::new(
        fy * (by_a - cx * per_slope),
        fx * (by_b - cy * per_slope),
        fx * fy * per_slope,
    );
    distance.is_finite().then_some((distance, by_moment))
}
