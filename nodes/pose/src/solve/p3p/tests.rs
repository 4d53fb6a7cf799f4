use estimation::perturbation::left::perturbation_between;
use proptest::prelude::*;

use super::*;
use crate::solve::testing::{NO_DEPTH, View, kinect};

fn three(view: &View) -> ([Point3<f64>; 3], [Vector3<f64>; 3]) {
    (
        [0, 1, 2].map(|index| view.points[index].point_in_map_m),
        [0, 1, 2].map(|index| kinect().ray(&view.points[index].pixel_px).unwrap().push(1.0)),
    )
}

fn nearest_error(view: &View, poses: &[Isometry3<f64>]) -> f64 {
    let error = |pose: &Isometry3<f64>| perturbation_between(&view.camera_from_map, pose).norm();
    poses.iter().map(error).fold(f64::INFINITY, f64::min)
}

#[test]
fn the_true_pose_is_among_those_found() {
    let (mut missed, mut rough, mut found) = (0, 0, [0_usize; 5]);
    const TRIALS: u64 = 5000;
    for seed in 0..TRIALS {
        let view = View::room(3, 0, NO_DEPTH, seed);
        let (points, rays) = three(&view);
        let poses = p3p(&points, &rays);
        found[poses.len()] += 1;
        let error = nearest_error(&view, &poses);
        missed += usize::from(error > 1e-3);
        rough += usize::from(error > 1e-7);
        // Every pose sees the points where they are seen: all of them are roots.
        for pose in &poses {
            for (point, ray) in points.iter().zip(&rays) {
                let seen = pose * point;
                assert!(seen.z > 0.0);
                let off = (seen.coords / seen.z - ray).norm();
                assert!(off < 1e-6, "seed {seed}: {off}");
            }
        }
    }
    println!("{missed} missed, {rough} rough of {TRIALS}; numbers of poses {found:?}");
    // Close to where two solutions become one, digits are lost.
    assert!(missed <= 1 && rough <= 10, "{missed} {rough}");
    assert!(found[2] > 100 && found[4] > 10, "{found:?}");
}

/// The plain twin: where Newton's method leads to from many starts.
fn poses_by_search(triangle: &Triangle) -> Vec<Vector3<f64>> {
    let mut found: Vec<Vector3<f64>> = Vec::new();
    let steps = [0.2, 0.5, 0.8, 1.1, 1.5, 2.0, 3.0, 4.5, 7.0, 11.0, 18.0];
    for start in steps.iter().flat_map(|a| steps.iter().map(move |b| (*a, *b))) {
        for third in steps {
            let mut distances = Vector3::new(start.0, start.1, third);
            for _ in 0..50 {
                let (errors, slopes) = triangle.errors(&distances);
                let Some(inverse) = slopes.try_inverse() else { break };
                distances -= inverse * errors;
            }
            let solved = triangle.errors(&distances).0.amax() < 1e-10;
            if solved
                && distances.iter().all(|distance| *distance > 0.0)
                && !found.iter().any(|known| (known - distances).norm() < 1e-5 * distances.norm())
            {
                found.push(distances);
            }
        }
    }
    found
}

#[test]
fn all_poses_are_found() {
    let mut counts = [0_usize; 5];
    for seed in 0..40 {
        let view = View::room(3, 0, NO_DEPTH, 1000 + seed);
        let (points, rays) = three(&view);
        let triangle = Triangle::new(&points, &rays).unwrap();
        let (found, expected) = (triangle.distances(), poses_by_search(&triangle));
        counts[found.len()] += 1;
        for distances in &expected {
            let near = |known: &Vector3<f64>| (known - distances).norm() < 1e-4 * distances.norm();
            assert!(found.iter().any(near), "seed {seed}: {distances} is not among {found:?}");
        }
    }
    assert!(counts[2] > 5, "{counts:?}");
}

#[test]
fn where_there_is_no_pose_none_is_found() {
    let point = |x: f64, y: f64| Point3::new(x, y, 2.0);
    let forward = |x: f64, y: f64| Vector3::new(x, y, 1.0);
    let on_a_line = [point(0.0, 0.0), point(1.0, 0.0), point(2.0, 0.0)];
    let triangle = [point(0.0, 0.0), point(1.0, 0.0), point(0.0, 1.0)];
    let rays = [forward(0.0, 0.0), forward(0.5, 0.0), forward(0.0, 0.5)];
    assert!(nearest_error_of_identity(&p3p(&triangle, &rays)) < 1e-9);
    assert!(p3p(&on_a_line, &[rays[0], rays[1], forward(1.0, 0.0)]).is_empty());
    assert!(p3p(&[triangle[0]; 3], &rays).is_empty());
    assert!(p3p(&[triangle[0], triangle[0], triangle[1]], &rays).is_empty());
    assert!(p3p(&triangle, &[rays[0], rays[0], rays[1]]).len() <= 4);
    assert!(p3p(&triangle, &[rays[0], rays[1], Vector3::zeros()]).is_empty());
    for bad in [f64::NAN, f64::INFINITY, 1e200] {
        let spoilt = [point(bad, 0.0), triangle[1], triangle[2]];
        assert!(p3p(&spoilt, &rays).len() <= 4);
        assert!(p3p(&triangle, &[rays[0], rays[1], forward(bad, 0.0)]).len() <= 4);
    }
}

fn nearest_error_of_identity(poses: &[Isometry3<f64>]) -> f64 {
    let identity = Isometry3::identity();
    let error = |pose: &Isometry3<f64>| perturbation_between(&identity, pose).norm();
    poses.iter().map(error).fold(f64::INFINITY, f64::min)
}

proptest! {
    #[test]
    fn any_numbers_are_no_panic(values in prop::array::uniform18(any::<f64>())) {
        let three = |from: usize| [0, 1, 2].map(|index| {
            Vector3::new(values[from + 3 * index], values[from + 3 * index + 1], values[from + 3 * index + 2])
        });
        prop_assert!(p3p(&three(0).map(Point3::from), &three(9)).len() <= 4);
    }
}
