use nalgebra::Point3;
use proptest::prelude::*;

use super::{KdTree, Neighbours};

fn tree(points_m: &[Point3<f32>], threads: usize) -> KdTree {
    KdTree::new(points_m, &crate::testing::threads(threads))
}

fn square_m2(tree: &KdTree, number: u32, place_m: [f32; 3]) -> f32 {
    (Point3::from(tree.point_m(number as usize)) - Point3::from(place_m)).norm_squared()
}

/// The squares of the distances of all points, the least first.
fn plain(points_m: &[Point3<f32>], place_m: [f32; 3]) -> Vec<f32> {
    let mut squares: Vec<f32> =
        points_m.iter().map(|point| (point - Point3::from(place_m)).norm_squared()).collect();
    squares.sort_by(f32::total_cmp);
    squares
}

/// Coordinates of which many are equal.
fn points() -> impl Strategy<Value = Vec<Point3<f32>>> {
    let coordinate = prop_oneof![-3.0..3.0_f32, (-2..3_i8).prop_map(f32::from)];
    prop::collection::vec(prop::array::uniform3(coordinate).prop_map(Point3::from), 0..200)
}

proptest! {
    #[test]
    fn what_is_found_is_what_looking_at_every_point_finds(
        points in points(), place in prop::array::uniform3(-4.0..4.0_f32), wanted in 1..33_usize,
        limit in 0.01..40.0_f32, hint in prop::option::of(0..300_u32),
    ) {
        let tree = tree(&points, 1);
        let plain: Vec<f32> = plain(&points, place).into_iter().filter(|square| *square < limit).collect();
        let nearest = tree.nearest(place, limit, hint);
        prop_assert_eq!(nearest.map(|number| square_m2(&tree, number, place)), plain.first().copied());
        let mut neighbours = Neighbours::new(wanted, limit);
        tree.neighbours(place, &mut neighbours);
        let found: Vec<f32> =
            neighbours.numbers().iter().map(|number| square_m2(&tree, *number, place)).collect();
        prop_assert_eq!(&found[..], &plain[..wanted.min(plain.len())]);
        let mut numbers = neighbours.numbers().to_vec();
        numbers.sort_unstable();
        numbers.dedup();
        prop_assert_eq!(numbers.len(), found.len());
    }
}

#[test]
fn all_points_are_kept_and_threads_change_nothing() {
    let coordinate = |number: u32, which: u32| {
        (number.wrapping_mul(2_654_435_761).wrapping_add(which.wrapping_mul(97)) >> 7) as f32
            % 211.0
    };
    let points: Vec<Point3<f32>> = (0..9001)
        .map(|number| Point3::from([0, 1, 2].map(|axis| coordinate(number, axis))))
        .collect();
    let one = tree(&points, 1);
    for threads in [2, 3, 8] {
        let more = tree(&points, threads);
        assert_eq!((&one.splits, &one.x_m, &one.y_m), (&more.splits, &more.x_m, &more.y_m));
        assert_eq!(one.z_m, more.z_m);
    }
    let sorted = |mut points: Vec<[f32; 3]>| {
        points.sort_by(|a, b| a.partial_cmp(b).unwrap());
        points
    };
    let kept = (0..one.len()).map(|number| one.point_m(number)).collect();
    assert_eq!(sorted(kept), sorted(points.iter().map(|point| point.coords.into()).collect()));
}

#[test]
fn a_thousand_equal_points_are_a_tree() {
    let tree = tree(&[Point3::new(1.0, 2.0, 3.0); 1000], 2);
    assert!(tree.nearest([1.0, 2.0, 3.0], 1e-6, None).is_some());
    assert_eq!(tree.nearest([1.0, 2.0, 4.0], 1.0, None), None);
}
