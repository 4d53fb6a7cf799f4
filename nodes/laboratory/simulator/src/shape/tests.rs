use nalgebra::{Point3, Vector2, Vector3};
use proptest::prelude::*;

use super::Shape;
use crate::Ray;

/// The signed distance of a point to the shape's surface, negative inside: an independent formula to check the
/// intersections.
fn signed_distance_m(shape: &Shape, point: &Point3<f64>) -> f64 {
    let half = shape.half_extent_m();
    let outside = |excess: &[f64]| {
        let beyond = excess.iter().map(|value| value.max(0.0).powi(2)).sum::<f64>().sqrt();
        let within = excess.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b)).min(0.0);
        beyond + within
    };
    let radial = Vector2::new(point.x, point.y).norm();
    match *shape {
        Shape::Box { .. } => {
            outside(&[point.x.abs() - half.x, point.y.abs() - half.y, point.z.abs() - half.z])
        }
        Shape::Cylinder { radius_m, .. } => outside(&[radial - radius_m, point.z.abs() - half.z]),
        Shape::Capsule { radius_m, length_m } => {
            let along = point.z.clamp(-length_m / 2.0, length_m / 2.0);
            (point - Point3::new(0.0, 0.0, along)).norm() - radius_m
        }
        Shape::Sphere { radius_m } => point.coords.norm() - radius_m,
        Shape::Rectangle { .. } => {
            outside(&[point.x.abs() - half.x, point.y.abs() - half.y, point.z.abs()]).max(0.0)
        }
        Shape::Mesh(_) => panic!("meshes have tests of their own"),
    }
}

fn shapes() -> impl Strategy<Value = Shape> {
    let size = || 0.05..2.0_f64;
    prop_oneof![
        [size(), size(), size()].prop_map(|size_m| Shape::Box { size_m }),
        (size(), size()).prop_map(|(radius_m, height_m)| Shape::Cylinder { radius_m, height_m }),
        (size(), size()).prop_map(|(radius_m, length_m)| Shape::Capsule { radius_m, length_m }),
        size().prop_map(|radius_m| Shape::Sphere { radius_m }),
        [size(), size()].prop_map(|size_m| Shape::Rectangle { size_m }),
    ]
}

/// A ray from anywhere towards a point near the shape, so that most of them hit; the direction's length is
/// not 1.
fn rays() -> impl Strategy<Value = Ray> {
    ([-4.0..4.0_f64, -4.0..4.0, -4.0..4.0], [-1.0..1.0_f64, -1.0..1.0, -1.0..1.0], 0.2..3.0_f64)
        .prop_filter_map("a ray needs a direction", |(origin, target, scale)| {
            let origin = Point3::from(origin);
            let direction = (Point3::from(target) - origin) * scale;
            (direction.norm() > 1e-3).then_some(Ray { origin, direction })
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn a_hit_lies_on_the_surface_and_nothing_lies_before_it(shape in shapes(), ray in rays()) {
        let inside = signed_distance_m(&shape, &ray.origin) < 0.0;
        let signed = |parameter: f64| {
            let distance_m = signed_distance_m(&shape, &ray.at(parameter));
            if inside { -distance_m } else { distance_m }
        };
        let hit = shape.intersect(&ray);
        // Without a hit the ray is followed well past the shape.
        let end = hit.map_or(10.0 / ray.direction.norm() + 10.0, |hit| hit.parameter);
        if let Some(hit) = hit {
            prop_assert!(hit.parameter > 0.0);
            prop_assert!(signed(hit.parameter).abs() < 1e-6, "off by {}", signed(hit.parameter));
        } else {
            prop_assert!(!inside, "from inside every ray leaves");
        }
        for step in 0..400 {
            let parameter = end * f64::from(step) / 400.0;
            prop_assert!(
                signed(parameter) > -1e-6,
                "the surface was crossed before {end}, at {parameter}"
            );
        }
    }

    #[test]
    fn the_normal_has_length_one_and_points_out(shape in shapes(), ray in rays()) {
        let Some(hit) = shape.intersect(&ray) else { return Ok(()) };
        prop_assert!((hit.normal.norm() - 1.0).abs() < 1e-6);
        let point = ray.at(hit.parameter);
        let (out, back) = (point + hit.normal * 1e-4, point - hit.normal * 1e-4);
        prop_assert!(signed_distance_m(&shape, &out) > 0.5e-4);
        if !matches!(shape, Shape::Rectangle { .. }) {
            prop_assert!(signed_distance_m(&shape, &back) < 0.0);
        }
        let cos = hit.cos_incidence(&ray.direction);
        prop_assert!((0.0..=1.0).contains(&cos));
    }

    #[test]
    fn the_surface_stays_within_the_stated_extent(shape in shapes(), ray in rays()) {
        let Some(hit) = shape.intersect(&ray) else { return Ok(()) };
        let point = ray.at(hit.parameter);
        let half = shape.half_extent_m();
        for axis in 0..3 {
            prop_assert!(point[axis].abs() <= half[axis] + 1e-9);
        }
    }
}

#[test]
fn known_distances() {
    let along_x = Ray { origin: Point3::new(-3.0, 0.0, 0.0), direction: Vector3::x() };
    let parameter =
        |shape: Shape, ray: &Ray| shape.intersect(ray).map(|hit| (hit.parameter * 1e9).round());
    assert_eq!(parameter(Shape::Box { size_m: [2.0, 1.0, 1.0] }, &along_x), Some(2e9));
    assert_eq!(parameter(Shape::Cylinder { radius_m: 0.5, height_m: 1.0 }, &along_x), Some(2.5e9));
    assert_eq!(parameter(Shape::Sphere { radius_m: 0.25 }, &along_x), Some(2.75e9));
    // A ray in the plane of a rectangle could only hit its edge, which has no thickness.
    assert_eq!(parameter(Shape::Rectangle { size_m: [1.0, 1.0] }, &along_x), None);
    let down = Ray { origin: Point3::new(0.1, 0.1, 3.0), direction: -Vector3::z() * 2.0 };
    assert_eq!(parameter(Shape::Rectangle { size_m: [1.0, 1.0] }, &down), Some(1.5e9));
    assert_eq!(parameter(Shape::Capsule { radius_m: 0.2, length_m: 1.0 }, &along_x), Some(2.8e9));
}
