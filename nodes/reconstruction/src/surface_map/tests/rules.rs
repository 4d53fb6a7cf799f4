//! What listeners are told, bounds, corrections, and input that is none.

use std::collections::BTreeMap;

use geometry::{MapPath, PathVertex, Stamp, VoxelKey};

use super::scene::sized_cycle;
use super::*;
use crate::{AtMaxVoxels, MapError};

/// Applies what a listener is told until nothing waits.
/// Returns how many points have gone.
pub(super) fn listen(map: &mut Map, known: &mut BTreeMap<VoxelKey, Point3<f32>>) -> usize {
    let mut gone = 0;
    loop {
        let changes = map.take_changes(200);
        assert!(!changes.is_incomplete, "it is told of");
        gone += changes.removed.points_m.len();
        if changes.updated.points_m.is_empty() && changes.removed.points_m.is_empty() {
            return gone;
        }
        let grid = *map.grid();
        for point in &changes.removed.points_m {
            known.remove(&grid.key(point));
        }
        known.extend(changes.updated.points_m.iter().map(|point| (grid.key(point), *point)));
    }
}

#[test]
fn a_listener_that_starts_late_ends_with_the_points_of_the_map() {
    let rig = rig_at(0.0, 0.0);
    let mut random = Random::new(2);
    let mut map = map(0.04);
    let person = Scene::room().with_person(0.2);
    map.integrate(&cycle(&person, 0, &rig, Some(&mut random))).unwrap();
    map.follow_changes();
    map.integrate(&cycle(&person, 1, &rig, Some(&mut random))).unwrap();
    let start = map.cloud_for_listeners().unwrap().cloud;
    let grid = *map.grid();
    let mut known: BTreeMap<_, _> =
        start.points_m.iter().map(|point| (grid.key(point), *point)).collect();
    assert_eq!(known.len(), start.points_m.len(), "one point a voxel");
    for index in 2..30 {
        map.integrate(&cycle(&Scene::room(), index, &rig, Some(&mut random))).unwrap();
        listen(&mut map, &mut known);
    }
    let now: BTreeMap<_, _> =
        map.points().into_iter().map(|point| (grid.key(&point), point)).collect();
    assert!(known.keys().eq(now.keys()), "{} and {} voxels", known.len(), now.len());
    let tolerance_m = (crate::LISTENER_TOLERANCE_IN_EDGES * 0.04) as f32;
    assert!(known.iter().all(|(key, point)| (point - now[key]).norm() <= tolerance_m));
}

#[test]
fn a_correction_moves_the_map_and_late_cycles() {
    let rig = rig_at(0.0, 0.0);
    let path = |shift_m: f64| {
        let vertex = |seconds: f64| PathVertex {
            stamp: Stamp::from_nanos(1).plus_seconds(seconds),
            map_from_rig: rig_at(shift_m, 0.0),
        };
        MapPath::new(vertex(1.0).stamp, "map", vec![vertex(0.0), vertex(1.0)]).unwrap()
    };
    let mut map = map(0.04);
    map.follow_path(&path(0.0)).unwrap();
    for index in 0..3 {
        map.integrate(&cycle(&Scene::room(), index, &rig, None)).unwrap();
    }
    let done = map.follow_path(&path(0.5)).unwrap();
    assert!(done.moved_voxels > 500 && (done.shift_m - 0.5).abs() < 1e-6, "{done:?}");
    // Measured before the correction, received after it.
    map.integrate(&cycle(&Scene::room(), 3, &rig, None)).unwrap();
    assert_eq!(map.correction_counts().late_cycles, 1);
    let in_room = |point: &Point3<f64>| Scene::room().nearest(&(point - 0.5 * Vector3::x())).0;
    let stray = points(&map).iter().filter(|(point, _)| in_room(point) > 0.02).count();
    assert_eq!(stray, 0, "of {} points", map.points().len());
    let elsewhere = MapPath::new(
        Stamp::from_nanos(9),
        "odom",
        vec![PathVertex { stamp: Stamp::from_nanos(1), map_from_rig: rig }],
    );
    assert!(map.follow_path(&elsewhere.unwrap()).is_err());
}

#[test]
fn old_blocks_make_room_where_that_is_asked_for() {
    for at_max_voxels in [AtMaxVoxels::Refuse, AtMaxVoxels::DropOldest] {
        let config = ReconstructionConfig { max_map_blocks: 60, at_max_voxels, ..config(0.05) };
        let mut map = Map::new(config, None).unwrap();
        map.follow_changes();
        let mut known = BTreeMap::new();
        let (mut refused, mut dropped) = (0, 0);
        for index in 0..10 {
            let rig = rig_at(0.0, 0.15 * f64::from(index));
            let done = map.integrate(&cycle(&Scene::room(), index, &rig, None)).unwrap();
            (refused, dropped) = (refused + done.refused_points, dropped + done.dropped_voxels);
            let (what, filled, most) = map.fill();
            assert!(what == "map blocks" && filled <= most && most == 60);
            listen(&mut map, &mut known);
        }
        assert!(refused > 0);
        assert_eq!(dropped > 0, at_max_voxels == AtMaxVoxels::DropOldest);
        assert_eq!(known.len(), map.points().len());
    }
}

#[test]
fn what_does_not_fit_is_refused_and_changes_nothing() {
    let rig = rig_at(0.0, 0.0);
    let mut map = map(0.05);
    map.integrate(&cycle(&Scene::room(), 0, &rig, None)).unwrap();
    let before = map.points();
    let mut refused = |change: &dyn Fn(&mut SegmentedCycle)| {
        let mut cycle = cycle(&Scene::room(), 1, &rig, None);
        change(&mut cycle);
        map.integrate(&cycle).unwrap_err()
    };
    let none = refused(&|cycle| cycle.depth = None);
    assert_eq!(none, MapError::NoDepthImage);
    let elsewhere = refused(&|cycle| cycle.static_cloud.frame_id = "odom".to_owned());
    assert!(matches!(elsewhere, MapError::AnotherFrame { .. }));
    let nowhere = refused(&|cycle| cycle.map_from_rig.translation.x = f64::NAN);
    assert!(matches!(nowhere, MapError::View(_)), "{nowhere}");
    assert_eq!(map.points(), before);
}

#[test]
fn an_image_of_another_size_a_pose_that_jumps_and_one_without_a_depth_are_taken() {
    let mut map = map(0.05);
    for (index, size_px) in (0..).zip([(320, 240), (64, 48), (1, 1), (333, 17), (320, 240)]) {
        let rig = rig_at(if index % 2 == 0 { 0.0 } else { 90.0 }, 1.1 * f64::from(index));
        map.integrate(&sized_cycle(&Scene::room(), index, &rig, None, size_px)).unwrap();
    }
    let before = map.points();
    map.integrate(&scene::blind_cycle(9)).unwrap();
    assert!(!before.is_empty());
}

#[test]
fn edges_that_are_of_no_use_are_refused_and_extreme_ones_have_a_bounded_cost() {
    for edge_m in [0.0009, 1.1] {
        let error = Map::new(config(edge_m), None).unwrap_err().to_string();
        assert!(error.contains("map_edge_m") && error.contains(&edge_m.to_string()), "{error}");
    }
    for edge_m in [0.001, 1.0] {
        let config = ReconstructionConfig { max_map_blocks: 500, ..config(edge_m) };
        let mut map = Map::new(config, None).unwrap();
        let view = sized_cycle(&Scene::room(), 0, &rig_at(0.0, 0.0), None, (32, 24));
        let addition = map.integrate(&view).unwrap();
        assert!(map.fill().1 <= 500);
        assert_eq!(addition.is_view_cut, edge_m < 1.0, "what is left out is reported");
    }
}
