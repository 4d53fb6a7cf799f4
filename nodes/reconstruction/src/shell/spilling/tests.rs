use std::fs;

use super::*;
use crate::ReconstructionConfig;
use crate::surface_map::tests::scene::{Scene, rig_at, sized_cycle};
use crate::tiles::testing::MemoryStore;
use crate::tiles::{TileError, TileFormatError};

/// A map that has no room for all of a corridor: a view of it with what is beside has some 700 blocks.
fn small(max_map_blocks: usize) -> ReconstructionConfig {
    let mut config = ReconstructionConfig {
        max_map_blocks,
        at_max_voxels: AtMaxVoxels::Spill,
        spill_tile_edge_m: 1.2,
        ..ReconstructionConfig::default()
    };
    config.pipeline.map_edge_m = 0.05;
    config
}

/// The view from a place of the corridor.
fn add(map: &mut Map, index: u32, x_m: f64) {
    let view = sized_cycle(&Scene::corridor(20.0), index, &rig_at(x_m, 0.0), None, (160, 120));
    map.integrate(&view).unwrap();
}

#[test]
fn the_warning_goes_once_the_store_has_not_failed_for_a_while() {
    let store = MemoryStore::default();
    let mut map = Map::new(small(500), Some(Box::new(store.clone()))).unwrap();
    let mut watch = SpillWatch::new(Counters::default());
    let start = Instant::now();
    let mut look = |map: &mut Map, seconds: u64| {
        watch.condition(map, start + Duration::from_secs(seconds)).unwrap()
    };
    add(&mut map, 0, 0.0);
    assert!(!look(&mut map, 0).1);
    store.fail(true);
    // As long as it fails, and is asked.
    for (index, seconds) in (1..).zip([10, 30, 50, 70]) {
        add(&mut map, index, 4.0 * f64::from(index));
        let (text, is_warning) = look(&mut map, seconds);
        assert!(is_warning && text.contains("1 failures"), "{text}");
    }
    store.fail(false);
    add(&mut map, 5, 16.0);
    assert!(look(&mut map, 99).1);
    let (text, is_warning) = look(&mut map, 101);
    assert!(!is_warning && text.contains("1 failures"), "the number stays: {text}");
}

#[test]
fn tiles_are_files_by_their_keys() {
    let parent = tempfile::tempdir().unwrap();
    let folder = store_in(parent.path().to_str().unwrap()).unwrap();
    let files = folder.path().to_owned();
    let mut store: Box<dyn TileStore> = Box::new(folder);
    let key = |x| TileKey { x, y: -2, z: 0 };
    store.write(key(-7), b"one").unwrap();
    assert_eq!(fs::read(files.join("-7_-2_0.tile")).unwrap(), b"one");
    assert_eq!(store.read(key(-7)), Ok(b"one".to_vec()));
    assert_eq!(store.read(key(3)), Err(TileStoreError::Missing));
    let mut another = store.another().unwrap();
    assert_eq!(another.read(key(-7)), Err(TileStoreError::Missing));
    another.write(key(-7), b"two").unwrap();
    store.clear().unwrap();
    assert_eq!(store.read(key(-7)), Err(TileStoreError::Missing));
    assert_eq!(another.read(key(-7)), Ok(b"two".to_vec()));
}

#[test]
fn a_folder_that_cannot_be_is_told_at_the_start() {
    let parent = tempfile::tempdir().unwrap();
    let file = parent.path().join("file");
    fs::write(&file, "").unwrap();
    for (path, part) in [("", "is empty"), (file.to_str().unwrap(), "file")] {
        let config = small(5000);
        let spill_folder = path.to_owned();
        let parameters = ReconstructionParameters { config, spill_folder, ..Default::default() };
        let error = empty_map(&parameters).err().unwrap().to_string();
        assert!(error.contains("spill_folder") && error.contains(part), "{error}");
    }
}

fn entries(folder: &Path) -> usize {
    fs::read_dir(folder).unwrap().count()
}

#[test]
fn a_map_larger_than_the_memory_is_whole_and_a_spoilt_file_is_told() {
    let parent = tempfile::tempdir().unwrap();
    let folder = store_in(parent.path().to_str().unwrap()).unwrap();
    let files = folder.path().to_owned();
    let mut map = Map::new(small(800), Some(Box::new(folder))).unwrap();
    let unbounded = ReconstructionConfig { at_max_voxels: AtMaxVoxels::Refuse, ..small(5000) };
    let mut twin = Map::new(unbounded, None).unwrap();
    for index in 0..19 {
        add(&mut map, index, f64::from(index));
        add(&mut twin, index, f64::from(index));
    }
    assert!(map.points() == twin.points() && map.points().len() > 5_000);
    let tiles = map.spill_counts().unwrap().tiles_in_store;
    assert_eq!(entries(&files), tiles + 1, "and the lock");
    let tile = fs::read_dir(&files).unwrap().map(|entry| entry.unwrap().path());
    let tile = tile.filter(|path| path.extension().is_some_and(|it| it == "tile")).min().unwrap();
    fs::write(&tile, "SMTL spoilt").unwrap();
    let whole = map.whole();
    assert!(whole.points.points_m.len() < twin.points().len());
    let [TileError::Broken { tile: broken, source: TileFormatError::OtherVersion { .. } }] =
        &whole.unreadable[..]
    else {
        panic!("{:?}", whole.unreadable)
    };
    assert_eq!(tile.file_name().unwrap().to_str().unwrap(), file_name(*broken));
    drop(map);
    assert_eq!(entries(parent.path()), 0);
}
