//! A map that is larger than its memory.

mod failing;

use std::collections::BTreeMap;

use geometry::{MapPath, PathVertex, Stamp, VoxelKey};
use proptest::prelude::*;

use super::rules::listen;
use super::scene::sized_cycle;
use super::*;
use crate::surface_map::SurfaceMap;
use crate::tiles::testing::MemoryStore;
use crate::tiles::{SpillCounts, TileKey};
use crate::{Addition, AtMaxVoxels, LoadError};

const EDGE_M: f64 = 0.05;
/// The corridor has some 1,400 blocks, and a view with what is beside it some 700.
pub(super) const MOST: usize = 800;
/// A view of the corridor that was corrected, or loaded whole, has some 900: blocks beside it, which no drive made.
const MORE: usize = 1_000;
const END_M: f64 = 20.0;
/// There, and as many back.
const STEPS: usize = 36;

fn spilling_config(max_map_blocks: usize) -> ReconstructionConfig {
    ReconstructionConfig {
        max_map_blocks,
        at_max_voxels: AtMaxVoxels::Spill,
        // Three blocks.
        spill_tile_edge_m: 1.2,
        ..config(EDGE_M)
    }
}

pub(super) fn spilling(max_map_blocks: usize) -> (Map, MemoryStore) {
    let store = MemoryStore::default();
    let map = Map::new(spilling_config(max_map_blocks), Some(Box::new(store.clone()))).unwrap();
    (map, store)
}

fn counts(map: &Map) -> SpillCounts {
    map.spill_counts().unwrap()
}

fn of_depth_images(map: &Map) -> &SurfaceMap {
    let Map::Surface(map) = map else { panic!("of means") };
    map
}

/// The bound holds, and a tile is in memory as a whole or not at all.
fn check(map: &Map) {
    let (_, filled, most) = map.fill();
    assert!(filled <= most, "{filled} of {most} blocks");
    let map = of_depth_images(map);
    let spill = map.spill.as_ref().unwrap();
    for tile in spill.tiles.in_store_by_key() {
        assert!(map.surface.blocks_in(spill.blocks_of(tile)).is_empty(), "{tile}");
    }
    for key in map.surface.block_keys() {
        assert!(spill.tiles.in_memory_by_key().contains(&spill.tile_of(key)), "{key:?}");
    }
}

/// Along the corridor to its end, and back.
pub(super) fn drive() -> Vec<SegmentedCycle> {
    let scene = Scene::corridor(END_M);
    let mut random = Random::new(4);
    let x_m = |step: usize| 0.5 * step as f64;
    let there = (0..STEPS).map(|step| (x_m(step), 0.0));
    let back = (0..STEPS).rev().map(|step| (x_m(step), 3.1));
    (0..)
        .zip(there.chain(back))
        .map(|(index, (x_m, yaw_rad))| {
            let rig = rig_at(x_m, yaw_rad);
            sized_cycle(&scene, index, &rig, Some(&mut random), (160, 120))
        })
        .collect()
}

fn driven(mut map: Map, cycles: &[SegmentedCycle]) -> Map {
    for cycle in cycles {
        map.integrate(cycle).unwrap();
    }
    map
}

fn known_of(map: &Map) -> BTreeMap<VoxelKey, Point3<f32>> {
    let grid = *map.grid();
    map.points().into_iter().map(|point| (grid.key(&point), point)).collect()
}

fn assert_is_known(known: &BTreeMap<VoxelKey, Point3<f32>>, map: &Map) {
    let now = known_of(map);
    assert!(known.keys().eq(now.keys()), "{} and {} voxels", known.len(), now.len());
    let tolerance_m = (crate::LISTENER_TOLERANCE_IN_EDGES * EDGE_M) as f32;
    assert!(known.iter().all(|(key, point)| (point - now[key]).norm() <= tolerance_m));
}

#[test]
fn a_map_driven_along_a_corridor_and_back_is_that_of_unbounded_memory() {
    let ((mut map, _store), mut twin) = (spilling(MOST), super::map(EDGE_M));
    for cycle in &drive() {
        let (done, expected) = (map.integrate(cycle).unwrap(), twin.integrate(cycle).unwrap());
        assert_eq!(done, expected);
        check(&map);
        assert_eq!(map.len(), twin.len());
    }
    let (whole, expected) = (map.whole(), twin.whole());
    println!("{:?}, {} of {} blocks", counts(&map), map.fill().1, twin.fill().1);
    assert!(whole == expected && whole.points.points_m.len() > 10_000);
    // The triangles come tile by tile, and are the same ones.
    let (mesh, expected) = (map.mesh().unwrap(), twin.mesh().unwrap());
    assert!(mesh.triangles.len() > 20_000 && mesh.edges() == expected.edges());
    assert_eq!((mesh.points_m.len(), mesh.edges().wrong), (expected.points_m.len(), 0));
    let counts = counts(&map);
    assert!(counts.tiles_in_store > 20 && counts.read > 20, "{counts:?}");
    assert_eq!((counts.lost, counts.failed, map.take_tile_error()), (0, 0, None));
    assert!(map.fill().2 == MOST && twin.fill().1 > MOST, "it is larger than the memory");
    map.clear();
    assert!(map.is_empty());
}

#[test]
fn listeners_are_told_of_the_same_map_and_of_no_tile_that_is_spilled() {
    let ((mut map, _store), mut twin) = (spilling(MOST), super::map(EDGE_M));
    let (mut known, mut expected) = (BTreeMap::new(), BTreeMap::new());
    map.follow_changes();
    twin.follow_changes();
    for cycle in &drive() {
        map.integrate(cycle).unwrap();
        twin.integrate(cycle).unwrap();
        let gone = [listen(&mut map, &mut known), listen(&mut twin, &mut expected)];
        assert_eq!(gone[0], gone[1]);
        check(&map);
    }
    assert!(counts(&map).tiles_in_store > 20);
    assert!(known == expected);
    assert_is_known(&known, &map);
    // What they know is in the files, too.
    let follower_bytes =
        |map: &Map| of_depth_images(map).followers.changes.as_ref().unwrap().memory_bytes();
    assert!(follower_bytes(&map) < follower_bytes(&twin));
}

/// What was spilled before somebody followed the changes is known as it is, from the whole map; what is told slowly waits.
#[test]
fn a_listener_that_comes_when_tiles_are_spilled_ends_with_the_points_of_the_map() {
    let cycles = drive();
    let (there, back) = cycles.split_at(STEPS);
    let mut map = driven(spilling(MOST).0, there);
    assert!(counts(&map).tiles_in_store > 20);
    map.follow_changes();
    let start = map.cloud_for_listeners().unwrap().cloud;
    let grid = *map.grid();
    let mut known: BTreeMap<_, _> =
        start.points_m.iter().map(|point| (grid.key(point), *point)).collect();
    assert_is_known(&known, &map);
    for (index, cycle) in (0..).zip(back) {
        map.integrate(cycle).unwrap();
        if index == 10 {
            // Another one comes, while much waits.
            let cloud = map.cloud_for_listeners().unwrap().cloud;
            known = cloud.points_m.iter().map(|point| (grid.key(point), *point)).collect();
        }
        let changes = map.take_changes(500);
        assert!(!changes.is_incomplete);
        for point in &changes.removed.points_m {
            known.remove(&grid.key(point));
        }
        known.extend(changes.updated.points_m.iter().map(|point| (grid.key(point), *point)));
        check(&map);
    }
    assert!(of_depth_images(&map).waiting_changes() > 0);
    listen(&mut map, &mut known);
    check(&map);
    assert_is_known(&known, &map);
}

/// A view that needs more blocks than there may be.
#[test]
fn a_memory_too_small_for_a_view_keeps_its_bound_and_loses_nothing() {
    let (mut map, _store) = spilling(150);
    let mut refused = 0;
    for cycle in &drive() {
        refused += map.integrate(cycle).unwrap().refused_points;
        check(&map);
    }
    assert!(refused > 0 && map.fill().1 > 100);
    let counts = counts(&map);
    assert_eq!((counts.lost, counts.failed), (0, 0));
    assert!(counts.tiles_in_store > 20, "{counts:?}");
}

fn at(seconds: f64) -> Stamp {
    Stamp::from_nanos(1).plus_seconds(seconds)
}

/// What was seen up to 6 s has moved, by more the later it was seen.
fn path(shift_m: f64) -> MapPath {
    path_since(6.0, shift_m)
}

fn path_since(since_s: f64, shift_m: f64) -> MapPath {
    let vertex = |seconds: f64| PathVertex {
        stamp: at(seconds),
        map_from_rig: rig_at(shift_m * seconds, 0.01 * shift_m * seconds),
    };
    let vertices = (0..7).map(|second| vertex(f64::from(second))).collect();
    MapPath::new(at(since_s), "map", vertices).unwrap()
}

/// Blocks come in another order to where they meet, which their roundings tell: by some millionths of the truncation.
#[test]
fn a_correction_reaches_what_was_spilled() {
    let ((mut map, store), mut twin) = (spilling(MORE), super::map(EDGE_M));
    let cycles = drive();
    for map in [&mut map, &mut twin] {
        map.follow_path(&path(0.0)).unwrap();
        map.follow_changes();
    }
    let (mut map, mut twin) = (driven(map, &cycles), driven(twin, &cycles));
    let before: Vec<TileKey> = store.with(|tiles| tiles.keys().copied().collect());
    let (done, expected) =
        (map.follow_path(&path(0.2)).unwrap(), twin.follow_path(&path(0.2)).unwrap());
    assert!(done.moved_voxels > 10_000 && done.moved_voxels == expected.moved_voxels, "{done:?}");
    assert!(done.merged_voxels.abs_diff(expected.merged_voxels) < 50, "{done:?}, {expected:?}");
    assert!(map.take_changes(9).is_incomplete && twin.take_changes(9).is_incomplete);
    check(&map);
    assert!(!before.is_empty() && counts(&map).tiles_in_store > 20);
    // And goes on: tiles that were corrected come back.
    for cycle in &cycles {
        let mut cycle = cycle.clone();
        let stamp = cycle.static_cloud.stamp.plus_seconds(60.0);
        cycle.static_cloud.stamp = stamp;
        for map in [&mut map, &mut twin] {
            assert_eq!(map.integrate(&cycle).unwrap().refused_points, 0);
        }
        check(&map);
    }
    let (mut known, expected) = (known_of(&map), known_of(&twin));
    let all = expected.len();
    assert!(all > 10_000 && known.len().abs_diff(all) * 1000 < all, "{} of {all}", known.len());
    known.retain(|key, point| {
        expected.get(key).is_none_or(|other| (*point - other).norm() > 1e-3 * EDGE_M as f32)
    });
    assert!(known.len() * 1000 < all, "{} of {all} points differ", known.len());
    assert_eq!((counts(&map).lost, counts(&map).failed), (0, 0));
}

#[test]
fn a_loaded_map_may_be_larger_than_the_memory() {
    let whole = driven(super::map(EDGE_M), &drive()).whole();
    let mut expected = super::map(EDGE_M);
    let loaded = expected.replace(&whole.points.points_m, &whole.points.normals, "map").unwrap();
    let (mut map, store) = spilling(MORE);
    let done = map.replace(&whole.points.points_m, &whole.points.normals, "map").unwrap();
    assert_eq!(done, Addition { new_voxels: loaded.new_voxels, ..Addition::default() });
    check(&map);
    assert!(counts(&map).tiles_in_store > 20);
    assert!(map.whole() == expected.whole());
    assert_eq!(map.len(), expected.len());
    // A correction leaves it where it is.
    for map in [&mut map, &mut expected] {
        map.follow_path(&path(0.0)).unwrap();
        assert_eq!(map.follow_path(&path(0.2)).unwrap().moved_voxels, 0);
    }
    assert!(map.whole() == expected.whole());
    for cycle in &drive() {
        assert_eq!(map.integrate(cycle).unwrap(), expected.integrate(cycle).unwrap());
        check(&map);
    }
    assert!(map.whole() == expected.whole());
    store.fail(true);
    let refused = map.replace(&whole.points.points_m, &whole.points.normals, "map").unwrap_err();
    assert!(matches!(refused, LoadError::NoRoom { reason: Some(_), .. }), "{refused}");
    assert!(map.is_empty() && map.frame_id().is_none());
}

#[test]
fn tiles_have_an_edge_a_store_and_room() {
    let refused = |config: ReconstructionConfig, part: &str| {
        let error = Map::new(config, Some(Box::new(MemoryStore::default()))).unwrap_err();
        assert!(error.to_string().contains(part), "{part}: {error}");
    };
    let good = spilling_config(MOST);
    for spill_tile_edge_m in [0.0, -1.0, 50.1] {
        refused(
            ReconstructionConfig { spill_tile_edge_m, ..good.clone() },
            "spill_tile_edge_m must be above 0 and at most 1000 times map_edge_m",
        );
    }
    refused(spilling_config(26), "of a full tile of spill_tile_edge_m (27), not 26");
    assert!(Map::new(good.clone(), None).is_err());
    // Voxels are those of another map.
    let few_voxels = ReconstructionConfig { max_voxels: 1, ..good };
    assert!(Map::new(few_voxels, Some(Box::new(MemoryStore::default()))).is_ok());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Whatever the camera looks at, cycle by cycle, and whatever is told to listeners meanwhile.
    #[test]
    fn the_map_is_that_of_unbounded_memory(
        poses in prop::collection::vec((-1.0..19.0_f64, -3.2..3.2_f64), 1..12),
        takes in prop::collection::vec(0..3_000_usize, 12),
        max_map_blocks in 700..900_usize,
        loads in any::<bool>(),
    ) {
        let scene = Scene::corridor(END_M);
        let ((mut map, _store), mut twin) = (spilling(max_map_blocks), super::map(EDGE_M));
        if loads {
            let whole = driven(super::map(EDGE_M), &drive()[..12]).whole();
            map.replace(&whole.points.points_m, &whole.points.normals, "map").unwrap();
            twin.replace(&whole.points.points_m, &whole.points.normals, "map").unwrap();
        }
        map.follow_changes();
        twin.follow_changes();
        let grid = *map.grid();
        let mut known = known_of(&map);
        for (index, ((x_m, yaw_rad), take)) in (0..).zip(poses.into_iter().zip(takes)) {
            let cycle = sized_cycle(&scene, index, &rig_at(x_m, yaw_rad), None, (80, 60));
            prop_assert_eq!(map.integrate(&cycle).unwrap(), twin.integrate(&cycle).unwrap());
            check(&map);
            let changes = map.take_changes(take);
            prop_assert!(!changes.is_incomplete);
            for point in &changes.removed.points_m {
                known.remove(&grid.key(point));
            }
            known.extend(changes.updated.points_m.iter().map(|point| (grid.key(point), *point)));
            check(&map);
        }
        prop_assert!(map.whole() == twin.whole());
        prop_assert_eq!(map.len(), twin.len());
        listen(&mut map, &mut known);
        assert_is_known(&known, &map);
        let counts = counts(&map);
        prop_assert_eq!((counts.lost, counts.failed), (0, 0));
    }
}
