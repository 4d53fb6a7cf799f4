use std::fs;

use geometry::{Cloud, Stamp};
use nalgebra::Point3;

use super::*;
use crate::tiles::testing::MemoryStore;
use crate::tiles::{TileError, TileFormatError};
use crate::{ReconstructionConfig, StaticMap};

/// The point of a tile of its own.
fn cloud(tile: u8) -> Cloud {
    Cloud {
        stamp: Stamp::default(),
        frame_id: "map".to_owned(),
        points_m: (0..64_u8)
            .map(|index| [4 * tile + index / 16, index / 4 % 4, index % 4])
            .map(|cell| Point3::from(cell.map(|along| f32::from(along) + 0.5)))
            .collect(),
    }
}

/// A map of which four tiles of 16 voxels are in memory, of clouds of a tile each.
fn four_tiles() -> ReconstructionConfig {
    ReconstructionConfig {
        pipeline: geometry::PipelineConfig {
            voxel_edge_m: 1.0,
            ..geometry::PipelineConfig::default()
        },
        max_voxels: 64,
        at_max_voxels: AtMaxVoxels::Spill,
        spill_tile_edge_m: 4.0,
        ..ReconstructionConfig::default()
    }
}

fn add(map: &mut Map, tile: u8) {
    let Map::Means(map) = map else { panic!("of depth images") };
    map.add(&cloud(tile)).unwrap();
}

#[test]
fn the_warning_goes_once_the_store_has_not_failed_for_a_while() {
    let store = MemoryStore::default();
    let mut map = Map::new(four_tiles(), Some(Box::new(store.clone()))).unwrap();
    let mut watch = SpillWatch::new(Counters::default());
    let start = Instant::now();
    let mut look = |map: &mut Map, seconds: u64| {
        watch.condition(map, start + Duration::from_secs(seconds)).unwrap()
    };
    add(&mut map, 0);
    assert!(!look(&mut map, 0).1);
    store.fail(true);
    // As long as it fails, and is asked.
    for seconds in [10, 30, 50, 70] {
        add(&mut map, 1);
        let (text, is_warning) = look(&mut map, seconds);
        assert!(is_warning && text.contains("1 failures"), "{text}");
    }
    store.fail(false);
    add(&mut map, 1);
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
        let error = store_in(path).err().unwrap().to_string();
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
    let mut map = StaticMap::with_tile_store(four_tiles(), Box::new(folder)).unwrap();
    let all: Vec<Point3<f32>> = (0..100_u8)
        .flat_map(|x| (0..4_u8).map(move |y| Point3::new(f32::from(x) + 0.5, f32::from(y), 0.0)))
        .collect();
    for points in all.chunks(16) {
        let cloud = Cloud {
            stamp: Stamp::default(),
            frame_id: "map".to_owned(),
            points_m: points.to_vec(),
        };
        map.add(&cloud).unwrap();
    }
    assert_eq!(map.points(), all);
    assert_eq!(entries(&files), 21 + 1, "25 tiles, and the lock");
    fs::write(files.join("0_0_0.tile"), "SMTL spoilt").unwrap();
    let whole = map.whole();
    assert_eq!(whole.points_m, all[16..]);
    let [TileError::Broken { tile, source: TileFormatError::OtherVersion { .. } }] =
        &whole.unreadable[..]
    else {
        panic!("{:?}", whole.unreadable)
    };
    assert_eq!(*tile, TileKey::default());
    drop(map);
    assert_eq!(entries(parent.path()), 0);
}
