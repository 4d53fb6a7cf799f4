mod room;
mod scenes;

use std::collections::BTreeSet;

use geometry::{Cloud, Method, PipelineConfig, Stamp};
use nalgebra::{Isometry3, Translation3};
use proptest::prelude::*;

use super::super::testing::{self, camera_at};
use super::*;
use crate::{AtMaxVoxels, ReconstructionConfig};

fn map_with(max_voxels: usize, at_max_voxels: AtMaxVoxels) -> StaticMap {
    let config = ReconstructionConfig {
        pipeline: PipelineConfig::new(Method::FreeSpace, 1.0),
        max_voxels,
        at_max_voxels,
        ..ReconstructionConfig::default()
    };
    StaticMap::new(config).unwrap()
}

fn map() -> StaticMap {
    map_with(1_000_000, AtMaxVoxels::Refuse)
}

/// A cycle of a rig at the origin of the map.
fn cycle(still: &[[f32; 3]], moving: &[[f32; 3]]) -> SegmentedCycle {
    SegmentedCycle {
        setup: camera_at(Point3::new(0.5, 0.5, 0.5)),
        ..testing::cycle(Stamp::from_nanos(1), still, moving)
    }
}

/// On the camera's axis.
fn at(x: f32) -> [f32; 3] {
    [x, 0.5, 0.5]
}

/// Sees `hits` times a point at `x`, and then what is `behind`; returns after how many cycles it is gone.
fn passes_until_gone(hits: usize, behind: &SegmentedCycle) -> Option<usize> {
    let mut map = map();
    for _ in 0..hits {
        map.integrate(&cycle(&[at(5.5)], &[])).unwrap();
    }
    (1..=20).find(|_| map.integrate(behind).unwrap().cleared_voxels == 1)
}

#[test]
fn what_is_seen_through_goes_after_three_to_nine_cycles() {
    for (hits, passes) in [(1, 3), (2, 5), (3, 7), (4, 9), (100, 9)] {
        assert_eq!(passes_until_gone(hits, &cycle(&[at(9.5)], &[])), Some(passes));
        // Whatever is behind, by however many rays.
        assert_eq!(passes_until_gone(hits, &cycle(&[], &[at(9.5); 7])), Some(passes));
    }
}

#[test]
fn what_is_no_proof_of_free_space_clears_nothing() {
    for (name, behind) in [
        ("nothing", cycle(&[], &[])),
        ("what ends before it", cycle(&[at(4.5)], &[])),
        ("what ends in it", cycle(&[], &[at(5.9)])),
        ("what ends within one and a half voxels behind it", cycle(&[at(6.9)], &[])),
        ("what passes it but not its mean", cycle(&[[9.5, 1.9, 0.5], at(4.5)], &[])),
        ("a ray beside a return in its voxel", cycle(&[at(9.5)], &[[5.1, 0.9, 0.9]])),
        ("a ray that grazes a return beside it", cycle(&[at(9.5), [6.5, 1.2, 0.5]], &[])),
    ] {
        assert_eq!(passes_until_gone(1, &behind), None, "{name}");
    }
    // A return beside the voxel, but far beside the ray, is another thing.
    let behind = cycle(&[at(9.5), [6.5, 1.8, 0.5]], &[]);
    assert_eq!(passes_until_gone(1, &behind), Some(3));
}

#[test]
fn rays_start_where_the_camera_was() {
    let mut map = map();
    map.integrate(&cycle(&[at(5.5)], &[])).unwrap();
    let mut moved = cycle(&[[9.5, 0.5, 0.5]], &[[4.0, 0.0, 0.0]]);
    moved.map_from_rig = Isometry3::from_parts(Translation3::new(5.0, -4.0, 0.0), nalgebra::one());
    let gone = (0..9).any(|_| map.integrate(&moved).unwrap().cleared_voxels > 0);
    assert!(!gone, "none of its rays passes the voxel");
    // The dynamic point in the rig frame is at (5.5, 5.5, 0.5) in the map.
    moved.dynamic_cloud.points_m = vec![Point3::new(0.5, 9.5, 0.5)];
    assert!((0..3).any(|_| map.integrate(&moved).unwrap().cleared_voxels == 1));
}

#[test]
fn a_voxel_that_comes_back_starts_anew() {
    let mut map = map();
    map.integrate(&cycle(&[[5.2, 0.5, 0.5]], &[])).unwrap();
    while map.integrate(&cycle(&[at(9.5)], &[])).unwrap().cleared_voxels == 0 {}
    map.integrate(&cycle(&[[5.8, 0.5, 0.5]], &[])).unwrap();
    let key = VoxelKey { x: 5, y: 0, z: 0 };
    assert_eq!(map.voxel(key), Some((Point3::new(5.8, 0.5, 0.5), 1)));
}

#[test]
fn what_has_no_measure_does_no_harm() {
    let huge = [f32::MAX, f32::MIN, f32::MAX];
    let mut map = map();
    let mut bad = cycle(&[at(5.5), huge, [f32::NAN; 3]], &[huge, [f32::INFINITY; 3]]);
    let addition = map.integrate(&bad).unwrap();
    assert_eq!((addition.added_points, addition.not_finite_points), (2, 1));
    bad.setup = camera_at(Point3::new(f64::NAN, 0.0, 0.0));
    map.integrate(&bad).unwrap();
    bad.setup = camera_at(Point3::new(1e300, 0.0, 0.0));
    map.integrate(&bad).unwrap();
    assert_eq!(map.len(), 2);
}

#[test]
fn a_full_map_drops_what_was_seen_longest_ago() {
    let mut map = map_with(3, AtMaxVoxels::DropOldest);
    // Not on each other's rays.
    let place = |number: u8| [5.5, 10.0 * f32::from(number), 0.5];
    let key = |number: u8| VoxelKey { x: 5, y: 10 * i32::from(number), z: 0 };
    map.follow_changes();
    for numbers in [[1, 2, 3], [1, 1, 1]] {
        map.integrate(&cycle(&numbers.map(place), &[])).unwrap();
    }
    let addition = map.integrate(&cycle(&[place(4)], &[])).unwrap();
    assert_eq!((addition.dropped_voxels, addition.refused_points, map.len()), (1, 0, 3));
    assert!(map.voxel(key(2)).is_none() && map.voxel(key(1)).is_some());
    let changes = map.take_changes(10);
    assert_eq!(changes.removed.points_m, [Point3::from(place(2))]);
    // What was seen in this cycle makes no room.
    let addition = map.integrate(&cycle(&[5, 6, 7, 8].map(place), &[])).unwrap();
    assert_eq!((addition.dropped_voxels, addition.refused_points, map.len()), (3, 1, 3));
    assert!(map.voxel(key(8)).is_none());
}

#[test]
fn rec_hv_hangs_on_the_static_cloud_alone() {
    let pipeline = PipelineConfig { method: Method::RecHv, ..PipelineConfig::default() };
    let config = ReconstructionConfig { pipeline, ..ReconstructionConfig::default() };
    let mut maps = [(); 2].map(|()| StaticMap::new(config.clone()).unwrap());
    for x in [0.5_f32, 3.5, 9.5, 9.5, 9.5, 9.5, 9.5] {
        let cycle = cycle(&[at(x)], &[at(12.0)]);
        let [by_cycle, by_cloud] = &mut maps;
        let addition = by_cycle.integrate(&cycle).unwrap();
        assert_eq!(addition, by_cloud.add(&cycle.static_cloud).unwrap());
    }
    assert_eq!(maps[0].points(), maps[1].points());
    assert_eq!(maps[0].len(), 3);
}

/// The voxels that the cycle's rays pass, as the module's first page says it, of a map with these voxels.
fn passed_plainly(map: &StaticMap, cycle: &SegmentedCycle) -> BTreeSet<VoxelKey> {
    let grid = map.grid;
    let camera = cycle.setup.mounts.camera_in_rig_m();
    let returns: Vec<_> =
        cycle.static_cloud.points_m.iter().chain(&cycle.dynamic_cloud.points_m).copied().collect();
    let aside = |end: &Point3<f32>, point: &Point3<f32>| {
        let (way, to) = (end.cast::<f64>() - camera, point.cast::<f64>() - camera);
        let along = to.dot(&way) / way.norm();
        (along, (to.norm_squared() - along * along).max(0.0).sqrt())
    };
    let is_passed = |end: &Point3<f32>, key: VoxelKey| {
        let length = (end.cast::<f64>() - camera).norm();
        let is_crossed = VoxelRay::between(&camera, &end.cast())
            .unwrap()
            .cells(&grid, length - 1.5)
            .any(|cell| cell == key);
        let (along, beside) = aside(end, &map.voxel(key).unwrap().0);
        let contradicts = |seen: &Point3<f32>| {
            let cell = grid.key(seen);
            let steps = [cell.x - key.x, cell.y - key.y, cell.z - key.z].map(i32::abs);
            let (along, beside) = aside(end, seen);
            cell == key
                || (steps.iter().all(|step| *step <= 1) && along < length - 0.5 && beside <= 1.0)
        };
        is_crossed
            && (0.0..=length - 1.5).contains(&along)
            && beside <= 0.75 * along / length
            && !returns.iter().any(contradicts)
    };
    let keys = map.voxels.keys().copied();
    keys.filter(|key| returns.iter().any(|end| is_passed(end, *key))).collect()
}

fn points(most: usize) -> impl Strategy<Value = Vec<[f32; 3]>> {
    let coordinate = || -7.0..7.0_f32;
    prop::collection::vec(
        (coordinate(), -3.0..3.0_f32, coordinate()).prop_map(<[f32; 3]>::from),
        0..most,
    )
}

proptest! {
    #[test]
    fn what_is_passed_is_what_the_definition_says(
        old in points(150), still in points(12), moving in points(4),
    ) {
        let [mut map, mut added] = [(); 2].map(|()| map());
        let cycle_of_old = cycle(&old, &[]);
        let cycle = cycle(&still, &moving);
        for map in [&mut map, &mut added] {
            map.add(&cycle_of_old.static_cloud).unwrap();
        }
        map.integrate(&cycle).unwrap();
        // Who is one miss down; those that the cycle hit are neither.
        let hit: BTreeSet<_> = map.changed().iter().copied().collect();
        added.add(&cycle.static_cloud).unwrap();
        let mut got = BTreeSet::new();
        for (key, voxel) in &map.voxels {
            let mut missed = added.voxels[key].evidence;
            missed.miss();
            if voxel.evidence == missed {
                got.insert(*key);
            }
        }
        prop_assert!(got.is_disjoint(&hit));
        prop_assert_eq!(got, passed_plainly(&added, &cycle));
    }

    #[test]
    fn the_order_of_the_points_changes_no_bit(
        cycles in prop::collection::vec((points(20), points(4)), 1..12),
        at_max_voxels in prop_oneof![Just(AtMaxVoxels::Refuse), Just(AtMaxVoxels::DropOldest)],
    ) {
        let mut maps = [(); 2].map(|()| map_with(40, at_max_voxels));
        for map in &mut maps {
            map.follow_changes();
        }
        let [one, other] = &mut maps;
        for (mut still, mut moving) in cycles {
            let addition = one.integrate(&cycle(&still, &moving)).unwrap();
            still.reverse();
            moving.reverse();
            prop_assert_eq!(addition, other.integrate(&cycle(&still, &moving)).unwrap());
            prop_assert_eq!(one.points(), other.points());
            prop_assert_eq!(one.take_changes(9), other.take_changes(9));
            prop_assert!(one.len() <= 40);
        }
    }
}
