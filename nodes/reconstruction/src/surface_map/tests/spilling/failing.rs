//! A store that fails, and tiles that are lost.

use super::*;
use crate::tiles::{TileError, TileFormatError, TileStoreError};

#[test]
fn a_correction_waits_for_a_store_that_fails_and_the_map_is_as_it_was() {
    let (mut map, store) = spilling(MOST);
    map.follow_path(&path(0.0)).unwrap();
    let mut map = driven(map, &drive());
    let before = map.whole();
    store.fail(true);
    let error = map.follow_path(&path(0.2)).unwrap_err();
    assert!(error.to_string().contains("waits for the next path"), "{error}");
    store.fail(false);
    check(&map);
    assert!(map.whole() == before);
    // Halfway, in the other store.
    store.fail_after(counts(&map).tiles_in_memory + 3);
    assert!(map.follow_path(&path(0.2)).is_err());
    store.fail(false);
    check(&map);
    assert!(map.whole() == before && map.len() > 10_000);
    assert!(map.follow_path(&path(0.2)).unwrap().moved_voxels > 10_000);
    assert_eq!(counts(&map).lost, 0);
}

/// What was seen after the path that could not be followed stands where it belongs already.
#[test]
fn what_came_after_a_correction_that_waits_stays() {
    let cycles = drive();
    let (mut map, store) = spilling(MOST);
    map.follow_path(&path(0.0)).unwrap();
    map = driven(map, &cycles[..20]);
    store.fail(true);
    assert!(map.follow_path(&path(0.2)).is_err());
    store.fail(false);
    let scene = Scene::corridor(END_M);
    let rig = rig_at(18.0, 0.0);
    // 8 s.
    map.integrate(&sized_cycle(&scene, 56, &rig, None, (160, 120))).unwrap();
    let at_the_end = |map: &Map| {
        let points = map.points().into_iter().filter(|point| point.x > 19.0);
        points.collect::<Vec<_>>()
    };
    let before = at_the_end(&map);
    assert!(map.follow_path(&path_since(9.0, 0.2)).unwrap().moved_voxels > 1_000);
    assert!(at_the_end(&map) == before && before.len() > 1_000);
}

#[test]
fn a_spoilt_or_missing_tile_is_told_of_and_costs_that_tile_alone() {
    type Spoil = fn(&mut BTreeMap<TileKey, Vec<u8>>, TileKey);
    let spoils: [(Spoil, Option<TileFormatError>); 4] = [
        (|tiles, tile| tiles.get_mut(&tile).unwrap()[0] ^= 1, Some(TileFormatError::NotThisFormat)),
        (|tiles, tile| tiles.get_mut(&tile).unwrap()[700] ^= 1, Some(TileFormatError::Checksum)),
        (|tiles, tile| tiles.get_mut(&tile).unwrap().truncate(3), Some(TileFormatError::CutOff)),
        (|tiles, tile| drop(tiles.remove(&tile)), None),
    ];
    let cycles = drive();
    let (there, back) = cycles.split_at(STEPS);
    for (spoil, format_error) in spoils {
        let (mut map, store) = spilling(MOST);
        map.follow_changes();
        map = driven(map, there);
        listen(&mut map, &mut BTreeMap::new());
        let whole = map.whole();
        let in_store = of_depth_images(&map).spill.as_ref().unwrap().tiles.in_store_by_key();
        let lost = store.with(|tiles| {
            let lost = *in_store.iter().max_by_key(|tile| tiles[tile].len()).unwrap();
            spoil(tiles, lost);
            lost
        });
        let expected = match format_error {
            Some(source) => TileError::Broken { tile: lost, source },
            None => TileError::Read { tile: lost, source: TileStoreError::Missing },
        };
        let spill_tile_of = |map: &Map, point: &Point3<f32>| {
            let spill = of_depth_images(map).spill.as_ref().unwrap();
            spill.tile_of(volume::BlockKey::of(map.grid().key(point)))
        };
        let left = map.whole();
        assert_eq!(left.unreadable.first(), Some(&expected));
        assert_eq!(left.unreadable.len(), 1);
        assert_eq!((whole.views.is_empty(), left.views), (false, vec![]), "they saw what is lost");
        // Points between its nodes and those of the tiles before it are lost, too.
        let kept =
            whole.points.points_m.iter().filter(|point| spill_tile_of(&map, point) != lost).count();
        assert!(left.points.points_m.len() > kept * 98 / 100 && left.points.points_m.len() <= kept);
        for cycle in back {
            map.integrate(cycle).unwrap();
            check(&map);
        }
        assert_eq!((counts(&map).lost, counts(&map).failed), (1, 0));
        assert_eq!(map.take_tile_error(), Some(expected));
        assert!(map.take_changes(9).is_incomplete, "listeners need the whole map");
        assert!(map.whole().unreadable.is_empty());
        let last = there.last().unwrap().static_cloud.stamp;
        assert!(map.whole().views.iter().all(|view| view.stamp > last));
        assert!(map.len() > 10_000);
    }
}

#[test]
fn a_store_that_fails_for_a_while_loses_nothing() {
    let (mut map, store) = spilling(MOST);
    let cycles = drive();
    map.follow_changes();
    let mut map = driven(map, &cycles[..STEPS]);
    let before = known_of(&map);
    let in_store: Vec<TileKey> = store.with(|tiles| tiles.keys().copied().collect());
    store.fail(true);
    assert!(!map.whole().unreadable.is_empty());
    assert!(map.cloud_for_listeners().is_err_and(|error| !error.is_loss()));
    let mut refused = 0;
    for cycle in &cycles[STEPS..] {
        refused += map.integrate(cycle).unwrap().refused_points;
        check(&map);
        map.take_changes(100);
    }
    assert!(refused > 0 && map.take_tile_error().is_some());
    let still: Vec<TileKey> = store.with(|tiles| tiles.keys().copied().collect());
    assert_eq!(still, in_store);
    store.fail(false);
    let cloud = map.cloud_for_listeners().unwrap().cloud;
    let now = known_of(&map);
    assert_eq!((cloud.points_m.len(), counts(&map).lost), (now.len(), 0));
    let kept = before.keys().filter(|key| now.contains_key(key)).count();
    assert!(kept * 100 > before.len() * 95, "{kept} of {}", before.len());
    for cycle in &cycles {
        assert_eq!(map.integrate(cycle).unwrap().refused_points, 0);
        check(&map);
    }
}

/// A tile went before changes were followed, and what is beside it changes while it cannot be read: what listeners know of
/// it, nobody knows then.
#[test]
fn a_tile_that_was_missed_when_its_neighbour_changed_needs_the_whole_map() {
    let cycles = drive();
    let (mut map, store) = spilling(MOST);
    map = driven(map, &cycles[..STEPS]);
    map.follow_changes();
    store.fail(true);
    let mut is_incomplete = false;
    for cycle in &cycles[STEPS..] {
        map.integrate(cycle).unwrap();
        is_incomplete |= map.take_changes(1000).is_incomplete;
    }
    assert!(!is_incomplete && of_depth_images(&map).waiting_changes() > 0);
    store.fail(false);
    map.integrate(&cycles[2 * STEPS - 1]).unwrap();
    assert!(map.take_changes(0).is_incomplete);
    let start = map.cloud_for_listeners().unwrap().cloud;
    let grid = *map.grid();
    let mut known: BTreeMap<_, _> =
        start.points_m.iter().map(|point| (grid.key(point), *point)).collect();
    for cycle in &cycles[STEPS..] {
        map.integrate(cycle).unwrap();
        listen(&mut map, &mut known);
        check(&map);
    }
    assert_is_known(&known, &map);
}
