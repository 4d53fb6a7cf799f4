use estimation::Serial;
use nalgebra::{Point3, SymmetricEigen};

use super::*;
use crate::testing::Random;

/// A wavy sheet.
fn sheet() -> Vec<Point3<f32>> {
    let mut random = Random::new(5);
    (0..3000)
        .map(|_| {
            let (x, y) = (random.between(-10.0, 10.0), random.between(-10.0, 10.0));
            Point3::new(x, y, 0.3 * (0.5 * x).sin() + random.between(-0.01, 0.01)).cast()
        })
        .collect()
}

#[test]
fn they_are_those_of_a_plain_search_and_of_eigenvectors() {
    let tree = KdTree::new(&sheet(), &Serial);
    let places: Vec<Vector3<f64>> =
        (0..tree.len()).map(|number| Vector3::from(tree.point_m(number)).cast()).collect();
    let normals = normals(&tree, 10, &Serial);
    for number in (0..tree.len()).step_by(37) {
        let mut others = places.clone();
        others.sort_by(|a, b| (a - places[number]).norm().total_cmp(&(b - places[number]).norm()));
        let mean = others[..10].iter().sum::<Vector3<f64>>() / 10.0;
        let scatter = others[..10].iter().map(|at| (at - mean) * (at - mean).transpose()).sum();
        let eigen = SymmetricEigen::new(scatter);
        let expected = eigen.eigenvectors.column(eigen.eigenvalues.imin());
        let normal: Vector3<f64> = normals[number].cast();
        assert!(
            normal == Vector3::zeros() || normal.dot(&expected).abs() > 0.9999,
            "{normal} {expected}"
        );
    }
    assert!(normals.iter().filter(|normal| normal.norm() > 0.5).count() > 2900);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let tree = KdTree::new(&sheet(), &Serial);
    let expected = normals(&tree, 10, &Serial);
    for threads in [2, 3, 16] {
        assert_eq!(normals(&tree, 10, &crate::testing::threads(threads)), expected);
    }
}

#[test]
fn too_few_points_and_one_ray_have_none() {
    let of = |points: &[Point3<f32>]| normals(&KdTree::new(points, &Serial), 10, &Serial);
    assert!(of(&[]).is_empty());
    assert_eq!(of(&[Point3::origin(); 3]), vec![Vector3::zeros(); 3]);
    let ray: Vec<Point3<f32>> = (0..50).map(|at| Point3::new(0.2 * at as f32, 7.0, -1.7)).collect();
    assert_eq!(of(&ray), vec![Vector3::zeros(); 50]);
}
