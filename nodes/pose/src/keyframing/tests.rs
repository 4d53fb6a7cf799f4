//! Rules on maps of a wall whose truth is known.

use std::sync::Arc;

use super::*;
use crate::map::testing::{PLACE_M, World, around, blank_map};
use crate::map::{FoundTimes, Map, MapConfig, MapPoint, NewKeyframe, PointId};
use crate::solve::testing::{Random, kinect};

fn insert(map: &mut Map, world: &World, pose: &nalgebra::Isometry3<f64>, seed: u64) -> KeyframeId {
    let shown = world.frame(pose, &mut Random::new(seed));
    let new = NewKeyframe {
        camera: kinect(),
        camera_from_map: *pose,
        frame: Arc::clone(&shown.frame),
        points: &[],
        lines: &[],
        by_odometry: None,
    };
    map.insert_keyframe(new).unwrap()
}

/// How far a point of the map is from the nearest of the world.
fn off_m(world: &World, point: &MapPoint) -> f64 {
    let off = world.points.iter().map(|(place, _)| (place - point.position_m()).norm());
    off.fold(f64::INFINITY, f64::min)
}

#[test]
fn features_become_landmarks_where_their_depths_have_them() {
    let world = World::wall(300, 30, 6.0, 1.0, 1);
    let mut map = Map::new(MapConfig::default());
    let pose = around(1, 0.0)[0];
    let keyframe = insert(&mut map, &world, &pose, 2);
    let measured = {
        let frame = map.keyframes().get(keyframe).unwrap().frame();
        frame.measured_corners() + frame.measured_lines()
    };
    let created = create_measured(&mut map, keyframe);
    assert_eq!((created, measured), (map.points().len() + map.lines().len(), created));
    assert!(map.points().len() > 40 && !map.lines().is_empty());
    for (_, point) in map.points().iter() {
        // A Kinect's depth at 6 m, four standard deviations.
        assert!(off_m(&world, point) < 0.25, "{}", off_m(&world, point));
    }
    assert_eq!(map.check(), Ok(()));
    assert_eq!(create_measured(&mut map, keyframe), 0, "they are there already");
}

#[test]
fn corners_without_depth_are_triangulated_where_they_are() {
    let world = World::wall(400, 0, 6.0, 0.5, 3);
    let poses = around(3, 0.3);
    let mut map = Map::new(MapConfig::default());
    let ids: Vec<KeyframeId> =
        (0..3).map(|at| insert(&mut map, &world, &poses[at], at as u64)).collect();
    // They are neighbours by a few points that all see.
    let config = KeyframingConfig::default();
    let mut shared = 0;
    let corners =
        |map: &Map, at: usize| map.keyframes().get(ids[at]).unwrap().frame().corners.clone();
    let (first, second, third) = (corners(&map, 0), corners(&map, 1), corners(&map, 2));
    for (at, corner) in first.iter().enumerate() {
        let same = |others: &[crate::feature::points::Corner]| {
            others.iter().position(|other| other.descriptor.distance(&corner.descriptor) < 60)
        };
        let Some((two, three)) = same(&second).zip(same(&third)) else { continue };
        let depth = map.keyframes().get(ids[0]).unwrap().frame().corner_depths[at].unwrap();
        let ray = kinect().ray(&corner.pixel.cast()).unwrap().push(1.0);
        let place = poses[0].inverse() * nalgebra::Point3::from(ray * depth.depth_m);
        let point = map.insert_point(ids[0], at, &place).unwrap();
        map.observe(ids[1], two, point).unwrap();
        map.observe(ids[2], three, point).unwrap();
        shared += 1;
        if shared == 20 {
            break;
        }
    }
    let made = triangulate(&mut map, ids[2], &config);
    assert!(made > 60, "{made}");
    assert_eq!(map.check(), Ok(()));
    let news: Vec<f64> = map
        .points()
        .iter()
        .filter(|(_, point)| point.sightings().born() == 2)
        .map(|(_, point)| off_m(&world, point))
        .collect();
    assert_eq!(news.len(), made);
    // Half a pixel over 0.3 m at 4 m is 5 cm, and more across 0.3 m only.
    let good = news.iter().filter(|off| **off < 0.2).count();
    assert!(good as f64 > 0.95 * made as f64, "{good} of {made}");
}

#[test]
fn landmarks_that_two_keyframes_made_of_one_thing_become_one() {
    let world = World::wall(300, 30, 6.0, 1.0, 5);
    let poses = around(4, 0.15);
    let (mut map, ids) = world.map(&poses[..3], 6);
    let (points, lines) = (map.points().len(), map.lines().len());
    // The fourth has its own of everything, but for some corners by which it is a neighbour.
    let shown = world.frame(&poses[3], &mut Random::new(7));
    let third = map.keyframes().get(ids[2]).unwrap();
    let known: Vec<(usize, PointId)> = shown
        .frame
        .corners
        .iter()
        .enumerate()
        .filter_map(|(at, corner)| {
            let like = |id: &PointId| {
                map.points().get(*id).unwrap().look().descriptor.distance(&corner.descriptor) < 60
            };
            Some((at, third.points().iter().flatten().copied().find(like)?))
        })
        .take(20)
        .collect();
    let new = NewKeyframe {
        camera: kinect(),
        camera_from_map: poses[3],
        frame: Arc::clone(&shown.frame),
        points: &known,
        lines: &[],
        by_odometry: None,
    };
    let keyframe = map.insert_keyframe(new).unwrap();
    let config = KeyframingConfig::default();
    create_measured(&mut map, keyframe);
    let twice = map.points().len() - points;
    assert!(twice > 60 && map.lines().len() > lines);
    let fused = fuse_duplicates(&mut map, keyframe, &config);
    println!("{twice} points twice, {fused:?}");
    assert_eq!(map.check(), Ok(()));
    // What is left twice was too far off for its place in the image: 3 pixels.
    assert!(map.points().len() < points + twice / 4, "{} {points} {twice}", map.points().len());
    // Nothing that is two became one.
    for (_, point) in map.points().iter() {
        let mut looks = point.sightings().iter().map(|(keyframe, corner)| {
            map.keyframes().get(keyframe).unwrap().frame().corners[corner].descriptor
        });
        let first = looks.next().unwrap();
        assert!(looks.all(|look| look.distance(&first) < 60));
    }
}

#[test]
fn recent_landmarks_must_prove_themselves() {
    let (mut map, ids) = blank_map(3);
    let config = KeyframingConfig::default();
    // Born with the last keyframe but two, the last but one, and long ago.
    let old = map.insert_point(ids[0], 0, &PLACE_M).unwrap();
    let seen_by_all = map.insert_point(ids[0], 1, &PLACE_M).unwrap();
    for id in &ids[1..] {
        map.observe(*id, 1, seen_by_all).unwrap();
    }
    let young = map.insert_point(ids[1], 2, &PLACE_M).unwrap();
    let missed = map.insert_point(ids[2], 3, &PLACE_M).unwrap();
    for found in [true, false, false, false] {
        map.count_predicted(missed, FoundTimes::once(found));
    }
    let line = map.insert_line(ids[0], 0, &[PLACE_M, nalgebra::Point3::origin()]).unwrap();
    assert_eq!(cull_recent(&mut map, &config), 3);
    assert!(!map.points().contains(old) && !map.points().contains(missed));
    assert!(map.points().contains(seen_by_all) && map.points().contains(young));
    assert!(!map.lines().contains(line));
    // Later it is not checked any more.
    let frame = crate::map::testing::blank_frame(10, 5);
    map.cull_landmark(young).unwrap();
    let kept = map.insert_point(ids[2], 5, &PLACE_M).unwrap();
    for _ in 0..4 {
        map.insert_keyframe(crate::map::testing::blank(&frame)).unwrap();
    }
    assert_eq!(cull_recent(&mut map, &config), 0);
    assert!(map.points().contains(kept));
}

#[test]
fn keyframes_that_say_nothing_new_go_and_their_number_stays_bounded() {
    let world = World::wall(200, 0, 3.0, 1.0, 9);
    // The camera goes to and fro before the same wall.
    let poses: Vec<_> = (0..30).map(|at| around(5, 0.05)[at % 5]).collect();
    let (mut map, ids) = world.map(&poses, 10);
    let config = KeyframingConfig::default();
    assert!(is_redundant(&map, ids[10], &config));
    let culled = cull_keyframes(&mut map, ids[29], &config);
    println!("{} of 30 keyframes go", culled.len());
    assert!(culled.len() > 20 && map.keyframes().len() >= 3);
    assert!(map.keyframes().contains(ids[0]) && map.keyframes().contains(ids[29]));
    assert_eq!(map.check(), Ok(()));
    // One that sees what others do not stays.
    let world = World::wall(400, 0, 10.0, 1.0, 12);
    let far = around(1, 0.0)[0] * nalgebra::Isometry3::translation(-3.0, 0.0, 0.0);
    let (map, ids) = world.map(&[poses[0], poses[1], poses[2], poses[3], far], 11);
    assert!(!is_redundant(&map, ids[4], &config));
}

/// Nothing was close, and so nothing said anything but new.
#[test]
fn keyframes_of_a_hall_whose_walls_are_far_off_go_too() {
    let config = KeyframingConfig::default();
    let world = World::wall(200, 0, 2.0 * config.close_m(), 1.0, 13);
    let poses: Vec<_> = (0..10).map(|at| around(5, 0.05)[at % 5]).collect();
    let (map, ids) = world.map(&poses, 14);
    assert!(is_redundant(&map, ids[5], &config));
    // Nor do lines that no other sees.
    let world = World::wall(10, 60, 2.0 * config.close_m(), 1.0, 15);
    let (mut map, ids) = world.map(&poses, 16);
    assert!(is_redundant(&map, ids[2], &config));
    let lines: Vec<_> =
        map.keyframes().get(ids[2]).unwrap().lines().iter().flatten().copied().collect();
    for (line, other) in lines.iter().flat_map(|line| ids.iter().map(move |id| (line, id))) {
        if *other != ids[2] {
            map.unobserve(*other, *line).unwrap();
        }
    }
    assert!(!is_redundant(&map, ids[2], &config));
}

#[test]
fn the_defaults_are_valid_and_bad_values_are_named() {
    let valid = KeyframingConfig::default();
    assert_eq!(valid.validate(), Ok(()));
    for (name, config) in [
        ("max_tracked_share", KeyframingConfig { max_tracked_share: 1.5, ..valid }),
        ("baseline_m", KeyframingConfig { baseline_m: 0.0, ..valid }),
        ("scale_consistency", KeyframingConfig { scale_consistency: 0.5, ..valid }),
    ] {
        assert!(config.validate().unwrap_err().to_string().contains(&format!("parameter {name} ")));
    }
}
