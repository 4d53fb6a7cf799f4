//! Files of any edge, with and without normals.

use geometry::{VoxelGrid, VoxelKey};

use super::*;
use crate::LoadError;

#[test]
fn a_saved_map_is_loaded_and_goes_on_growing() {
    let rig = rig_at(0.0, 0.0);
    let mut map = map(0.04);
    map.integrate(&cycle(&Scene::room(), 0, &rig, None)).unwrap();
    let whole = map.whole();
    let mut loaded = super::map(0.04);
    loaded.replace(&whole.points.points_m, &whole.points.normals, "map").unwrap();
    let (before, after) = (whole.points.points_m.len(), loaded.points().len());
    assert!(after as f64 > 0.95 * before as f64, "{after} of {before} points");
    for index in 0..10 {
        loaded.integrate(&cycle(&Scene::room(), index, &rig, None)).unwrap();
    }
    let off_m: Vec<f64> =
        points(&loaded).iter().map(|(point, _)| Scene::room().nearest(point).0).collect();
    // Where two walls meet, the planes of the points reach a little beyond.
    let stray = off_m.iter().filter(|off_m| **off_m > 0.02).count();
    assert!(stray <= off_m.len() / 200, "{stray} of {} points", off_m.len());
    assert!(median(off_m) < 0.002);
}

/// It was said that the map has too many blocks, and not what would be enough.
#[test]
fn a_map_of_too_many_blocks_is_refused_with_how_many_it_needs() {
    let mut map = map(0.04);
    map.integrate(&cycle(&Scene::room(), 0, &rig_at(0.0, 0.0), None)).unwrap();
    let whole = map.whole().points;
    let load = |max_map_blocks: usize| {
        let mut map =
            Map::new(ReconstructionConfig { max_map_blocks, ..config(0.04) }, None).unwrap();
        let loaded = map.replace(&whole.points_m, &whole.normals, "map");
        (loaded, map.is_empty())
    };
    let (Err(LoadError::TooManyBlocks { blocks, max_map_blocks: 3 }), true) = load(3) else {
        panic!("it is loaded")
    };
    let refused = load(blocks - 1);
    assert_eq!(refused.0, Err(LoadError::TooManyBlocks { blocks, max_map_blocks: blocks - 1 }));
    assert_eq!(load(blocks).0.unwrap().new_voxels, blocks);
}

/// A wall 3 m wide and high, 2 m away, which stands obliquely to the grid.
fn oblique_wall(step_m: f64) -> (Vec<Point3<f32>>, Vector3<f64>) {
    let across = Vector3::new(0.3_f64, 0.94, 0.1).normalize();
    let up = Vector3::new(0.2_f64, 0.0, 1.0);
    let up = (up - up.dot(&across) * across).normalize();
    let steps = (3.0_f64 / step_m).round() as i32;
    let along = |step: i32| (f64::from(step) + 0.5) * step_m - 1.5;
    let points = (0..steps).flat_map(|row| {
        (0..steps).map(move |column| {
            let from_middle: Vector3<f64> = across * along(column) + up * along(row);
            (Point3::new(2.0, 0.0, 0.5) + from_middle).cast::<f32>()
        })
    });
    (points.collect::<Vec<Point3<f32>>>(), across.cross(&up))
}

/// The share of the wall with a point of the map within an edge and a half, and the farthest that a point is off the wall.
fn covered(map: &Map) -> (f64, f64) {
    let (wall, normal) = oblique_wall(0.02);
    let on_wall = wall[0].cast::<f64>();
    let points = points(map);
    let off_m = points.iter().map(|(point, _)| (point - on_wall).dot(&normal).abs());
    let grid = VoxelGrid::new(1.5 * map.grid().edge_m()).unwrap();
    let occupied: std::collections::HashSet<VoxelKey> =
        points.iter().map(|(point, _)| grid.key(point)).collect();
    let is_covered =
        |place: &&Point3<f32>| grid.key(place).with_neighbours().any(|key| occupied.contains(&key));
    let covered = wall.iter().filter(is_covered).count();
    (covered as f64 / wall.len() as f64, off_m.fold(0.0, f64::max))
}

/// Regression: points whose normal is no number, as PCL writes them where too few others are near, were lost, and not counted.
#[test]
fn points_without_a_normal_of_their_own_are_loaded_too() {
    let (wall, normal) = oblique_wall(0.02);
    for (every, none) in [(1, f32::NAN), (2, f32::NAN), (2, 0.0), (7, f32::INFINITY)] {
        let mut normals = vec![normal.cast::<f32>(); wall.len()];
        normals.iter_mut().step_by(every).for_each(|normal| *normal = Vector3::repeat(none));
        let mut map = super::map(0.02);
        map.replace(&wall, &normals, "map").unwrap();
        let (share, off_m) = covered(&map);
        assert!(share > 0.99 && off_m < 2e-3, "every {every}: {share:.3}, {off_m:.4} m");
        let left = map.points().len() as f64 / wall.len() as f64;
        assert!(left > 0.95, "every {every}: {left:.2} of the points");
    }
}

#[test]
fn a_file_of_another_edge_has_no_gaps_with_or_without_normals() {
    for (file_edge_m, map_edge_m) in
        [(0.02, 0.02), (0.1, 0.02), (0.25, 0.02), (0.08, 0.05), (0.02, 0.1)]
    {
        let (wall, normal) = oblique_wall(file_edge_m);
        for normals in [vec![normal.cast(); wall.len()], Vec::new()] {
            let mut map = super::map(map_edge_m);
            map.replace(&wall, &normals, "map").unwrap();
            let (share, off_m) = covered(&map);
            let words = format!(
                "{file_edge_m} m into {map_edge_m} m: {share:.3} covered, off by {off_m:.4} m"
            );
            println!("{words}, {} points", map.points().len());
            assert!(share > 0.99 && off_m < 0.1 * map_edge_m, "{words}");
        }
    }
}

/// An octomap has the centres of its voxels alone: a wall that stands obliquely is steps in it.
#[test]
fn an_octomap_of_10_cm_is_a_surface_at_2_cm() {
    let grid = VoxelGrid::new(0.1).unwrap();
    let (wall, normal) = oblique_wall(0.01);
    let mut voxels: Vec<VoxelKey> = wall.iter().map(|point| grid.key(point)).collect();
    voxels.sort_unstable();
    voxels.dedup();
    let centres: Vec<Point3<f32>> = voxels.iter().map(|key| grid.middle_m(*key).cast()).collect();
    let mut map = super::map(0.02);
    map.replace(&centres, &[], "map").unwrap();
    let (share, off_m) = covered(&map);
    let on_wall = wall[0].cast::<f64>();
    let off: Vec<f64> =
        points(&map).iter().map(|(point, _)| (point - on_wall).dot(&normal).abs()).collect();
    let turned: Vec<f64> = points(&map)
        .iter()
        .map(|(_, own)| own.dot(&normal).abs().clamp(0.0, 1.0).acos().to_degrees())
        .collect();
    let (median_off_m, median_turned) = (median(off), median(turned));
    println!(
        "{} voxels, {} points: {share:.3} of the wall covered, off by {median_off_m:.3} m, {off_m:.3} m at most; turned by \
         {median_turned:.1} degrees",
        voxels.len(),
        map.points().len()
    );
    // A point of the octomap is up to half a diagonal of its voxels off.
    assert!(share > 0.9 && median_off_m < 0.05 && off_m < 0.1, "{share}, {off_m}");
    assert!(median_turned < 22.0, "{median_turned}");
}

/// A map of means, as it was saved before: its points are as far apart as voxels, and off by their noise.
#[test]
fn a_map_of_means_is_loaded_and_the_camera_corrects_it() {
    let rig = rig_at(0.0, 0.0);
    let mut random = Random::new(5);
    let mut seen = super::map(0.02);
    for index in 0..3 {
        seen.integrate(&cycle(&Scene::room(), index, &rig, Some(&mut random))).unwrap();
    }
    let means = VoxelGrid::new(0.08).unwrap().reduce(&seen.points());
    let mut map = super::map(0.02);
    map.replace(&means, &[], "map").unwrap();
    let scene = Scene::room();
    let off =
        |map: &Map| median(points(map).iter().map(|(point, _)| scene.nearest(point).0).collect());
    let around = VoxelGrid::new(0.04).unwrap();
    let loaded: std::collections::HashSet<VoxelKey> =
        map.points().iter().map(|point| around.key(point)).collect();
    let is_covered =
        |point: &&Point3<f32>| around.key(point).with_neighbours().any(|key| loaded.contains(&key));
    let (all, off_m) = (seen.points(), off(&map));
    let share = all.iter().filter(is_covered).count() as f64 / all.len() as f64;
    println!("{} means: {share:.3} of the surface, off by {off_m:.4} m", means.len());
    assert!(share > 0.95 && off_m < 0.01, "{share}, {off_m}");
    for index in 0..20 {
        map.integrate(&cycle(&scene, index, &rig, Some(&mut random))).unwrap();
    }
    let stray = points(&map).iter().filter(|(point, _)| scene.nearest(point).0 > 0.04).count();
    println!("then off by {:.4} m, {stray} of {} points astray", off(&map), map.points().len());
    assert!(off(&map) < 0.004 && stray * 100 < map.points().len());
}

/// Whatever a file has: the cost is bounded, and nothing is a panic.
#[test]
fn points_that_are_no_surface_have_a_bounded_cost() {
    let place = Point3::new(1.0_f32, 2.0, 0.5);
    let far = Point3::new(3.0e38_f32, -3.0e38, 1.0);
    let nothing = Point3::new(f32::NAN, 0.0, f32::INFINITY);
    let line: Vec<_> = (0..300_u16).map(|z| place + Vector3::z() * (0.01 * f32::from(z))).collect();
    for (points, least) in [
        (vec![], 0),
        (vec![nothing; 9], 0),
        (vec![place], 1),
        (vec![place; 1_000_000], 1),
        (vec![place, far, nothing], 1),
        (vec![far; 5], 0),
        (line, 150),
    ] {
        let mut map = super::map(0.02);
        map.replace(&points, &[], "map").unwrap();
        let loaded = map.points().len();
        assert!(loaded >= least && loaded < 20 * least.max(1) + 1_200, "{loaded}");
        assert!(least > 0 || loaded == 0, "{loaded}");
    }
}
