use geometry::{Method, PipelineConfig};
use proptest::prelude::*;

use super::*;

fn cloud(points: &[[f32; 3]]) -> Cloud {
    testing::cloud(Stamp::from_nanos(5), "map", points)
}

fn config_of(voxel_edge_m: f64, max_voxels: usize) -> ReconstructionConfig {
    let pipeline = PipelineConfig::new(Method::RecHv, voxel_edge_m);
    ReconstructionConfig { pipeline, max_voxels, ..ReconstructionConfig::default() }
}

fn map(voxel_edge_m: f64, max_voxels: usize) -> StaticMap {
    let config = config_of(voxel_edge_m, max_voxels);
    StaticMap::new(config).unwrap()
}

fn map_of(voxel_edge_m: f64, clouds: &[Cloud]) -> StaticMap {
    let mut map = map(voxel_edge_m, 1_000_000);
    for cloud in clouds {
        map.add(cloud).unwrap();
    }
    map
}

/// The mean of each voxel in the order of the keys, as plainly as can be.
fn reduced_plainly(voxel_edge_m: f64, points: &[Point3<f32>]) -> Vec<Point3<f32>> {
    let grid = VoxelGrid::new(voxel_edge_m).unwrap();
    let mut cells = std::collections::BTreeMap::<VoxelKey, Vec<Point3<f64>>>::new();
    for point in points {
        cells.entry(grid.key(point)).or_default().push(point.cast());
    }
    let mean = |points: &Vec<Point3<f64>>| {
        let sum = points.iter().fold(Point3::origin(), |sum, point| sum + point.coords);
        (sum / points.len() as f64).cast()
    };
    cells.values().map(mean).collect()
}

#[track_caller]
fn check_points(got: &[Point3<f32>], expected: &[Point3<f32>]) {
    assert_eq!(got.len(), expected.len());
    for (got, expected) in got.iter().zip(expected) {
        let tolerance_m = 1e-6 * (1.0 + expected.coords.norm());
        assert!((got - expected).norm() < tolerance_m, "{got} is not {expected}");
    }
}

#[test]
fn equation_9_by_hand() {
    // Edge 1 m: the first two points and the fourth share a voxel, the third has its own.
    let mut map = map(1.0, 10);
    let first = map.add(&cloud(&[[0.0, 0.5, 0.0], [0.5, 0.5, 0.0], [1.5, 0.5, 0.0]])).unwrap();
    let second = map.add(&cloud(&[[0.25, 0.5, 0.75], [-0.5, 0.5, 0.0]])).unwrap();
    assert_eq!(
        map.points(),
        [Point3::new(-0.5, 0.5, 0.0), Point3::new(0.25, 0.5, 0.25), Point3::new(1.5, 0.5, 0.0)]
    );
    let expected =
        Addition { added_points: 3, new_voxels: 2, changed_voxels: 2, ..Addition::default() };
    assert_eq!(first, expected);
    let expected =
        Addition { added_points: 2, new_voxels: 1, changed_voxels: 2, ..Addition::default() };
    assert_eq!(second, expected);
    assert_eq!(map.changed(), [VoxelKey { x: 0, y: 0, z: 0 }, VoxelKey { x: -1, y: 0, z: 0 }]);
    let (mean, points) = map.voxel(VoxelKey { x: 0, y: 0, z: 0 }).unwrap();
    assert_eq!((mean, points), (Point3::new(0.25, 0.5, 0.25), 3));
}

#[test]
fn the_repeated_average_of_the_thesis_differs() {
    // One voxel sees x = 0, 0.5, 0.5 in three cycles. Reducing the map with each cloud in turn gives
    // 0, then (0 + 0.5) / 2 = 0.25, then (0.25 + 0.5) / 2 = 0.375: the last cycle weighs a half.
    let clouds = [0.0, 0.5, 0.5].map(|x| cloud(&[[x, 0.0, 0.0]]));
    let mut repeated: Vec<Point3<f32>> = Vec::new();
    for cloud in &clouds {
        repeated.extend(&cloud.points_m);
        repeated = reduced_plainly(1.0, &repeated);
    }
    assert_eq!(repeated, [Point3::new(0.375, 0.0, 0.0)]);
    // The voxel grid of the concatenation: (0 + 0.5 + 0.5) / 3.
    assert_eq!(map_of(1.0, &clouds).points(), [Point3::new(1.0 / 3.0, 0.0, 0.0)]);
    let concatenation: Vec<_> = clouds.iter().flat_map(|cloud| cloud.points_m.clone()).collect();
    assert_eq!(reduced_plainly(1.0, &concatenation), [Point3::new(1.0 / 3.0, 0.0, 0.0)]);
}

#[test]
fn a_full_map_refuses_new_voxels_and_still_refines_its_own() {
    let mut map = map(1.0, 2);
    let addition = map
        .add(&cloud(&[[0.5, 0.0, 0.0], [1.5, 0.0, 0.0], [2.5, 0.0, 0.0], [0.0, 0.0, 0.0]]))
        .unwrap();
    assert_eq!((addition.added_points, addition.refused_points, addition.new_voxels), (3, 1, 2));
    assert_eq!(map.points(), [Point3::new(0.25, 0.0, 0.0), Point3::new(1.5, 0.0, 0.0)]);
    map.add(&cloud(&[[9.5, 0.0, 0.0]])).unwrap();
    assert_eq!((map.len(), map.refused_points()), (2, 2));
}

#[test]
fn points_without_a_number_are_left_out() {
    let mut map = map(1.0, 10);
    let bad = [[f32::NAN, 0.0, 0.0], [0.0, f32::INFINITY, 0.0], [0.5, 0.5, 0.5]];
    let addition = map.add(&cloud(&bad)).unwrap();
    assert_eq!((addition.added_points, addition.not_finite_points), (1, 2));
    assert_eq!(map.points(), [Point3::new(0.5, 0.5, 0.5)]);
}

#[test]
fn a_cloud_of_another_frame_is_told_and_changes_nothing() {
    let mut map = map_of(1.0, &[cloud(&[[0.5, 0.5, 0.5]])]);
    let other = Cloud { frame_id: "odom".to_owned(), ..cloud(&[[5.0, 5.0, 5.0]]) };
    let message = map.add(&other).unwrap_err().to_string();
    assert!(message.contains("\"odom\"") && message.contains("\"map\""), "{message}");
    assert_eq!(map.len(), 1);
    map.clear();
    assert!(map.is_empty() && map.frame_id().is_none());
    map.add(&other).unwrap();
    assert_eq!(map.cloud().frame_id, "odom");
}

/// Regression: of a map that was emptied the whole map had no frame and the stamp 0, so that whoever shows it kept the former one.
#[test]
fn an_emptied_map_is_told_in_the_frame_and_at_the_time_of_the_former_one() {
    let mut map = map_of(1.0, &[Cloud { stamp: Stamp::from_nanos(9), ..cloud(&[[0.5; 3]]) }]);
    map.clear();
    let emptied = map.cloud();
    assert_eq!((emptied.frame_id.as_str(), emptied.stamp), ("map", Stamp::from_nanos(9)));
    assert!(emptied.points_m.is_empty());
}

#[test]
fn an_empty_cloud_changes_no_voxel() {
    let mut map = map_of(1.0, &[cloud(&[[0.5, 0.5, 0.5]])]);
    let empty = Cloud { stamp: Stamp::from_nanos(9), ..cloud(&[]) };
    assert_eq!(map.add(&empty).unwrap(), Addition::default());
    assert!(map.changed().is_empty());
    assert_eq!((map.len(), map.cloud().stamp), (1, Stamp::from_nanos(9)));
}

#[test]
fn the_memory_of_a_voxel_is_as_documented() {
    assert_eq!(size_of::<(VoxelKey, VoxelMean)>(), 80);
    let points: Vec<_> = (0..50_000).map(|x| [x as f32, 0.0, 0.0]).collect();
    let map = map_of(1.0, &[cloud(&points)]);
    let per_voxel = map.memory_bytes() as f64 / map.len() as f64;
    assert!((92.0..186.0).contains(&per_voxel), "{per_voxel} bytes a voxel");
}

#[test]
fn bad_parameters_are_named() {
    for (voxel_edge_m, max_voxels, name) in
        [(0.0, 1, "voxel_edge_m"), (f64::NAN, 1, "voxel_edge_m"), (0.08, 0, "max_voxels")]
    {
        let config = config_of(voxel_edge_m, max_voxels);
        assert!(StaticMap::new(config).unwrap_err().to_string().contains(name));
    }
    for at_max_voxels in [AtMaxVoxels::DropOldest, AtMaxVoxels::Spill] {
        let config = ReconstructionConfig { at_max_voxels, ..config_of(0.08, 1) };
        let error = StaticMap::new(config).unwrap_err().to_string();
        assert!(error.contains("at_max_voxels must be refuse with the method rec_hv"), "{error}");
    }
}

fn clouds() -> impl Strategy<Value = Vec<Cloud>> {
    let points = prop::collection::vec(prop::array::uniform3(-0.5f32..0.5), 0..60);
    prop::collection::vec(points.prop_map(|points| cloud(&points)), 0..8)
}

proptest! {
    #[test]
    fn the_map_is_the_voxel_grid_of_the_concatenation(clouds in clouds()) {
        let edge_m = 0.08;
        let concatenation: Vec<_> = clouds.iter().flat_map(|cloud| cloud.points_m.clone()).collect();
        let map = map_of(edge_m, &clouds);
        check_points(&map.points(), &reduced_plainly(edge_m, &concatenation));
        check_points(&map.points(), &VoxelGrid::new(edge_m).unwrap().reduce(&concatenation));
    }

    #[test]
    fn the_order_of_the_cycles_changes_no_bit(
        (clouds, shuffled) in clouds()
            .prop_flat_map(|clouds| (Just(clouds.clone()), Just(clouds).prop_shuffle())),
    ) {
        prop_assert_eq!(map_of(0.08, &clouds).points(), map_of(0.08, &shuffled).points());
    }

    #[test]
    fn changed_holds_each_touched_voxel_once(clouds in clouds()) {
        let mut map = map(0.08, 50);
        let grid = VoxelGrid::new(0.08).unwrap();
        for cloud in &clouds {
            let before = map.len();
            let addition = map.add(cloud).unwrap();
            let mut changed = map.changed().to_vec();
            changed.sort_unstable();
            let mut touched: Vec<VoxelKey> = cloud.points_m.iter().map(|point| grid.key(point)).collect();
            touched.sort_unstable();
            touched.dedup();
            touched.retain(|key| map.voxel(*key).is_some());
            prop_assert_eq!(changed, touched);
            prop_assert_eq!(map.len(), before + addition.new_voxels);
            prop_assert!(map.len() <= 50);
            prop_assert_eq!(addition.added_points + addition.refused_points, cloud.points_m.len());
        }
    }
}
