//! Blocks as bytes, corrections, and what listeners are told.

use std::collections::BTreeMap;

use geometry::{Stamp, VoxelKey};

use super::*;
use crate::block::BlockBox;
use crate::surface::{BlockFormatError, ChangeFollower};

fn seen() -> Surface {
    let camera = testing::camera(160, 120);
    let mut surface = surface(0.05);
    for step in 0..3 {
        let pose = testing::pose([0.03 * f64::from(step), 0.0, 0.0], [0.0, 0.1, 0.0]);
        let view = testing::view_of_scene(&Scene::room(), &camera, &pose, f64::from(step));
        surface.integrate(&view, &Serial);
    }
    surface
}

/// The number of points with none of the others within a distance.
fn apart(points: &[SurfacePoint], others: &[SurfacePoint], distance_m: f32) -> usize {
    let is_near = |a: &SurfacePoint, b: &SurfacePoint| {
        (a.position_m - b.position_m).norm_squared() <= distance_m * distance_m
    };
    points.iter().filter(|point| !others.iter().any(|other| is_near(point, other))).count()
}

fn with_normals(points: &[SurfacePoint]) -> Vec<(Point3<f32>, nalgebra::Vector3<f32>)> {
    points.iter().map(|point| (point.position_m, point.normal)).collect()
}

#[test]
fn points_with_normals_give_the_surface_that_they_are_of() {
    let camera = testing::camera(320, 240);
    let mut seen = surface(0.03);
    for step in 0..3 {
        let view = testing::view_of_scene(
            &Scene::room(),
            &camera,
            &Isometry3::identity(),
            f64::from(step),
        );
        seen.integrate(&view, &Serial);
    }
    let before = points(&seen);
    let mut put = surface(0.03);
    let refused = put.put_points(with_normals(&before), 0.0, BlockBox::ALL);
    assert_eq!(refused, 0);
    let after = points(&put);
    let off = |point: &SurfacePoint| Scene::room().nearest(&point.position_m.cast()).0;
    let mean_m =
        |points: &[SurfacePoint]| points.iter().map(off).sum::<f64>() / points.len() as f64;
    assert!(mean_m(&after) < mean_m(&before) + 0.002, "{} and {}", mean_m(&after), mean_m(&before));
    // Each point that was there is there again.
    let grid: std::collections::HashSet<_> = after.iter().map(|point| point.voxel).collect();
    let kept = before.iter().filter(|point| grid.contains(&point.voxel)).count();
    assert!(kept as f64 > 0.95 * before.len() as f64, "{kept} of {}", before.len());
    assert!(
        (after.len() as f64) < 1.15 * before.len() as f64,
        "{} of {}",
        after.len(),
        before.len()
    );
    // A map that is corrected leaves it where it is.
    let moved = put.corrected(|_| Isometry3::translation(1.0, 0.0, 0.0));
    assert_eq!(points(&moved), after);
    let nothing = [
        (Point3::origin(), nalgebra::Vector3::zeros()),
        (Point3::new(f32::NAN, 0.0, 0.0), nalgebra::Vector3::x()),
    ];
    assert_eq!((put.put_points(nothing, 0.0, BlockBox::ALL), put.blocks()), (0, put.blocks()));
    let mut small = Surface::new(SurfaceConfig { max_blocks: 3, ..config(0.03) }).unwrap();
    assert!(small.put_points(with_normals(&before), 0.0, BlockBox::ALL) > 0);
    assert_eq!(small.blocks(), 3);
}

/// A floor at a height of whole voxels is a plane through their corners.
#[test]
fn points_on_the_faces_of_voxels_are_a_surface() {
    let floor = (0..40_u8).flat_map(|x| (0..40_u8).map(move |y| (x, y)));
    let floor: Vec<_> = floor
        .map(|(x, y)| {
            let place = Point3::new(0.05 * f32::from(x), 0.05 * f32::from(y), 0.1);
            (place, nalgebra::Vector3::z())
        })
        .collect();
    let mut put = surface(0.05);
    assert_eq!(put.put_points(floor.clone(), 0.05, BlockBox::ALL), 0);
    let after = points(&put);
    assert!(after.iter().all(|point| (point.position_m.z - 0.1).abs() < 1e-3));
    assert!(after.len() >= floor.len(), "{} of {}", after.len(), floor.len());
}

/// Each reload added a rim of two voxels to the borders of the map: after 20 of them this one had 17 times its points.
#[test]
fn a_map_that_is_saved_and_loaded_again_and_again_does_not_grow() {
    let first = points(&seen());
    let mut now = first.clone();
    for _ in 0..20 {
        let mut put = surface(0.05);
        assert_eq!(put.put_points(with_normals(&now), 0.05, BlockBox::ALL), 0);
        now = points(&put);
    }
    assert!(now.iter().all(|point| geometry::is_finite(&point.position_m)));
    // Not by voxels: a wall that lies on the faces of voxels has its points now on this side, now on that.
    let edge_m = 0.05;
    let (new, lost) = (apart(&now, &first, edge_m), apart(&first, &now, edge_m));
    println!("{} points, after 20 reloads {new} new and {lost} lost", first.len());
    // Where two walls meet the planes of their points reach into each other's voxels.
    assert!(
        new.max(lost) <= first.len() / 100,
        "of {} points {new} are new, {lost} lost",
        first.len()
    );
    assert!(
        now.len().abs_diff(first.len()) <= first.len() / 50,
        "{} of {}",
        now.len(),
        first.len()
    );
    let now_m = now.iter().map(|point| Scene::room().nearest(&point.position_m.cast()).0);
    let before_m = first.iter().map(|point| Scene::room().nearest(&point.position_m.cast()).0);
    let mean_m = |off_m: Vec<f64>| off_m.iter().sum::<f64>() / off_m.len() as f64;
    let (now_m, before_m) = (mean_m(now_m.collect()), mean_m(before_m.collect()));
    assert!(now_m < before_m + 0.002, "{now_m} m off the room, {before_m} m before");
}

#[test]
fn a_surface_comes_back_from_its_bytes_to_the_bit() {
    let mut before = seen();
    let mut after = surface(0.05);
    let view =
        testing::view_of(&testing::camera(8, 6), &Isometry3::identity(), 0.0, vec![0.0; 48], None);
    after.integrate(&view, &Serial);
    for key in before.block_keys() {
        let bytes = before.block_bytes(key).unwrap();
        assert_eq!(after.put_block(&bytes), Ok(key));
    }
    assert!(contents(&before) == contents(&after));
    let oldest = before.oldest_blocks(10);
    assert_eq!(oldest.len(), 10);
    let last = |key: &BlockKey| before.seen(*key).unwrap().1;
    assert!(oldest.windows(2).all(|pair| last(&pair[0]) <= last(&pair[1])));
    assert!(before.remove_block(oldest[0]) && !before.remove_block(oldest[0]));
    assert_eq!(before.block_bytes(oldest[0]), None);
}

#[test]
fn bytes_that_are_no_block_are_refused() {
    let before = seen();
    let bytes = before.block_bytes(before.block_keys()[0]).unwrap();
    let mut surface = surface(0.05);
    let mut refused = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = bytes.clone();
        change(&mut bytes);
        surface.put_block(&bytes).unwrap_err()
    };
    assert_eq!(refused(&|bytes| bytes[0] = 0), BlockFormatError::NotThisFormat);
    assert_eq!(refused(&|bytes| bytes[4] = 9), BlockFormatError::OtherVersion { version: 9 });
    assert_eq!(refused(&|bytes| bytes.truncate(100)), BlockFormatError::Length);
    assert_eq!(refused(&|bytes| bytes.push(0)), BlockFormatError::Length);
    assert!(matches!(refused(&|bytes| bytes[8] ^= 1), BlockFormatError::OtherVoxels { .. }));
    assert_eq!(refused(&|bytes| bytes.clear()), BlockFormatError::NotThisFormat);
    let mut full = Surface::new(SurfaceConfig { max_blocks: 1, ..config(0.05) }).unwrap();
    full.put_block(&bytes).unwrap();
    let another = before.block_bytes(before.block_keys()[1]).unwrap();
    assert_eq!(full.put_block(&another), Err(BlockFormatError::Full { max_blocks: 1 }));
}

#[test]
fn a_correction_moves_the_surface_and_keeps_what_stays() {
    let before = seen();
    let stays = before.corrected(|_| Isometry3::identity());
    assert!(contents(&before) == contents(&stays));
    assert_eq!(stays.near_nodes(), before.near_nodes());
    let motion = testing::pose([0.23, -0.11, 0.07], [0.02, -0.05, 0.1]);
    let moved = before.corrected(|_| motion);
    let (old, new) = (points(&before), points(&moved));
    let moved_old: Vec<SurfacePoint> = old
        .iter()
        .map(|point| {
            let position_m = (motion * point.position_m.cast::<f64>()).cast();
            SurfacePoint { position_m, ..*point }
        })
        .collect();
    // At the borders of what was seen not all nodes of a cell come along.
    let (gone, come) = (apart(&moved_old, &new, 0.06), apart(&new, &moved_old, 0.06));
    println!("of {} points {gone} are gone; of {} {come} have come", old.len(), new.len());
    assert!(
        gone.max(come) <= old.len() / 50,
        "of {} points {gone} are gone, {come} new",
        old.len()
    );
    let scene = Scene::room();
    let off_m = |point: &SurfacePoint| {
        scene.nearest(&(motion.inverse() * point.position_m.cast::<f64>())).0
    };
    let mut errors_m: Vec<f64> = new.iter().map(off_m).collect();
    errors_m.sort_by(f64::total_cmp);
    assert!(errors_m[errors_m.len() / 2] < 0.003, "{}", errors_m[errors_m.len() / 2]);
    assert!(errors_m[errors_m.len() * 95 / 100] < 0.02, "{}", errors_m[errors_m.len() * 95 / 100]);
    // Only what was seen from the second image on.
    let kept = before
        .corrected(|stamp| if stamp > Stamp::default() { motion } else { Isometry3::identity() });
    let first = contents(&before).into_iter().filter(|(_, block)| block.first_seen == 1).count();
    assert!(first > 0 && kept.blocks() >= first);
}

/// Applies what a listener is told.
fn tell(
    listener: &mut BTreeMap<VoxelKey, Point3<f32>>,
    follower: &mut ChangeFollower,
    surface: &Surface,
    most_points: usize,
) -> usize {
    let changes = follower.take(surface, PointRules::default(), most_points);
    for point in &changes.updated {
        listener.insert(point.voxel, point.position_m);
    }
    for voxel in &changes.removed {
        assert!(listener.remove(voxel).is_some(), "it was told of {voxel:?}");
    }
    changes.updated.len() + changes.removed.len()
}

#[test]
fn a_listener_that_was_told_of_all_changes_has_the_surface() {
    let camera = testing::camera(160, 120);
    let ball = |x| Scene { balls: vec![(Point3::new(x, 0.0, 1.5), 0.2)], ..Scene::wall(3.0) };
    let mut surface = surface(0.05);
    let (mut follower, mut listener) = (ChangeFollower::default(), BTreeMap::new());
    for step in 0..40 {
        let scene = if step < 15 { ball(0.0) } else { ball(0.4) };
        let mut depths_m = scene.depths_m(&camera, &Isometry3::identity());
        let mut noise = testing::Noise::new(step);
        depths_m.iter_mut().for_each(|depth_m| *depth_m += 0.01 * noise.normal() as f32);
        let view = testing::view_of(&camera, &Isometry3::identity(), step as f64, depths_m, None);
        surface.integrate(&view, &Serial);
        follower.follow(&surface);
        let told = tell(&mut listener, &mut follower, &surface, 200);
        assert!(told <= 200 + 512);
    }
    while follower.waiting() > 0 {
        tell(&mut listener, &mut follower, &surface, 200);
    }
    let points = points(&surface);
    assert_eq!(listener.len(), points.len());
    for point in points {
        let known = listener[&point.voxel];
        assert!((known - point.position_m).norm() <= 0.05 / 16.0, "{point:?}: {known:?}");
    }
    for key in surface.block_keys() {
        surface.remove_block(key);
        follower.follow_block(key);
    }
    while follower.waiting() > 0 {
        tell(&mut listener, &mut follower, &surface, 1000);
    }
    assert!(listener.is_empty() && follower.memory_bytes() > 0);
}
