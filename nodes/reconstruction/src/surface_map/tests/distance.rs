//! How far places are from the nearest obstacle of the map.

use geometry::{DistanceAt, Method, PipelineConfig, PlaceState};

use super::spilling::{drive, spilling};
use super::*;
use crate::distance::{MOST_BOX_PLACES, MOST_PLACES};
use crate::{DistanceError, MapBox};

/// The tiles within 2 m of a place, and a view: more than a view alone.
const MOST: usize = 1_300;

fn seen_room(map_edge_m: f64, cycles: u32) -> Map {
    let mut map = map(map_edge_m);
    for index in 0..cycles {
        map.integrate(&cycle(&Scene::room(), index, &rig_at(0.0, 0.0), None)).unwrap();
    }
    map
}

/// Places before the camera.
fn places(count: usize) -> Vec<Point3<f64>> {
    let mut random = Random::new(8);
    let mut along = |least: f64, most: f64| least + (most - least) * random.uniform();
    (0..count).map(|_| Point3::new(along(0.0, 3.0), along(-1.3, 1.3), along(-1.0, 1.0))).collect()
}

fn at(map: &mut Map, places_m: &[Point3<f64>]) -> Vec<DistanceAt> {
    map.distances("map", places_m).unwrap().at
}

/// Compares each answer with all points of the map. Returns the errors.
fn check_against_points(map: &mut Map, places_m: &[Point3<f64>]) -> Vec<f64> {
    let mut errors_m = Vec::new();
    let points = map.points();
    let half_diagonal_m = 0.5 * 3.0_f64.sqrt() * 0.05;
    for (place_m, at) in places_m.iter().zip(at(map, places_m)) {
        let plain_m = points.iter().map(|point| (point.cast::<f64>() - place_m).norm());
        let plain_m = plain_m.fold(f64::INFINITY, f64::min);
        match at.nearest {
            Some(nearest) => {
                let off_m = f64::from(nearest.distance_m) - plain_m;
                assert!(off_m.abs() <= half_diagonal_m, "{place_m}: {off_m} m");
                errors_m.push(off_m.abs());
            }
            None => assert!(plain_m > 2.0 - half_diagonal_m, "{place_m}: {plain_m} m"),
        }
    }
    errors_m
}

#[test]
fn they_are_those_of_the_points_of_the_map() {
    let mut map = seen_room(0.03, 3);
    let mut errors_m = check_against_points(&mut map, &places(2_000));
    errors_m.sort_by(f64::total_cmp);
    let mean_m = errors_m.iter().sum::<f64>() / errors_m.len() as f64;
    let [p99_m, most_m] = [errors_m.len() * 99 / 100, errors_m.len() - 1].map(|n| errors_m[n]);
    println!("mean {mean_m:.5} m, 99 of 100 {p99_m:.5} m, greatest {most_m:.5} m");
    assert!(mean_m < 0.003 && p99_m < 0.02, "{mean_m} {p99_m}");
    // What the camera sees now is there as well.
    map.integrate(&cycle(&Scene::room().with_person(0.0), 3, &rig_at(0.0, 0.0), None)).unwrap();
    check_against_points(&mut map, &places(300));
    let bytes = map.memory_bytes();
    map.forget_distances();
    assert!(map.memory_bytes() + 100_000 < bytes);
    check_against_points(&mut map, &places(300));
}

#[test]
fn who_has_gone_is_no_obstacle() {
    let (mut map, rig) = (map(0.03), rig_at(0.0, 0.0));
    let beside_person = [Point3::new(1.35, 0.0, 0.0)];
    let distance_m = |map: &mut Map| at(map, &beside_person)[0].nearest.unwrap().distance_m;
    for index in 0..3 {
        map.integrate(&cycle(&Scene::room().with_person(0.0), index, &rig, None)).unwrap();
    }
    assert!((distance_m(&mut map) - 0.15).abs() < 0.03);
    for index in 3..40 {
        map.integrate(&cycle(&Scene::room(), index, &rig, None)).unwrap();
    }
    // The walls are as far away as that.
    assert!(distance_m(&mut map) > 0.8, "{}", distance_m(&mut map));
    check_against_points(&mut map, &places(100));
}

#[test]
fn a_slice_has_one_layer_and_a_box_the_places_in_it() {
    let mut map = seen_room(0.05, 2);
    let asked =
        MapBox { least_m: Point3::new(0.0, -1.0, 0.11), most_m: Point3::new(2.6, 1.0, 0.11) };
    let slice = map.distance_lattice("map", &asked).unwrap();
    assert_eq!(slice.size, [53, 41, 1]);
    assert!((slice.origin_m - Point3::new(0.0, -1.0, 0.1)).norm() < 1e-9, "{}", slice.origin_m);
    let place = |x: usize, y: usize| slice.origin_m + 0.05 * Vector3::new(x as f64, y as f64, 0.0);
    let expected: Vec<Point3<f64>> =
        (0..41).flat_map(|y| (0..53).map(move |x| (x, y))).map(|(x, y)| place(x, y)).collect();
    for (at, expected) in slice.at.iter().zip(at(&mut map, &expected)) {
        let distance_m = |at: &DistanceAt| at.nearest.map(|nearest| nearest.distance_m);
        let (at_m, expected_m) = (distance_m(at), distance_m(&expected));
        let is_same = at_m.zip(expected_m).is_some_and(|(a, b)| (a - b).abs() < 1e-5);
        assert!(is_same || at_m == expected_m, "{at_m:?} {expected_m:?}");
    }
    assert!(slice.at.iter().any(|at| at.place == PlaceState::Free));
    let most_m = Point3::new(0.4, -0.9, 0.4);
    let of_box = map.distance_lattice("", &MapBox { most_m, ..asked }).unwrap();
    assert_eq!((of_box.size, of_box.at.len()), ([9, 3, 6], 9 * 3 * 6));
    assert_eq!(
        (of_box.edge_m, of_box.max_distance_m, of_box.frame_id.as_str()),
        (0.05, 2.0, "map")
    );
}

#[test]
fn what_cannot_be_answered_is_an_error_that_says_so() {
    let (origin, far) = (Point3::origin(), Point3::new(1.0, 1.0, 1.0));
    let asked = MapBox { least_m: origin, most_m: far };
    let mut empty = map(0.05);
    assert_eq!(empty.distances("map", &[origin]), Err(DistanceError::EmptyMap));
    assert_eq!(empty.distance_lattice("map", &asked), Err(DistanceError::EmptyMap));

    let mut config = config(0.05);
    config.pipeline = PipelineConfig::new(Method::RecHv, 0.08);
    let mut of_means = Map::new(config, None).unwrap();
    let error = of_means.distances("map", &[origin]).unwrap_err();
    assert!(error.to_string().contains("rec_hv"), "{error}");
    assert_eq!(of_means.distance_lattice("", &asked), Err(DistanceError::NoDistances));

    let mut map = seen_room(0.05, 1);
    let error = map.distances("odom", &[origin]).unwrap_err().to_string();
    assert_eq!(error, "the places are in frame \"odom\", the map in frame \"map\"");
    let error = map.distances("map", &[origin, Point3::new(0.0, f64::NAN, 0.0)]).unwrap_err();
    assert!(error.to_string().contains("place 1 has a coordinate that is not finite"), "{error}");
    let error = map.distances("map", &vec![origin; MOST_PLACES + 1]).unwrap_err().to_string();
    assert_eq!(error, "10001 places: at most 10000 are possible at a time");
    assert_eq!(map.distances("map", &vec![origin; MOST_PLACES]).unwrap().at.len(), MOST_PLACES);
    assert_eq!(map.distances("map", &[]).unwrap().at, []);

    let turned = MapBox { least_m: far, most_m: origin };
    let error = map.distance_lattice("map", &turned).unwrap_err().to_string();
    assert!(error.contains("ends before it begins"), "{error}");
    for most_m in [10.0, 1e30] {
        let large = MapBox { least_m: origin, most_m: Point3::new(most_m, most_m, most_m) };
        let error = map.distance_lattice("map", &large).unwrap_err();
        assert!(
            matches!(error, DistanceError::TooManyPlaces { places, .. } if places > MOST_BOX_PLACES),
            "{error}"
        );
    }
    let endless = MapBox { least_m: origin, most_m: Point3::new(f64::INFINITY, 0.0, 0.0) };
    let error = map.distance_lattice("map", &endless).unwrap_err();
    assert!(matches!(error, DistanceError::NotFinite { index: 1, .. }), "{error}");
}

/// What is spilled is an obstacle, too.
#[test]
fn a_map_that_is_larger_than_its_memory_has_the_distances_of_unbounded_memory() {
    let ((mut map, _store), mut twin) = (spilling(MOST), super::map(0.05));
    // In the middle, and by turns beside the wall.
    let along = |step: usize| Point3::new(0.37 * step as f64, [0.3, 0.96][step % 2], -0.2);
    let places_m: Vec<Point3<f64>> = (0..56).map(along).collect();
    for (index, cycle) in drive().iter().enumerate() {
        map.integrate(cycle).unwrap();
        twin.integrate(cycle).unwrap();
        if index % 12 == 0 || index == 71 {
            let last = if index == 71 { places_m.len() } else { 12 };
            assert_eq!(at(&mut map, &places_m[..last]), at(&mut twin, &places_m[..last]));
        }
    }
    assert!(map.spill_counts().unwrap().tiles_in_store > 0);
    let free = at(&mut map, &places_m).iter().filter(|at| at.place == PlaceState::Free).count();
    assert!(free > 20, "{free}");
    check_against_points(&mut map, &places_m);
}

#[test]
fn a_map_whose_tiles_have_no_room_says_so() {
    let (mut map, _store) = spilling(200);
    for cycle in &drive()[..36] {
        map.integrate(cycle).unwrap();
    }
    let error = map.distances("map", &[Point3::new(8.0, 0.0, 0.0)]).unwrap_err().to_string();
    assert!(error.contains("is spilled") && error.contains("max_map_blocks"), "{error}");
}

#[test]
fn a_corrected_or_emptied_map_has_the_distances_of_what_it_is_now() {
    let mut map = map(0.05);
    map.follow_path(&path_at(0.0)).unwrap();
    map.integrate(&cycle(&Scene::room(), 0, &rig_at(0.0, 0.0), None)).unwrap();
    check_against_points(&mut map, &places(100));
    map.follow_path(&path_at(0.4)).unwrap();
    check_against_points(&mut map, &places(100));
    map.clear();
    assert_eq!(map.distances("map", &[Point3::origin()]), Err(DistanceError::EmptyMap));
    map.integrate(&cycle(&Scene::room(), 1, &rig_at(0.0, 0.0), None)).unwrap();
    check_against_points(&mut map, &places(100));
    let whole = map.whole();
    let moved: Vec<Point3<f32>> =
        whole.points.points_m.iter().map(|point| point + Vector3::new(0.3, 0.0, 0.0)).collect();
    map.replace(&moved, &whole.points.normals, "map").unwrap();
    check_against_points(&mut map, &places(100));
}
