use std::collections::BTreeSet;

use geometry::{Method, PipelineConfig, SegmentedCycle, Stamp};
use nalgebra::Point3;
use proptest::prelude::*;

use super::super::{StaticMap, testing};
use super::*;
use crate::tiles::testing::MemoryStore;
use crate::tiles::{SpillCounts, TileFormatError, TileStoreError};
use crate::{AtMaxVoxels, ConfigError, ReconstructionConfig};

/// Of a tile of 4 voxels an axis, the least there is.
const MOST: usize = 64;

fn config(method: Method) -> ReconstructionConfig {
    ReconstructionConfig {
        pipeline: PipelineConfig::new(method, 1.0),
        max_voxels: MOST,
        at_max_voxels: AtMaxVoxels::Spill,
        spill_tile_edge_m: 4.0,
        ..ReconstructionConfig::default()
    }
}

fn spilling(method: Method) -> (StaticMap, MemoryStore) {
    let store = MemoryStore::default();
    let map = StaticMap::with_tile_store(config(method), Box::new(store.clone())).unwrap();
    (map, store)
}

/// The same with memory for all.
fn unbounded(method: Method) -> StaticMap {
    let config = ReconstructionConfig {
        max_voxels: 1_000_000,
        at_max_voxels: AtMaxVoxels::Refuse,
        ..config(method)
    };
    StaticMap::new(config).unwrap()
}

fn cycle(camera_m: [f64; 3], still: &[[f32; 3]], moving: &[[f32; 3]]) -> SegmentedCycle {
    SegmentedCycle {
        setup: testing::camera_at(camera_m.into()),
        ..testing::cycle(Stamp::from_nanos(1), still, moving)
    }
}

/// A full plane of so many tiles along x, seen from far away, tile by tile.
fn walls(tiles: u8) -> Vec<SegmentedCycle> {
    (0..tiles)
        .map(|tile| {
            let at = |index: u8| {
                let y = f32::from(index % 4) + 0.3;
                [4.0 * f32::from(tile) + 0.25, y, f32::from(index / 4) + 0.6]
            };
            cycle([0.0, 0.0, 500.0], &(0..16).map(at).collect::<Vec<_>>(), &[])
        })
        .collect()
}

fn counts(map: &StaticMap) -> SpillCounts {
    map.spill_counts().unwrap()
}

#[test]
fn what_does_not_fit_goes_to_the_store_and_comes_back() {
    let (mut map, store) = spilling(Method::RecHv);
    let walls = walls(6);
    for wall in &walls {
        map.integrate(wall).unwrap();
    }
    // Four tiles of 16 voxels fit; the two that were reached longest ago have gone.
    assert_eq!((map.len(), map.voxels.len()), (96, 64));
    let keys: Vec<i32> = store.with(|tiles| tiles.keys().map(|tile| tile.x).collect());
    assert_eq!(keys, [0, 1]);
    let key = VoxelKey { x: 0, y: 0, z: 0 };
    assert_eq!(map.voxel(key), Some((Point3::new(0.25, 0.3, 0.6), 1)));
    let addition = map.integrate(&walls[0]).unwrap();
    assert_eq!((addition.new_voxels, addition.changed_voxels), (0, 16));
    assert_eq!(map.voxel(key), Some((Point3::new(0.25, 0.3, 0.6), 2)));
    let expected = SpillCounts {
        tiles_in_memory: 4,
        tiles_in_store: 2,
        voxels_in_store: 32,
        written: 3,
        read: 1,
        ..SpillCounts::default()
    };
    assert_eq!((counts(&map), map.take_tile_error()), (expected, None));
    map.clear();
    assert_eq!((map.len(), store.with(|tiles| tiles.len())), (0, 0));
}

#[test]
fn a_ray_reaches_what_was_spilled() {
    let (mut map, _store) = spilling(Method::FreeSpace);
    map.integrate(&cycle([0.5; 3], &[[5.5, 0.5, 0.5]], &[])).unwrap();
    for wall in walls(16).iter().skip(8) {
        map.integrate(wall).unwrap();
    }
    let key = VoxelKey { x: 5, y: 0, z: 0 };
    assert!(!map.voxels.contains_key(&key) && map.voxel(key).is_some());
    let behind = cycle([0.5; 3], &[[9.5, 0.5, 0.5]], &[]);
    let cleared: Vec<usize> =
        (0..3).map(|_| map.integrate(&behind).unwrap().cleared_voxels).collect();
    assert_eq!(cleared, [0, 0, 1]);
    assert_eq!(map.voxel(key), None);
}

#[test]
fn a_loaded_map_may_be_larger_than_the_memory() {
    let points: Vec<Point3<f32>> =
        (0..400_u16).map(|x| Point3::new(f32::from(x) + 0.5, 0.5, 0.5)).collect();
    let (mut map, _store) = spilling(Method::FreeSpace);
    map.replace(&points, "map").unwrap();
    assert_eq!((map.points(), map.len()), (points.clone(), 400));
    assert!(map.voxels.len() <= MOST);
    let first = VoxelKey { x: 0, y: 0, z: 0 };
    assert_eq!(map.voxel(first), Some((points[0], crate::LOADED_HITS)));
}

#[test]
fn a_broken_or_missing_tile_is_told_and_the_map_goes_on() {
    type Spoil = fn(&mut Vec<u8>);
    let spoils: [(Spoil, TileFormatError); 5] = [
        (|bytes| bytes[0] ^= 1, TileFormatError::NotThisFormat),
        (|bytes| bytes[4] = 1, TileFormatError::OtherVersion { version: 1 }),
        (|bytes| bytes.truncate(3), TileFormatError::CutOff),
        (|bytes| bytes.truncate(60), TileFormatError::Checksum),
        (|bytes| *bytes.last_mut().unwrap() ^= 1, TileFormatError::Checksum),
    ];
    let lost = TileKey::default();
    let check = |spoil: &dyn Fn(&MemoryStore), expected: TileError| {
        let (mut map, store) = spilling(Method::FreeSpace);
        map.follow_changes();
        let walls = walls(6);
        for wall in &walls {
            map.integrate(wall).unwrap();
        }
        let _told = map.take_changes(usize::MAX);
        spoil(&store);
        let whole = map.whole();
        assert_eq!((whole.points_m.len(), whole.unreadable), (80, vec![expected.clone()]));
        let addition = map.integrate(&walls[0]).unwrap();
        assert_eq!((addition.new_voxels, addition.refused_points), (16, 0));
        assert_eq!((map.len(), counts(&map).lost), (96, 1));
        assert_eq!(map.take_tile_error(), Some(expected));
        assert!(map.take_changes(0).is_incomplete, "listeners need the whole map");
    };
    for (spoil, source) in spoils {
        let spoil = |store: &MemoryStore| store.with(|tiles| spoil(tiles.get_mut(&lost).unwrap()));
        check(&spoil, TileError::Broken { tile: lost, source });
    }
    let missing = TileError::Read { tile: lost, source: TileStoreError::Missing };
    check(&|store| drop(store.with(|tiles| tiles.remove(&lost))), missing);
    // That of another place is none of this one.
    let swap = |store: &MemoryStore| {
        store.with(|tiles| {
            let other = tiles.values().next_back().cloned();
            tiles.insert(lost, other.unwrap())
        });
    };
    check(&swap, TileError::Broken { tile: lost, source: TileFormatError::OtherTile });
}

#[test]
fn a_store_that_fails_for_a_while_loses_nothing() {
    let (mut map, store) = spilling(Method::RecHv);
    let walls = walls(8);
    for wall in &walls[..6] {
        map.integrate(wall).unwrap();
    }
    let before = map.points();
    store.fail(true);
    // Neither is there room for a new tile, nor can an old one come back; what is in memory goes on.
    for (wall, refused) in [(6, 16), (0, 16), (5, 0)] {
        assert_eq!(map.integrate(&walls[wall]).unwrap().refused_points, refused);
        assert!(map.voxels.len() <= MOST);
    }
    let error = map.take_tile_error().unwrap();
    assert!(error.to_string().contains("no space left") && !error.is_loss(), "{error}");
    assert_eq!((counts(&map).failed, counts(&map).lost), (1, 0), "it is one failure, to write");
    assert_eq!(map.whole().unreadable.len(), 2);
    store.fail(false);
    assert_eq!(map.points(), before);
    assert_eq!(map.integrate(&walls[6]).unwrap().new_voxels, 16);
    assert_eq!(map.len(), 112);
}

#[test]
fn a_map_with_a_tile_that_cannot_be_read_for_now_is_not_given_as_whole() {
    let (mut map, store) = spilling(Method::RecHv);
    for wall in &walls(6) {
        map.integrate(wall).unwrap();
    }
    map.follow_changes();
    store.fail(true);
    for _ in 0..3 {
        let error = map.cloud_for_listeners().unwrap_err();
        assert!(!error.is_loss() && error.tile() == Some(TileKey::default()), "{error}");
        assert_eq!((counts(&map).failed, counts(&map).lost), (2, 0), "two tiles, once each");
    }
    assert!(map.take_tile_error().is_some());
    store.fail(false);
    assert_eq!(map.cloud_for_listeners().unwrap().points_m.len(), 96);
    assert!(!map.take_changes(9).is_incomplete);
    store.fail(true);
    assert!(map.cloud_for_listeners().is_err());
    assert_eq!(counts(&map).failed, 4, "another failure");
}

#[test]
fn a_lost_tile_is_counted_once_and_the_map_is_then_what_is_left() {
    let (mut map, store) = spilling(Method::RecHv);
    for wall in &walls(6) {
        map.integrate(wall).unwrap();
    }
    map.follow_changes();
    store.with(|tiles| tiles.remove(&TileKey::default()));
    for is_first in [true, false] {
        assert_eq!(map.cloud_for_listeners().unwrap().points_m.len(), 80);
        assert_eq!((map.len(), counts(&map).lost, counts(&map).failed), (80, 1, 0));
        assert_eq!(map.take_changes(9).is_incomplete, is_first, "who follows needs the whole map");
    }
}

#[test]
fn a_map_that_is_loaded_onto_a_full_disk_is_no_success() {
    let points: Vec<Point3<f32>> =
        (0..100_u8).map(|x| Point3::new(f32::from(x) + 0.5, 0.5, 0.5)).collect();
    let (mut map, store) = spilling(Method::RecHv);
    map.replace(&points[..10], "map").unwrap();
    store.fail(true);
    let error = map.replace(&points, "map").unwrap_err().to_string();
    assert!(error.contains("36 of its points") && error.contains("no space left"), "{error}");
    assert!(map.is_empty() && map.frame_id().is_none());
    store.fail(false);
    assert_eq!(map.replace(&points, "map").unwrap().refused_points, 0);
    assert_eq!(map.points(), points);
}

/// Listeners were told of a mean, which has moved and waits when its tile goes; another listener comes and sees it where
/// it is; it moves back. The first has it right, and the second only if it is told of again.
#[test]
fn what_waits_when_its_tile_goes_is_told_of_whatever_it_does_then() {
    let (mut map, _store) = spilling(Method::RecHv);
    map.follow_changes();
    let point = |x: f32| [x, 0.5, 0.5];
    map.integrate(&cycle([0.0; 3], &[point(0.1)], &[])).unwrap();
    assert_eq!(map.take_changes(9).updated.points_m.len(), 1);
    map.integrate(&cycle([0.0; 3], &[point(0.9)], &[])).unwrap();
    for wall in &walls(9)[4..] {
        map.integrate(wall).unwrap();
    }
    let key = VoxelKey { x: 0, y: 0, z: 0 };
    assert!(!map.voxels.contains_key(&key));
    assert!(map.cloud_for_listeners().unwrap().points_m.contains(&Point3::new(0.5, 0.5, 0.5)));
    map.integrate(&cycle([0.0; 3], &[point(0.0); 8], &[])).unwrap();
    let told = map.take_changes(usize::MAX).updated.points_m;
    assert!(
        told.iter().any(|point| (point - Point3::new(0.1, 0.5, 0.5)).norm() < 1e-6),
        "{told:?}"
    );
}

#[test]
fn tiles_have_an_edge_a_store_and_room() {
    let check = |config: ReconstructionConfig, part: &str| {
        let store = Box::new(MemoryStore::default());
        let error = StaticMap::with_tile_store(config, store).unwrap_err().to_string();
        assert!(error.contains(part), "{part}: {error}");
    };
    let good = config(Method::RecHv);
    for spill_tile_edge_m in [0.0, -1.0, f64::NAN, f64::INFINITY, 1001.0] {
        check(
            ReconstructionConfig { spill_tile_edge_m, ..good.clone() },
            "spill_tile_edge_m must be",
        );
    }
    check(
        ReconstructionConfig { max_voxels: 63, ..good.clone() },
        "spill_tile_edge_m (64), not 63",
    );
    assert_eq!(StaticMap::new(good.clone()).unwrap_err(), ConfigError::NoTileStore);
    let unused = ReconstructionConfig { at_max_voxels: AtMaxVoxels::Refuse, max_voxels: 1, ..good };
    assert!(StaticMap::new(unused).is_ok());
}

#[test]
fn the_memory_of_a_tile_in_the_store_is_as_documented() {
    let (mut map, store) = spilling(Method::RecHv);
    for wall in walls(200) {
        map.integrate(&wall).unwrap();
    }
    let spill = map.spill.as_ref().unwrap();
    let per_tile = spill.memory_bytes() as f64 / spill.tiles_by_key().len() as f64;
    assert!((24.0..60.0).contains(&per_tile), "{per_tile} bytes a tile");
    let bytes = store.with(|tiles| tiles.values().map(Vec::len).sum::<usize>());
    let per_voxel = bytes as f64 / spill.voxels() as f64;
    assert!(per_voxel < 24.0, "{per_voxel} bytes a voxel");
}

fn points(most: usize) -> impl Strategy<Value = Vec<[f32; 3]>> {
    let coordinate = || prop_oneof![8 => -6.0..6.0_f32, 1 => Just(-0.0), 1 => -1e-9..1e-9_f32];
    prop::collection::vec(
        (coordinate(), -4.0..4.0_f32, coordinate()).prop_map(<[f32; 3]>::from),
        0..most,
    )
}

fn cycles() -> impl Strategy<Value = Vec<SegmentedCycle>> {
    let camera = || prop::array::uniform3(-6.0..6.0_f64);
    let cycle = (camera(), points(120), points(6))
        .prop_map(|(camera_m, still, moving)| cycle(camera_m, &still, &moving));
    prop::collection::vec(cycle, 1..14)
}

proptest! {
    /// Cycle by cycle, and whatever is told to listeners meanwhile.
    #[test]
    fn the_map_is_that_of_unbounded_memory(
        cycles in cycles(),
        takes in prop::collection::vec(0..60_usize, 14),
        method in prop_oneof![Just(Method::RecHv), Just(Method::FreeSpace)],
    ) {
        let ((mut map, _store), mut twin) = (spilling(method), unbounded(method));
        map.follow_changes();
        for (cycle, take) in cycles.iter().zip(takes) {
            prop_assert_eq!(map.integrate(cycle).unwrap(), twin.integrate(cycle).unwrap());
            prop_assert_eq!(map.changed(), twin.changed());
            let _told = map.take_changes(take);
            prop_assert!(map.voxels.len() <= MOST);
        }
        prop_assert_eq!(map.points(), twin.points());
        prop_assert_eq!(map.len(), twin.len());
        for key in twin.voxels.keys() {
            prop_assert_eq!(map.voxel(*key), twin.voxel(*key));
        }
        let counts = counts(&map);
        prop_assert_eq!((counts.lost, counts.failed), (0, 0));
        prop_assert!(counts.tiles_in_store > 0 || map.len() <= MOST);
    }

    #[test]
    fn a_tile_survives_its_bytes(cycles in cycles(), edge_m in 1e-3..10.0_f64, blocks in 1..6_u16) {
        let layout = TileLayout { edge_voxels: 4 * blocks, grid: VoxelGrid::new(edge_m).unwrap() };
        let config = ReconstructionConfig {
            pipeline: PipelineConfig::new(Method::FreeSpace, edge_m),
            at_max_voxels: AtMaxVoxels::Refuse,
            ..ReconstructionConfig::default()
        };
        let mut map = StaticMap::new(config).unwrap();
        map.follow_changes();
        for cycle in &cycles {
            map.integrate(cycle).unwrap();
            let _told = map.take_changes(30);
        }
        let tiles: BTreeSet<TileKey> = map.voxels.keys().map(|key| layout.tile_of(*key)).collect();
        for tile in tiles {
            let mut voxels: Vec<_> = map.voxels.iter().map(|(key, voxel)| (*key, *voxel)).collect();
            voxels.retain(|(key, _)| layout.tile_of(*key) == tile);
            voxels.sort_unstable_by_key(|(key, _)| *key);
            let back = layout.decode(tile, &layout.encode(tile, &voxels)).unwrap();
            prop_assert_eq!(format!("{back:?}"), format!("{voxels:?}"));
        }
    }

    #[test]
    fn no_bytes_make_it_panic(
        bytes in prop::collection::vec(any::<u8>(), 0..200), count in 0..5_u32, latest in any::<[u32; 2]>(),
    ) {
        let layout = TileLayout { edge_voxels: 4, grid: VoxelGrid::new(1.0).unwrap() };
        let tile = TileKey { x: i32::MAX, y: i32::MIN, z: 0 };
        let _ = layout.decode(tile, &bytes);
        // The same as the voxels of a tile that is whole.
        let mut whole = layout.encode(tile, &[]);
        whole.truncate(28);
        whole.extend(count.to_le_bytes());
        whole.extend(latest.into_iter().flat_map(u32::to_le_bytes));
        whole.extend(&bytes);
        let checksum = crc32fast::hash(&whole);
        whole.extend(checksum.to_le_bytes());
        if let Ok(voxels) = layout.decode(tile, &whole) {
            prop_assert_eq!(voxels.len(), count as usize);
        }
    }
}
