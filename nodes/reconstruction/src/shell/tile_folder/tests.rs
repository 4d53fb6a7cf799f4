use geometry::{Cloud, Stamp};
use nalgebra::Point3;

use super::*;
use crate::tiles::{TileError, TileFormatError};
use crate::{AtMaxVoxels, ReconstructionConfig, StaticMap};

fn key(x: i32) -> TileKey {
    TileKey { x, y: -2, z: 0 }
}

/// The names of what is in the folder, in order.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn tiles_are_files_until_the_run_ends() {
    let parent = tempfile::tempdir().unwrap();
    let spill_folder = parent.path().join("a/b");
    let mut folder = TileFolder::new(spill_folder.to_str().unwrap()).unwrap();
    folder.write(key(-7), b"one").unwrap();
    folder.write(key(3), b"two").unwrap();
    folder.write(key(3), b"three").unwrap();
    assert_eq!(names(&folder.folder), ["-7_-2_0.tile", "3_-2_0.tile", "lock"]);
    assert_eq!(folder.read(key(3)), Ok(b"three".to_vec()));
    assert_eq!(folder.read(key(4)), Err(TileStoreError::Missing));
    folder.clear().unwrap();
    assert_eq!(names(&folder.folder), ["lock"]);
    drop(folder);
    assert!(names(&spill_folder).is_empty());
}

#[test]
fn what_a_killed_run_has_left_goes_and_what_another_one_has_stays() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().to_str().unwrap();
    let other = TileFolder::new(path).unwrap();
    let left = parent.path().join("tiles-1-0");
    fs::create_dir(&left).unwrap();
    fs::write(left.join(LOCK), "").unwrap();
    fs::write(left.join("0_0_0.tile"), "old").unwrap();
    fs::create_dir(parent.path().join("tiles-of-somebody")).unwrap();
    let own = TileFolder::new(path).unwrap();
    assert!(!left.exists() && other.folder.exists() && own.folder != other.folder);
    assert!(parent.path().join("tiles-of-somebody").exists());
}

/// Process numbers are not unique over containers that share a disk.
#[test]
fn a_folder_that_another_run_has_by_the_same_name_is_left_to_it() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("tiles-1-0");
    let first = TileFolder::at(path.clone()).unwrap();
    assert!(first.is_some() && TileFolder::at(path).unwrap().is_none());
    let next = NUMBER.load(Ordering::Relaxed);
    // Other tests count on meanwhile.
    let process = std::process::id();
    for number in next..next + 20 {
        fs::create_dir(parent.path().join(format!("tiles-{process}-{number}"))).unwrap();
    }
    let own = TileFolder::new(parent.path().to_str().unwrap()).unwrap();
    assert_eq!(names(&own.folder), ["lock"]);
}

/// A run that starts may take the folder of another one that is about to lock its own for a leftover.
#[test]
fn runs_that_start_at_the_same_time_do_not_remove_each_others_folders() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().to_str().unwrap();
    let folders: Vec<TileFolder> = std::thread::scope(|scope| {
        let starting: Vec<_> = (0..8)
            .map(|_| scope.spawn(|| (0..20).map(|_| TileFolder::new(path).unwrap()).collect()))
            .collect();
        starting.into_iter().flat_map(|thread| -> Vec<_> { thread.join().unwrap() }).collect()
    });
    for mut folder in folders.into_iter() {
        folder.write(key(0), b"bytes").unwrap();
        assert_eq!(folder.read(key(0)), Ok(b"bytes".to_vec()));
    }
}

#[test]
fn a_folder_without_permission_is_told_with_what_was_tried() {
    use std::os::unix::fs::PermissionsExt;

    let parent = tempfile::tempdir().unwrap();
    fs::set_permissions(parent.path(), fs::Permissions::from_mode(0o500)).unwrap();
    if fs::create_dir(parent.path().join("root")).is_ok() {
        eprintln!("skipped: this user may write everywhere");
        return;
    }
    let error = TileFolder::new(parent.path().to_str().unwrap()).err().unwrap().to_string();
    assert!(error.contains("cannot make the folder") && error.contains("denied"), "{error}");
}

#[test]
fn a_folder_that_cannot_be_is_told_at_the_start() {
    let parent = tempfile::tempdir().unwrap();
    let file = parent.path().join("file");
    fs::write(&file, "").unwrap();
    for (path, part) in [("", "is empty"), (file.to_str().unwrap(), "file")] {
        let error = TileFolder::new(path).err().unwrap().to_string();
        assert!(error.contains("spill_folder") && error.contains(part), "{error}");
    }
}

/// A map of which four tiles of 16 voxels are in memory, of clouds of a tile each.
#[test]
fn a_map_larger_than_the_memory_is_whole_and_a_spoilt_file_is_told() {
    let parent = tempfile::tempdir().unwrap();
    let folder = TileFolder::new(parent.path().to_str().unwrap()).unwrap();
    let files = folder.folder.clone();
    let config = ReconstructionConfig {
        pipeline: geometry::PipelineConfig {
            voxel_edge_m: 1.0,
            ..geometry::PipelineConfig::default()
        },
        max_voxels: 64,
        at_max_voxels: AtMaxVoxels::Spill,
        spill_tile_edge_m: 4.0,
        ..ReconstructionConfig::default()
    };
    let mut map = StaticMap::with_tile_store(config, Box::new(folder)).unwrap();
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
    assert_eq!(names(&files).len(), 21 + 1, "25 tiles, and the lock");
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
    assert!(names(parent.path()).is_empty());
}
