mod building;

use geometry::{Cloud, MapPath, Method, PathVertex, PipelineConfig, Stamp, pose_from_vector};
use nalgebra::{Isometry3, Point3};
use proptest::prelude::*;

use super::super::testing;
use super::*;
use crate::ReconstructionConfig;

fn at(seconds: f64) -> Stamp {
    Stamp::from_secs_nanos(1_700_000_000, 0).plus_seconds(seconds)
}

fn path(since_s: f64, vertices: &[(f64, Isometry3<f64>)]) -> MapPath {
    let vertices = vertices
        .iter()
        .map(|(seconds, pose)| PathVertex { stamp: at(*seconds), map_from_rig: *pose });
    MapPath::new(at(since_s), "map", vertices.collect()).unwrap()
}

/// A platform that stands at the origin, and has been put elsewhere since.
fn moved_by(since_s: f64, map_from_rig: Isometry3<f64>) -> MapPath {
    path(since_s, &[(0.0, map_from_rig)])
}

fn along(x_m: f64) -> Isometry3<f64> {
    pose_from_vector(&[x_m, 0.0, 0.0, 0.0, 0.0, 0.0])
}

fn cloud(seconds: f64, points: &[[f32; 3]]) -> Cloud {
    testing::cloud(at(seconds), "map", points)
}

fn empty_map() -> StaticMap {
    let config = ReconstructionConfig {
        pipeline: PipelineConfig::new(Method::RecHv, 1.0),
        max_voxels: 1000,
        ..ReconstructionConfig::default()
    };
    StaticMap::new(config).unwrap()
}

fn points_of(map: &StaticMap) -> u32 {
    let keys: Vec<_> = map.points().iter().map(|point| map.grid().key(point)).collect();
    keys.into_iter().map(|key| map.voxel(key).unwrap().1).sum()
}

#[track_caller]
fn check_points(map: &StaticMap, expected: &[[f32; 3]]) {
    let points = map.points();
    assert_eq!(points.len(), expected.len(), "{points:?}");
    for (point, expected) in points.iter().zip(expected) {
        assert!((point - Point3::from(*expected)).norm() < 1e-5, "{points:?}");
    }
}

#[test]
fn what_was_seen_moves_with_its_part_of_the_way() {
    let mut map = empty_map();
    let vertices = |end_m: f64| [(0.0, along(0.0)), (1.0, along(0.0)), (2.0, along(end_m))];
    assert_eq!(map.follow_path(&path(2.0, &vertices(0.0))), Ok(MapCorrection::default()));
    for (seconds, y) in [(0.5, 0.5), (1.5, 2.5), (2.0, 4.5), (2.5, 6.5)] {
        map.add(&cloud(seconds, &[[0.25, y, 0.5]])).unwrap();
    }
    let done = map.follow_path(&path(3.0, &vertices(2.0))).unwrap();
    assert_eq!((done.moved_voxels, done.merged_voxels), (3, 0));
    assert!((done.shift_m - 2.0).abs() < 1e-9);
    check_points(&map, &[[0.25, 0.5, 0.5], [1.25, 2.5, 0.5], [2.25, 4.5, 0.5], [2.25, 6.5, 0.5]]);
    // What comes later stands where it is told.
    map.add(&cloud(3.0, &[[0.25, 8.5, 0.5]])).unwrap();
    assert_eq!(map.follow_path(&path(3.5, &vertices(2.0))), Ok(MapCorrection::default()));
    assert!(map.voxel(map.grid().key(&Point3::new(0.25, 8.5, 0.5))).is_some());
    let counts = CorrectionCounts { corrections: 1, largest_shift_m: done.shift_m, late_cycles: 0 };
    assert_eq!(map.correction_counts(), counts);
}

#[test]
fn two_voxels_that_come_to_one_place_are_one_with_all_their_points() {
    let mut map = empty_map();
    map.follow_path(&path(2.0, &[(0.0, along(0.0)), (2.0, along(0.0))])).unwrap();
    map.add(&cloud(0.0, &[[0.25, 0.5, 0.5]; 3])).unwrap();
    map.add(&cloud(2.0, &[[5.75, 0.5, 0.5]])).unwrap();
    let done = map.follow_path(&path(3.0, &[(0.0, along(0.0)), (2.0, along(-5.0))])).unwrap();
    assert_eq!((done.moved_voxels, done.merged_voxels), (1, 1));
    let key = geometry::VoxelKey { x: 0, y: 0, z: 0 };
    assert_eq!(map.voxel(key), Some((Point3::new(0.375, 0.5, 0.5), 4)));
    assert_eq!(map.len(), 1);
}

/// An earlier voxel that came into a later one took it out of what the later part of the way moves.
#[test]
fn a_voxel_that_an_earlier_one_came_into_still_moves_with_its_own_moment() {
    let vertices = |early_m: f64, late_m: f64| [(0.0, along(early_m)), (2.0, along(late_m))];
    for late_m in [0.0, 0.3] {
        let mut map = empty_map();
        map.follow_path(&path(2.0, &vertices(0.0, 0.0))).unwrap();
        map.add(&cloud(0.0, &[[0.75, 0.5, 0.5]])).unwrap();
        map.add(&cloud(2.0, &[[1.25, 0.5, 0.5]; 3])).unwrap();
        let done = map.follow_path(&path(3.0, &vertices(0.5, late_m))).unwrap();
        assert_eq!(done.merged_voxels, 1);
        map.follow_path(&path(4.0, &vertices(0.5, late_m + 2.0))).unwrap();
        let mean_m = 1.25 + 0.75 * late_m + 2.0;
        check_points(&map, &[[mean_m as f32, 0.5, 0.5]]);
    }
}

#[test]
fn a_little_is_not_forgotten_until_it_has_become_enough() {
    let mut map = empty_map();
    map.follow_path(&moved_by(0.0, along(0.0))).unwrap();
    map.add(&cloud(0.0, &[[0.5, 0.5, 0.5]])).unwrap();
    for off_m in [0.1, 0.2] {
        let done = map.follow_path(&moved_by(1.0, along(off_m))).unwrap();
        assert_eq!(done, MapCorrection::default());
        check_points(&map, &[[0.5, 0.5, 0.5]]);
    }
    assert_eq!(map.follow_path(&moved_by(1.0, along(0.3))).unwrap().moved_voxels, 1);
    check_points(&map, &[[0.8, 0.5, 0.5]]);
    assert_eq!(map.follow_path(&moved_by(1.0, along(0.3))).unwrap().moved_voxels, 0);
}

#[test]
fn a_cycle_that_was_on_its_way_is_brought_over() {
    let mut map = empty_map();
    map.follow_path(&moved_by(0.0, along(0.0))).unwrap();
    map.add(&cloud(0.0, &[[0.5, 0.5, 0.5]])).unwrap();
    map.follow_path(&moved_by(2.0, along(3.0))).unwrap();
    // Measured before the correction, and told in the map of before.
    map.add(&cloud(1.9, &[[0.5, 0.5, 0.5]])).unwrap();
    check_points(&map, &[[3.5, 0.5, 0.5]]);
    assert_eq!(map.correction_counts().late_cycles, 1);
    map.add(&cloud(2.0, &[[3.5, 0.5, 0.5]])).unwrap();
    map.add(&cloud(1.95, &[[0.5, 0.5, 0.5]])).unwrap();
    check_points(&map, &[[3.5, 0.5, 0.5]]);
    assert_eq!(points_of(&map), 4);
}

/// Of a cycle that was told in the corrected map, and came before the path that says so.
#[test]
fn a_cycle_that_was_faster_than_its_path_stays() {
    let mut map = empty_map();
    map.follow_path(&moved_by(0.0, along(0.0))).unwrap();
    map.add(&cloud(0.0, &[[0.5, 0.5, 0.5]])).unwrap();
    map.add(&cloud(2.0, &[[3.5, 2.5, 0.5]])).unwrap();
    map.follow_path(&moved_by(2.0, along(3.0))).unwrap();
    check_points(&map, &[[3.5, 0.5, 0.5], [3.5, 2.5, 0.5]]);
}

#[test]
fn a_loaded_map_stays() {
    let mut map = empty_map();
    map.replace(&[Point3::new(0.5, 0.5, 0.5)], "map").unwrap();
    map.follow_path(&moved_by(0.0, along(0.0))).unwrap();
    map.add(&cloud(0.0, &[[0.5, 2.5, 0.5], [0.5, 0.5, 0.5]])).unwrap();
    assert_eq!(map.follow_path(&moved_by(1.0, along(3.0))).unwrap().moved_voxels, 1);
    check_points(&map, &[[0.5, 0.5, 0.5], [3.5, 2.5, 0.5]]);
}

#[test]
fn a_path_that_begins_anew_moves_nothing() {
    let mut map = empty_map();
    map.follow_path(&moved_by(0.0, along(0.0))).unwrap();
    map.add(&cloud(0.0, &[[0.5, 0.5, 0.5]])).unwrap();
    assert_eq!(map.follow_path(&path(9.0, &[(9.0, along(7.0))])), Ok(MapCorrection::default()));
    check_points(&map, &[[0.5, 0.5, 0.5]]);
    // In another frame it is none of the map's.
    let other = MapPath::new(at(9.0), "odom", Vec::new()).unwrap();
    let error = map.follow_path(&other).unwrap_err().to_string();
    assert!(error.contains("\"odom\"") && error.contains("\"map\""), "{error}");
}

#[test]
fn a_stamp_of_another_clock_does_not_move_what_comes_later() {
    let mut map = empty_map();
    map.follow_path(&moved_by(0.0, along(0.0))).unwrap();
    map.add(&cloud(0.0, &[[0.5, 0.5, 0.5]])).unwrap();
    map.follow_path(&moved_by(1e6, along(3.0))).unwrap();
    map.add(&cloud(1.0, &[[3.5, 2.5, 0.5]])).unwrap();
    check_points(&map, &[[3.5, 0.5, 0.5], [3.5, 2.5, 0.5]]);
}

#[test]
fn who_follows_the_changes_gets_the_whole_map() {
    let mut map = empty_map();
    map.follow_path(&moved_by(0.0, along(0.0))).unwrap();
    map.follow_changes();
    map.add(&cloud(0.0, &[[0.5, 0.5, 0.5]])).unwrap();
    assert!(!map.take_changes(9).is_incomplete);
    map.follow_path(&moved_by(1.0, along(3.0))).unwrap();
    assert!(map.take_changes(9).is_incomplete);
    assert!(map.changed().is_empty());
    assert_eq!(map.cloud_for_listeners().points_m, [Point3::new(3.5, 0.5, 0.5)]);
    map.add(&cloud(2.0, &[[3.5, 0.5, 0.5]])).unwrap();
    assert!(!map.take_changes(9).is_incomplete);
}

fn clouds() -> impl Strategy<Value = Vec<Cloud>> {
    let points = prop::collection::vec(prop::array::uniform3(-8.0..8.0_f32), 0..60);
    prop::collection::vec(points, 1..8).prop_map(|clouds| {
        let stamped = clouds.iter().enumerate();
        stamped.map(|(index, points)| cloud(index as f64, points)).collect()
    })
}

fn poses() -> impl Strategy<Value = Vec<(f64, Isometry3<f64>)>> {
    let pose = prop::array::uniform6(-2.0..2.0_f64);
    prop::collection::vec(pose, 8).prop_map(|poses| {
        let stamped = poses.iter().enumerate();
        stamped.map(|(index, pose)| (index as f64, pose_from_vector(pose))).collect()
    })
}

/// With the trajectory as it was first, and then as it is in the end.
fn built(map: &mut StaticMap, clouds: &[Cloud], paths: &[&MapPath]) {
    let [first, others @ ..] = paths else { return };
    map.follow_path(first).unwrap();
    for cloud in clouds {
        map.add(cloud).unwrap();
    }
    for path in others {
        map.follow_path(path).unwrap();
    }
}

proptest! {
    #[test]
    fn the_same_path_again_changes_no_bit(clouds in clouds(), poses in poses()) {
        let (mut map, mut twin) = (empty_map(), empty_map());
        let path = path(9.0, &poses);
        built(&mut map, &clouds, &[&path, &path, &path]);
        for cloud in &clouds {
            twin.add(cloud).unwrap();
        }
        prop_assert_eq!(map.points(), twin.points());
    }

    #[test]
    fn there_and_back_no_point_is_lost(clouds in clouds(), there in poses(), back in poses()) {
        let mut map = empty_map();
        let (there, back) = (path(9.0, &there), path(9.0, &back));
        built(&mut map, &clouds, &[&back]);
        let before = points_of(&map);
        for path in [&there, &back] {
            map.follow_path(path).unwrap();
            prop_assert_eq!(points_of(&map), before);
        }
    }

    #[test]
    fn each_mean_is_in_its_voxel_after_a_correction(clouds in clouds(), one in poses(), other in poses()) {
        let mut map = empty_map();
        built(&mut map, &clouds, &[&path(9.0, &one), &path(9.0, &other)]);
        for (key, voxel) in &map.voxels {
            prop_assert_eq!(map.grid().key(&voxel.mean()), *key);
        }
    }
}
