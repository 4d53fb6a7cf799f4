//! What clearing leaves of a room, and of what does not belong there.

use std::collections::BTreeMap;

use super::room::{EDGE_M, Numbers, Platform, Shape, is_thin, room, see, see_truly};
use super::*;

fn room_map(method: Method) -> StaticMap {
    let config = ReconstructionConfig {
        pipeline: PipelineConfig::new(method, EDGE_M),
        ..ReconstructionConfig::default()
    };
    StaticMap::new(config).unwrap()
}

/// A voxel belongs to the room, and was seen to, when its points are at least so many, and when so many rays of a
/// camera without noise end in it, taken in one of [`TRUTH_STEP`] cycles. Noise, and the means of cells at the
/// edge of a thing, put points into others too.
const HITS_OF_A_SURFACE: u32 = 10;
const TRUTH_STEP: usize = 10;

fn true_rays(platform: Platform, cycles: u32) -> BTreeMap<VoxelKey, u32> {
    let grid = VoxelGrid::new(EDGE_M).unwrap();
    let mut rays = BTreeMap::new();
    for number in (0..cycles).step_by(TRUTH_STEP) {
        for point in see_truly(&room(), platform, number) {
            *rays.entry(grid.key(&point)).or_default() += 1;
        }
    }
    rays
}

/// What a moving camera may lose of the thin things at a time; they come back with the next hit.
const MOST_LOST_OF_THIN: f64 = 0.03;

/// Sees the empty room so often, and checks that it is still there.
#[track_caller]
fn check_that_the_room_stays(platform: Platform, cycles: u32) {
    let (mut map, mut all) = (room_map(Method::FreeSpace), room_map(Method::RecHv));
    let mut numbers = Numbers::new(7);
    let shapes = room();
    let mut cleared = 0;
    for number in 0..cycles {
        let seen = see(&shapes, &[], platform, number, &mut numbers);
        cleared += map.integrate(&seen).unwrap().cleared_voxels;
        all.integrate(&seen).unwrap();
    }
    let rays = true_rays(platform, cycles);
    let is_surface = |key: &VoxelKey, points: u32| {
        let rays = rays.get(key).copied().unwrap_or_default();
        points.min(rays) >= HITS_OF_A_SURFACE
    };
    let surface: Vec<_> =
        all.voxels.iter().filter(|(key, voxel)| is_surface(key, voxel.points())).collect();
    let is_lost = |key: &VoxelKey| map.voxel(*key).is_none();
    let lost = surface.iter().filter(|(key, _)| is_lost(key)).count();
    let thin: Vec<_> = surface.iter().filter(|(_, voxel)| is_thin(&voxel.mean())).collect();
    let lost_thin = thin.iter().filter(|(key, _)| is_lost(key)).count();
    eprintln!(
        "{platform:?}: {lost} of {} voxels lost, {lost_thin} of {} thin ones; {cleared} cleared in all, {} and {} voxels",
        surface.len(),
        thin.len(),
        map.len(),
        all.len(),
    );
    assert!(thin.len() > 30, "{} thin voxels", thin.len());
    assert!(lost as f64 <= 0.005 * surface.len() as f64);
    assert!(lost_thin as f64 <= MOST_LOST_OF_THIN * thin.len() as f64);
}

#[test]
fn a_room_and_its_thin_things_stay() {
    check_that_the_room_stays(Platform::Still, 400);
    check_that_the_room_stays(Platform::Moving, 400);
}

/// Sees the room with a thing for `hits` cycles, as if it were still, and then without it; returns how many of its
/// voxels there were, and how many are left after each cycle without it.
fn ghosts(thing: Shape, platform: Platform, hits: u32) -> (usize, Vec<usize>) {
    let mut numbers = Numbers::new(3);
    let mut map = room_map(Method::FreeSpace);
    let mut empty = room_map(Method::RecHv);
    let shapes = room();
    let with_thing: Vec<Shape> = shapes.iter().copied().chain([thing]).collect();
    for number in 0..50 {
        let seen = see(&shapes, &[], platform, number, &mut numbers);
        map.integrate(&seen).unwrap();
        empty.integrate(&seen).unwrap();
    }
    for number in 50..50 + hits {
        map.integrate(&see(&with_thing, &[], platform, number, &mut numbers)).unwrap();
    }
    // Whatever stands farther from the room than its noise.
    let grid = VoxelGrid::new(EDGE_M).unwrap();
    let is_ghost = |map: &StaticMap, empty: &StaticMap| {
        let is_of_room =
            |key: &VoxelKey| key.with_neighbours().any(|near| empty.voxel(near).is_some());
        map.points().iter().filter(|point| !is_of_room(&grid.key(point))).count()
    };
    let at_first = is_ghost(&map, &empty);
    let left = (0..60)
        .map(|number| {
            let seen = see(&shapes, &[], platform, 50 + hits + number, &mut numbers);
            map.integrate(&seen).unwrap();
            empty.integrate(&seen).unwrap();
            is_ghost(&map, &empty)
        })
        .collect();
    (at_first, left)
}

/// A person before the walls and the floor.
const PERSON: Shape = Shape::Post([2.0, -0.1, -0.9, 0.8, 0.2]);
/// A box that nearly touches the wall.
const BOX: Shape = Shape::Cuboid([3.4, 0.6, -0.9], [4.2, 1.3, 0.2]);

#[test]
fn a_person_in_the_map_goes_after_five_cycles() {
    for platform in [Platform::Still, Platform::Moving] {
        for hits in [1, 2] {
            let (at_first, left) = ghosts(PERSON, platform, hits);
            eprintln!("{platform:?}, {hits} hits: {at_first} ghosts, then {left:?}");
            assert!(at_first > 100);
            // The moving camera looks away from some and comes back within 45 cycles.
            assert_eq!(left[if platform == Platform::Still { 4 } else { 50 }], 0);
        }
    }
}

#[test]
fn a_box_that_stood_long_goes_but_for_a_twentieth_after_ten_cycles() {
    for platform in [Platform::Still, Platform::Moving] {
        let (at_first, left) = ghosts(BOX, platform, 30);
        eprintln!("{platform:?}: {at_first} ghosts, then {left:?}");
        assert!(at_first > 100);
        // Of what is near the wall some voxels lie between the rays' axes, and wait for the noise or for another
        // place of the camera.
        assert!(left[if platform == Platform::Still { 9 } else { 50 }] * 20 <= at_first);
    }
}
