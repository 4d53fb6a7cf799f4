//! Maps that come back, and bytes that are none.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

use super::*;
use crate::feature::lines::SegmentInSpace;
use crate::frame::MeasuredDepth;
use crate::map::testing::{Fuzz, World, around, blank, blank_frame};
use crate::map::{ByOdometry, MapConfig, MapError, NewKeyframe};
use crate::mapping::{Mapper, MappingConfig};
use crate::solve::testing::{Random, kinect};

fn saved(map: &Map) -> SavedMap {
    let world_from_map = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.1, 0.2, 0.3));
    SavedMap { map: map.clone(), world_from_map }
}

/// A map with the noise of a Kinect, of this many keyframes.
fn seen(keyframes: usize) -> Map {
    World::wall(60, 12, 4.0, 1.0, 3).map(&around(keyframes, 0.2), 4).0
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 16, ..ProptestConfig::default() })]
    #[test]
    fn what_is_saved_comes_back_to_the_bit(seed in any::<u64>(), steps in 0..300_usize) {
        let mut fuzz = Fuzz::new(1, seed);
        (0..steps).for_each(|_| fuzz.step());
        let saved = saved(&fuzz.map);
        let bytes = saved.encode().unwrap();
        let again = SavedMap::decode(&bytes).unwrap();
        prop_assert_eq!(again.map.check(), Ok(()));
        prop_assert_eq!(again.map.parts(), fuzz.map.parts());
        prop_assert_eq!(again.world_from_map, saved.world_from_map);
        prop_assert_eq!(again.encode().unwrap(), bytes);
    }

    #[test]
    fn a_byte_that_has_changed_is_found(at in any::<prop::sample::Index>(), by in 1..=u8::MAX) {
        let mut bytes = saved(&seen(2)).encode().unwrap();
        let at = at.index(bytes.len());
        bytes[at] ^= by;
        prop_assert!(SavedMap::decode(&bytes).is_err());
    }

    #[test]
    fn a_file_that_was_cut_off_is_refused(at in any::<prop::sample::Index>()) {
        let mut bytes = saved(&seen(2)).encode().unwrap();
        bytes.truncate(at.index(bytes.len()));
        let found = bytes.len();
        match SavedMap::decode(&bytes).unwrap_err() {
            SavedMapError::NotThisFormat => prop_assert!(found < 4),
            SavedMapError::Length { found: declared, .. } => prop_assert_eq!(declared, found),
            other => prop_assert!(false, "{}", other),
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]
    /// An attacker fixes the checksum, too.
    #[test]
    fn bytes_with_the_right_checksum_are_refused_or_a_map(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
    ) {
        let mut bytes = saved(&seen(2)).encode().unwrap();
        for (at, byte) in changes {
            let at = at.index(bytes.len() - HEADER_BYTES) + HEADER_BYTES;
            bytes[at] = byte;
        }
        fix_checksum(&mut bytes);
        if let Ok(saved) = SavedMap::decode(&bytes) {
            prop_assert_eq!(saved.map.check(), Ok(()));
        }
    }

    #[test]
    fn any_bytes_are_refused(mut bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        prop_assert!(SavedMap::decode(&bytes).is_err());
        let mut whole = Vec::from(MAGIC);
        whole.extend(VERSION.to_le_bytes());
        whole.extend(DESCRIPTORS.to_le_bytes());
        whole.extend((bytes.len() as u64).to_le_bytes());
        whole.append(&mut bytes);
        whole.extend([0; 4]);
        fix_checksum(&mut whole);
        prop_assert!(SavedMap::decode(&whole).is_err());
    }
}

fn fix_checksum(bytes: &mut [u8]) {
    let at = bytes.len() - CHECKSUM_BYTES;
    let checksum = crc32fast::hash(&bytes[..at]);
    bytes[at..].copy_from_slice(&checksum.to_le_bytes());
}

#[test]
fn what_is_wrong_is_named() {
    let bytes = saved(&seen(2)).encode().unwrap();
    let error = |spoil: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = bytes.clone();
        spoil(&mut bytes);
        SavedMap::decode(&bytes).unwrap_err().to_string()
    };
    assert!(error(&|bytes| bytes[0] = b'P').contains("does not begin with SMKF"));
    assert!(error(&|bytes| bytes[4] = 2).contains("version 2") && VERSION == 1);
    assert!(error(&|bytes| bytes[4] = 2).contains("a newer stillmap wrote it"));
    assert!(error(&|bytes| bytes[4] = 0).contains("make the map again"));
    let described = |bytes: &mut Vec<u8>| {
        bytes[6] = 9;
        fix_checksum(bytes);
    };
    assert!(error(&described).contains("descriptors have version 9"));
    let cut = error(&|bytes| bytes.truncate(100));
    assert!(cut.contains("has 100 bytes") && cut.contains(&bytes.len().to_string()), "{cut}");
    assert!(error(&|bytes| bytes.push(0)).contains("put behind it"));
    assert!(error(&|bytes| bytes[500] ^= 1).contains("checksum"));
    let parts = seen(2).parts();
    let mut named = parts.clone();
    named.keyframes[1].points[0] = Some(5000);
    let bytes = encoded(&named, &Isometry3::identity()).unwrap();
    let error = SavedMap::decode(&bytes).unwrap_err();
    let count = parts.points.len();
    let expected = PartsError::NotThere { index: 1, what: "point", named: 5000, count };
    assert_eq!(error, SavedMapError::Parts(expected));
    let nowhere = Isometry3::translation(f64::NAN, 0.0, 0.0);
    let bytes = encoded(&parts, &nowhere).unwrap();
    assert_eq!(SavedMap::decode(&bytes).unwrap_err(), SavedMapError::Pose);
}

#[test]
fn more_records_than_there_are_bytes_take_no_memory() {
    let parts = seen(2).parts();
    let mut head = Head::of(&parts, &Isometry3::identity());
    head.points = u64::MAX;
    let mut bytes = encoded(&MapParts::default(), &Isometry3::identity()).unwrap();
    bytes.truncate(HEADER_BYTES);
    put(&mut bytes, &head).unwrap();
    for keyframe in &parts.keyframes {
        put(&mut bytes, &SavedKeyframe::from(keyframe)).unwrap();
    }
    let length = (bytes.len() - HEADER_BYTES) as u64;
    bytes[8..16].copy_from_slice(&length.to_le_bytes());
    bytes.extend([0; 4]);
    fix_checksum(&mut bytes);
    let error = SavedMap::decode(&bytes).unwrap_err();
    assert!(matches!(error, SavedMapError::Record { what: "point", index: 0, .. }), "{error}");
}

/// One of each thing, of numbers that every machine computes alike.
fn small() -> Map {
    let mut frame = (*blank_frame(2, 2)).clone();
    frame.corner_depths[0] = Some(MeasuredDepth { depth_m: 2.0, std_dev_m: 0.25 });
    frame.lines_in_space[1] = Some(SegmentInSpace {
        start_m: Point3::new(1.0, 2.0, 3.0),
        end_m: Point3::new(4.0, 5.0, 6.0),
        start_std_dev_m: 0.5,
        end_std_dev_m: 0.25,
        rms_m: 0.125,
        support: 1.0,
    });
    let frame = Arc::new(frame);
    let mut map = Map::new(MapConfig { scale_factor: 2.0, levels: 3 });
    let by_odometry = Some(ByOdometry {
        leg: 1,
        camera_from_odom: Isometry3::translation(0.0, 0.5, 0.0),
        travelled_m: 2.0,
        turned_rad: 0.25,
    });
    let first = NewKeyframe { by_odometry, ..blank(&frame) };
    let ids = [first, blank(&frame)].map(|new| map.insert_keyframe(new).unwrap());
    let ends = [Point3::new(0.0, 0.0, 2.0), Point3::new(1.0, 0.0, 2.0)];
    let point = map.insert_point(ids[0], 0, &ends[0]).unwrap();
    map.observe(ids[1], 1, point).unwrap();
    map.insert_line(ids[1], 0, &ends).unwrap();
    map.close_loop(ids[0], ids[1], &Isometry3::translation(1.0, 0.0, 0.0)).unwrap();
    map
}

/// When this fails, saved maps cannot be read any more: change [`VERSION`].
#[test]
fn version_1_is_as_it_was() {
    let bytes = SavedMap { map: small(), world_from_map: Isometry3::identity() }.encode().unwrap();
    let checksum = u32::from_le_bytes(*bytes.last_chunk().unwrap());
    assert_eq!((VERSION, bytes.len(), checksum), (1, 1274, 2_428_713_954));
}

/// Another pattern would find nothing again: [`DESCRIPTORS`] goes up with it.
#[test]
fn descriptors_compare_the_pixels_that_they_did() {
    let pattern = crate::feature::points::PATTERN;
    let bytes = pattern.as_flattened().iter().map(|coordinate| coordinate.cast_unsigned());
    let bytes: Vec<u8> = bytes.collect();
    assert_eq!((DESCRIPTORS, crc32fast::hash(&bytes)), (1, 2_932_745_373));
}

#[test]
fn a_keyframe_takes_about_a_hundred_kilobytes() {
    let poses = around(10, 0.1);
    let world = World::wall(2500, 500, 6.0, 1.0, 5);
    let (map, _) = world.map(&poses, 6);
    let bytes = saved(&map).encode().unwrap().len();
    let keyframes = || map.keyframes().iter().map(|(_, keyframe)| keyframe);
    let corners: usize = keyframes().map(|keyframe| keyframe.points().len()).sum();
    let segments: usize = keyframes().map(|keyframe| keyframe.lines().len()).sum();
    let landmarks = map.points().len() + map.lines().len();
    let each = (bytes / 10, corners / 10, segments / 10, landmarks / 10);
    eprintln!("bytes, corners, segments, landmarks a keyframe: {each:?}");
    // What each of them takes at most.
    assert!(bytes < 72 * corners + 138 * segments + 110 * landmarks + 200 * 10, "{each:?}");
}

/// A mapper that continues with the loaded map does the same as one that continues with the map itself.
#[test]
fn a_map_that_came_back_is_gone_on_with_alike() {
    let world = World::wall(500, 60, 6.0, 1.0, 7);
    let poses = around(9, 0.25);
    let (map, _) = world.map(&poses[..6], 8);
    let again = SavedMap::decode(&saved(&map).encode().unwrap()).unwrap().map;
    let config = MappingConfig::default();
    let mut mappers = [map, again].map(|map| Mapper::resume(config, map).unwrap());
    let mut random = Random::new(9);
    let looks = world.frame(&poses[3], &mut random).frame;
    let found = mappers.each_ref().map(|mapper| mapper.find(&looks, &kinect()).unwrap().1.pose);
    assert_eq!(found[0].camera_from_map, found[1].camera_from_map);
    let off = found[0].camera_from_map * poses[3].inverse();
    assert!((off * Point3::origin()).coords.norm() < 0.02, "{off}");
    for pose in &poses[6..] {
        let frame = world.frame(pose, &mut random).frame;
        let steps = mappers.each_mut().map(|mapper| {
            let new = NewKeyframe {
                camera: kinect(),
                camera_from_map: *pose,
                frame: Arc::clone(&frame),
                points: &[],
                lines: &[],
                by_odometry: None,
            };
            mapper.step(new, &|| false).map_err(|error: MapError| error.to_string())
        });
        assert_eq!(steps[0].as_ref().unwrap().taken_in, steps[1].as_ref().unwrap().taken_in);
    }
    assert_eq!(mappers[0].map().parts(), mappers[1].map().parts());
}

#[test]
fn a_map_with_other_levels_is_not_gone_on_with() {
    let mut config = MappingConfig::default();
    config.map.levels = 4;
    let error = Mapper::resume(config, seen(2)).unwrap_err().to_string();
    assert!(error.contains("8 levels") && error.contains("4 with 1.2"), "{error}");
}
