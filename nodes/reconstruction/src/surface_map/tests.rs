mod colours;
mod distance;
mod far;
mod loading;
mod mesh;
mod retracted;
mod rules;
pub(crate) mod scene;
mod second_day;
mod spilling;
mod views;

use std::sync::Arc;

use estimation::Random;
use geometry::{MaskedDepth, SegmentedCycle};
use nalgebra::{Isometry3, Point3, Vector3};

use self::scene::{Scene, cycle, near, path_at, rig_at};
use crate::{Map, ReconstructionConfig};

fn config(map_edge_m: f64) -> ReconstructionConfig {
    let mut config = ReconstructionConfig::default();
    config.pipeline.map_edge_m = map_edge_m;
    config
}

fn map(map_edge_m: f64) -> Map {
    Map::new(config(map_edge_m), None).unwrap()
}

/// The points of the map with their normals.
fn points(map: &Map) -> Vec<(Point3<f64>, Vector3<f64>)> {
    let whole = map.whole();
    assert_eq!(whole.points.points_m.len(), whole.points.normals.len());
    let normals = whole.points.normals.iter().map(|normal| normal.cast());
    whole.points.points_m.iter().map(|point| point.cast()).zip(normals).collect()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn points_lie_on_the_true_surfaces_and_normals_stand_on_them() {
    let scene = Scene::room();
    let mut random = Random::new(1);
    let mut map = map(0.02);
    for index in 0..20 {
        let rig = rig_at(0.01 * f64::from(index), 0.004 * f64::from(index));
        map.integrate(&cycle(&scene, index, &rig, Some(&mut random))).unwrap();
    }
    let off: Vec<(f64, f64)> = points(&map)
        .iter()
        .filter(|(point, _)| point.coords.norm() <= 3.0)
        .map(|(point, normal)| {
            let (off_m, away) = scene.nearest(point);
            (off_m, normal.dot(&away).clamp(-1.0, 1.0).acos().to_degrees())
        })
        .collect();
    let mean_m = off.iter().map(|(off_m, _)| off_m).sum::<f64>() / off.len() as f64;
    let turned_deg = median(off.iter().map(|(_, degrees)| *degrees).collect());
    println!("{} points, off by {mean_m:.4} m, turned by {turned_deg:.2} degrees", off.len());
    assert!(off.len() > 5_000, "{}", off.len());
    assert!(mean_m <= 0.005, "{mean_m} m");
    assert!(turned_deg <= 10.0, "{turned_deg} degrees");
}

/// The mask says what moves; how good it is, segmentation's tests show.
fn masked(scene: &Scene, mut cycle: SegmentedCycle, rig: &Isometry3<f64>) -> SegmentedCycle {
    let frame = Arc::clone(cycle.depth.unwrap().frame());
    let is_moving = scene.shows_person(&frame, rig);
    assert!(is_moving.iter().any(|is_moving| *is_moving));
    cycle.depth = MaskedDepth::new(frame, is_moving).ok();
    cycle
}

#[test]
fn a_person_who_is_masked_leaves_nothing_and_hides_nothing_for_good() {
    let rig = rig_at(0.0, 0.0);
    let (mut with, mut without) = (map(0.03), map(0.03));
    for index in 0..20 {
        let scene = Scene::room().with_person(-1.0 + 0.1 * f64::from(index));
        with.integrate(&masked(&scene, cycle(&scene, index, &rig, None), &rig)).unwrap();
        without.integrate(&cycle(&Scene::room(), index, &rig, None)).unwrap();
    }
    let scene = Scene::room();
    let stray = points(&with).iter().filter(|(point, _)| scene.nearest(point).0 > 0.03).count();
    assert_eq!(stray, 0, "points of the person");
    let (with, without) = (with.points().len(), without.points().len());
    assert!(with as f64 > 0.99 * without as f64, "{with} of {without} points");
}

#[test]
fn a_person_who_stood_there_from_the_start_is_cleared_by_what_is_seen_behind() {
    let rig = rig_at(0.0, 0.0);
    let person = Scene::room().with_person(0.0);
    let mut map = map(0.03);
    for index in 0..3 {
        map.integrate(&cycle(&person, index, &rig, None)).unwrap();
    }
    let of_person = |map: &Map| near(&points(map), &person);
    assert!(of_person(&map) > 200, "{}", of_person(&map));
    let mut cleared = 0;
    for index in 3..40 {
        let done = map.integrate(&cycle(&Scene::room(), index, &rig, None)).unwrap();
        cleared += done.cleared_voxels;
    }
    assert_eq!(of_person(&map), 0);
    assert!(cleared > 0);
}

#[test]
fn a_second_map_of_the_same_cycles_is_the_same_to_the_bit() {
    let mut random = Random::new(3);
    let cycles: Vec<_> = (0..4)
        .map(|index| cycle(&Scene::room(), index, &rig_at(0.0, 0.0), Some(&mut random)))
        .collect();
    let made = || {
        let mut map = map(0.03);
        for cycle in &cycles {
            map.integrate(cycle).unwrap();
        }
        map.whole()
    };
    assert_eq!(made(), made());
}
