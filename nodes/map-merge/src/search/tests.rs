use estimation::{Random, Serial};
use geometry::OrientedPoints;
use proptest::prelude::*;
use registration::testing::{Rectangle, seen};

use super::*;
use crate::saved_map::SavedMap;

/// Walls of random lengths along two directions on a floor.
fn walls(seed: u64) -> Vec<Rectangle> {
    let mut random = Random::new(seed);
    let mut scene = vec![Rectangle::new([0.0; 3], [7.0, 0.0, 0.0], [0.0, 5.0, 0.0])];
    for _ in 0..6 {
        let corner_m = [random.between(0.0, 5.0), random.between(0.0, 3.0), 0.0];
        let length_m = random.between(0.5, 2.0);
        let is_along_x = random.uniform() < 0.5;
        let along = if is_along_x { [length_m, 0.0, 0.0] } else { [0.0, length_m, 0.0] };
        scene.push(Rectangle::new(corner_m, along, [0.0, 0.0, random.between(0.5, 2.4)]));
    }
    scene
}

fn prepared(scene: &[Rectangle], pose: &Isometry3<f64>, seed: u64) -> PreparedMap {
    let points_m = seen(scene, pose, 20_000, 0.005, &mut Random::new(seed));
    let points = OrientedPoints { points_m, ..OrientedPoints::default() };
    PreparedMap::new(&SavedMap { points, views: Vec::new(), edge_m: 0.05 }, &Serial).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn the_first_place_is_that_of_a_search_of_all_shifts(seed in 0..1000_u64) {
        let scene = walls(seed);
        let shift = Isometry3::translation(1.3, -0.8, 0.0);
        let [a, b] = [Isometry3::identity(), shift].map(|pose| prepared(&scene, &pose, seed));
        let plan = Plan::of(&a).unwrap();
        let found = places(&plan, &b, &[0.0], &|| false).unwrap().places[0];
        let turned = Turned::of(&b, &middle_m(&b), 0.0);
        let [x, y] = plan.bounds().map(|[from, until]| from - 60..until + 60);
        let all = y.flat_map(|y| x.clone().map(move |x| [x, y]));
        let best = all.map(|cell| turned.bound(&plan, 0, cell)).fold(f32::MIN, f32::max);
        prop_assert!((found.score - best).abs() < 1e-3, "{found:?} {best}");
    }

    #[test]
    fn no_shift_of_a_window_has_a_higher_score(
        seed in 0..1000_u64, level in 1..=LEVELS, x in -60..60_i32, y in -60..60_i32,
    ) {
        let map = prepared(&walls(seed), &Isometry3::identity(), seed);
        let plan = Plan::of(&map).unwrap();
        let turned = Turned::of(&map, &middle_m(&map), 0.4);
        let bound = turned.bound(&plan, level, [x, y]);
        let last = (1 << level) - 1;
        for [dx, dy] in [[0, 0], [last, 0], [0, last], [last / 2, last], [last, last]] {
            let own = turned.bound(&plan, 0, [x + dx, y + dy]);
            prop_assert!(own <= bound + 1e-3, "{own} {bound}");
        }
    }
}

#[test]
fn a_place_takes_the_middle_of_the_map_there() {
    let places = Places { places: Vec::new(), middle_m: Point2::new(2.0, 1.0) };
    let place = Place { score: 1.0, yaw_rad: 1.2, middle_m: Point2::new(-3.0, 4.0) };
    let pose = places.a_from_b(&place, 0.5);
    let middle_m = Point3::new(2.0, 1.0, 0.0);
    assert!((pose * middle_m - Point3::new(-3.0, 4.0, 0.5)).norm() < 1e-12);
    let beside = |by_m: f64| pose * Isometry3::translation(by_m, 0.0, 0.0);
    assert!(is_same_place(&pose, &beside(0.1), &middle_m));
    assert!(!is_same_place(&pose, &beside(0.6), &middle_m));
}
