use std::collections::BTreeMap;

use proptest::prelude::*;

use super::*;

/// The reduction as one would write it down first: a sorted map and nothing else.
fn plain_twin(grid: &VoxelGrid, points_m: &[Point3<f32>]) -> Vec<Point3<f32>> {
    let mut cells: BTreeMap<VoxelKey, (f64, [f64; 3])> = BTreeMap::new();
    for point in points_m.iter().filter(|point| point.iter().all(|value| value.is_finite())) {
        let (count, sum) = cells.entry(grid.key(point)).or_default();
        *count += 1.0;
        for (axis, value) in sum.iter_mut().zip(point.iter()) {
            *axis += f64::from(*value);
        }
    }
    cells.values().map(|(count, sum)| Point3::from(sum.map(|axis| (axis / count) as f32))).collect()
}

fn bytes_of(points_m: &[Point3<f32>]) -> Vec<[u32; 3]> {
    points_m.iter().map(|point| [point.x, point.y, point.z].map(f32::to_bits)).collect()
}

/// Points as rooms have them, points on corners of cells, and points that no room has.
fn any_coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        8 => -4.0..4.0_f32,
        2 => (-50..50_i32).prop_map(|cell| (f64::from(cell) * 0.08) as f32),
        1 => any::<f32>(),
        1 => Just(f32::MAX),
        1 => Just(-0.0_f32),
    ]
}

fn any_points() -> impl Strategy<Value = Vec<Point3<f32>>> {
    let point = (any_coordinate(), any_coordinate(), any_coordinate());
    proptest::collection::vec(point.prop_map(|(x, y, z)| Point3::new(x, y, z)), 0..300)
}

fn any_edge() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.08), Just(0.02), 1e-6..1e6_f64]
}

proptest! {
    #[test]
    fn the_fast_path_gives_the_bytes_of_the_plain_one(points in any_points(), edge_m in any_edge()) {
        let grid = VoxelGrid::new(edge_m).unwrap();
        prop_assert_eq!(bytes_of(&grid.reduce(&points)), bytes_of(&plain_twin(&grid, &points)));
    }

    #[test]
    fn one_at_a_time_gives_the_bytes_of_all_at_once(points in any_points(), cut in 0..300_usize) {
        let grid = VoxelGrid::new(0.08).unwrap();
        let (first, rest) = points.split_at(cut.min(points.len()));
        let mut accumulator = VoxelAccumulator::new(grid);
        accumulator.push_all(first);
        rest.iter().for_each(|point| accumulator.push(point));
        prop_assert_eq!(bytes_of(&accumulator.finish()), bytes_of(&grid.reduce(&points)));
    }

    #[test]
    fn each_mean_lies_in_its_own_cell_and_the_cells_ascend(points in any_points(), edge_m in any_edge()) {
        let grid = VoxelGrid::new(edge_m).unwrap();
        let occupied: std::collections::BTreeSet<VoxelKey> = points
            .iter()
            .filter(|point| point.iter().all(|value| value.is_finite()))
            .map(|point| grid.key(point))
            .collect();
        let keys: Vec<VoxelKey> = grid.reduce(&points).iter().map(|mean| grid.key(mean)).collect();
        prop_assert_eq!(keys, Vec::from_iter(occupied));
    }

    #[test]
    fn a_mean_close_to_the_corner_does_not_round_into_the_next_cell(
        cell in -2000..2000_i32, copies in 1..500_usize, edge_m in prop_oneof![Just(0.08), Just(0.05), Just(0.02)],
    ) {
        // The largest value of the cell, many times over: the mean has nowhere to go but up.
        let grid = VoxelGrid::new(edge_m).unwrap();
        let key_of = |value: f32| grid.key(&Point3::new(value, 0.0, 0.0)).x;
        let mut value = ((f64::from(cell) + 1.0) * edge_m) as f32;
        while key_of(value) > cell {
            value = value.next_down();
        }
        while key_of(value.next_up()) <= cell {
            value = value.next_up();
        }
        let points = vec![Point3::new(value, value, value); copies];
        let means = grid.reduce(&points);
        prop_assert_eq!(means.len(), 1);
        prop_assert_eq!(key_of(means[0].x), cell);
    }
}

#[test]
fn nothing_reduces_to_nothing() {
    let grid = VoxelGrid::new(0.08).unwrap();
    assert!(grid.reduce(&[]).is_empty());
    assert!(
        grid.reduce(&[Point3::new(f32::NAN, 0.0, 0.0), Point3::new(0.0, f32::INFINITY, 0.0)])
            .is_empty()
    );
}

#[test]
fn the_mean_of_a_cell_is_the_mean_of_its_points() {
    let grid = VoxelGrid::new(0.08).unwrap();
    let points = [
        Point3::new(0.01, 0.01, 0.01),
        Point3::new(0.09, 0.01, 0.01),
        Point3::new(0.03, 0.05, 0.07),
        Point3::new(-0.01, 0.01, 0.01),
    ];
    let expected = [
        Point3::new(-0.01, 0.01, 0.01),
        Point3::new(0.02, 0.03, 0.04),
        Point3::new(0.09, 0.01, 0.01),
    ];
    let means = grid.reduce(&points);
    assert_eq!(means.len(), expected.len());
    for (mean, expected) in means.iter().zip(&expected) {
        assert!((mean - expected).norm() < 1e-8, "{mean} is not {expected}");
    }
}

#[test]
fn a_used_accumulator_is_as_good_as_a_new_one() {
    let grid = VoxelGrid::new(0.08).unwrap();
    let first: Vec<_> =
        (0..20_000).map(|i| Point3::new(i as f32 * 0.1, (i % 7) as f32, 0.0)).collect();
    let second = [Point3::new(1.0, 1.0, 1.0), Point3::new(0.0, 0.0, 0.0)];
    let mut accumulator = VoxelAccumulator::new(grid);
    accumulator.push_all(&first);
    assert_eq!(accumulator.points(), 20_000);
    assert_eq!(bytes_of(&accumulator.finish()), bytes_of(&plain_twin(&grid, &first)));
    assert_eq!((accumulator.points(), accumulator.occupied_cells()), (0, 0));
    accumulator.push_all(&second);
    assert_eq!(bytes_of(&accumulator.finish()), bytes_of(&plain_twin(&grid, &second)));
}

#[test]
fn far_points_cost_cells_and_not_volume() {
    let grid = VoxelGrid::new(1e-3).unwrap();
    let points =
        [Point3::new(f32::MAX, f32::MIN, 0.0), Point3::new(1e6, -1e6, 1e6), Point3::origin()];
    assert_eq!(grid.reduce(&points).len(), 3);
}

#[test]
fn an_edge_that_is_no_length_is_refused() {
    for edge_m in [0.0, -0.08, f64::NAN, f64::INFINITY] {
        let error = VoxelGrid::new(edge_m).unwrap_err();
        assert!(error.to_string().contains(&edge_m.to_string()), "{error}");
    }
}

#[test]
fn a_voxel_has_26_neighbours_and_none_beyond_the_outermost() {
    let key = VoxelKey { x: -1, y: 0, z: 7 };
    let around: Vec<VoxelKey> = key.with_neighbours().collect();
    assert_eq!(around.len(), 27);
    assert!(around.is_sorted() && around.windows(2).all(|pair| pair[0] != pair[1]));
    let is_near = |other: &VoxelKey| {
        [other.x - key.x, other.y - key.y, other.z - key.z].iter().all(|step| step.abs() <= 1)
    };
    assert!(around.contains(&key) && around.iter().all(is_near));
    let mut at_the_corner: Vec<VoxelKey> =
        VoxelKey { x: i32::MIN, y: i32::MAX, z: i32::MAX }.with_neighbours().collect();
    at_the_corner.dedup();
    at_the_corner.sort_unstable();
    at_the_corner.dedup();
    assert_eq!(at_the_corner.len(), 8);
}

proptest! {
    #[test]
    fn the_cell_of_a_quotient_is_its_floor(
        value in prop_oneof![any::<f64>(), -3e9..3e9_f64, (-9..9).prop_map(f64::from)],
    ) {
        prop_assert_eq!(whole_below(value), value.floor() as i32);
    }
}
