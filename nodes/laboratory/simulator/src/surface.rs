//! Coordinates on the surface of a shape, for patterns.

use nalgebra::{Point3, Vector3};

use crate::Shape;

/// A position on a shape's surface.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Place {
    /// Lengths along the surface.
    pub(crate) uv_m: [f64; 2],
    /// The side, which has its own pattern.
    pub(crate) side: u32,
}

/// The surface coordinates of a point, given in the shape's frame with its unit normal.
///
/// Flat sides carry the two coordinates along them (of upright sides the second is the height), the mantles of
/// round shapes the length around them and the height. Lengths are those on the surface, but for round ends.
pub(crate) fn place(shape: &Shape, point: &Point3<f64>, normal: &Vector3<f64>) -> Place {
    match shape {
        Shape::Rectangle { .. } => Place { uv_m: [point.y, -point.x], side: 0 },
        Shape::Cylinder { .. } if normal.z.abs() > 0.5 => flat(point, normal),
        Shape::Cylinder { radius_m, .. }
        | Shape::Capsule { radius_m, .. }
        | Shape::Sphere { radius_m } => {
            Place { uv_m: [radius_m * point.y.atan2(point.x), point.z], side: 0 }
        }
        Shape::Box { .. } => flat(point, normal),
        Shape::Mesh(_) => {
            // Both sides of a triangle have the same coordinates.
            let place = flat(point, normal);
            Place { side: place.side / 2, ..place }
        }
    }
}

/// By the axis that the normal is nearest to.
fn flat(point: &Point3<f64>, normal: &Vector3<f64>) -> Place {
    let axis = normal.iamax();
    let uv_m = match axis {
        0 => [point.y, point.z],
        1 => [point.x, point.z],
        _ => [point.x, point.y],
    };
    let outwards = normal.get(axis).is_some_and(|component| *component > 0.0);
    Place { uv_m, side: 2 * axis as u32 + u32::from(outwards) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Ray;

    /// Two rays that hit a shape close to each other get coordinates that are as close.
    #[test]
    fn lengths_on_the_surface_are_those_of_the_pattern() {
        let shapes = [
            Shape::Box { size_m: [1.0, 0.8, 0.6] },
            Shape::Cylinder { radius_m: 0.4, height_m: 1.0 },
            Shape::Sphere { radius_m: 0.4 },
            Shape::Rectangle { size_m: [1.0, 0.8] },
        ];
        for shape in shapes {
            for target in [[0.05, 0.1, 0.02], [-0.1, 0.05, 0.0], [0.02, -0.1, 0.01]] {
                let from = Point3::new(3.0, 0.4, 1.0);
                let hit = |shift_m: f64| {
                    let target = Point3::from(target) + Vector3::new(0.0, shift_m, 0.0);
                    let ray = Ray { origin: from, direction: target - from };
                    let hit = shape.intersect(&ray).unwrap();
                    let point = ray.at(hit.parameter);
                    (point, place(&shape, &point, &hit.normal))
                };
                let ((a, here), (b, there)) = (hit(0.0), hit(1e-4));
                assert_eq!(here.side, there.side);
                let step_m = (here.uv_m[0] - there.uv_m[0]).hypot(here.uv_m[1] - there.uv_m[1]);
                let way_m = (a - b).norm();
                // Near the middle of a ball's height the pattern is stretched by little.
                assert!((step_m / way_m - 1.0).abs() < 0.12, "{shape:?}: {step_m} for {way_m}");
            }
        }
    }
}
