use proptest::prelude::*;

use super::*;

const EDGE_M: f64 = 0.08;

/// Two walls and a floor, with a point in every voxel.
fn room() -> Vec<Point3<f32>> {
    let at = |index: i32| (f64::from(index) * EDGE_M) as f32;
    let mut points = Vec::new();
    for along in -25..25 {
        for up in 0..25 {
            points.push(Point3::new(4.0, at(along), at(up) - 1.0));
            points.push(Point3::new(2.0 + at(along + 25), -2.0, at(up) - 1.0));
        }
        for deep in 0..25 {
            points.push(Point3::new(2.0 + at(deep), at(along), -1.0));
        }
    }
    points
}

/// A box in the room, with a point in every voxel of its front.
fn with_box(mut room: Vec<Point3<f32>>, y_m: f32) -> Vec<Point3<f32>> {
    for across in 0..6 {
        for up in 0..12 {
            let step = EDGE_M as f32;
            room.push(Point3::new(2.5, y_m + across as f32 * step, up as f32 * step - 1.0));
        }
    }
    room
}

fn of(map: &[Point3<f32>]) -> Correlation {
    correlation(&room(), map, EDGE_M).unwrap()
}

#[test]
fn the_same_cloud_correlates_wholly_in_every_view() {
    let mut turned = room();
    turned.reverse();
    for map in [room(), turned] {
        let Correlation { front, top, side } = of(&map);
        for view in [front, top, side] {
            assert!((view - 1.0).abs() < 1e-12, "{view}");
        }
    }
}

/// Regression: the cracks between the squares of two maps of one empty room, half a millimetre apart, cost them 8 %.
#[test]
fn noise_of_millimetres_costs_next_to_nothing() {
    let measured = |seed: u32| -> Vec<Point3<f32>> {
        let mut state = seed;
        let mut jitter_m = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            0.004 * ((state >> 8) as f32 / 16_777_216.0 - 0.5)
        };
        let wall = room().into_iter().filter(|point| point.x > 3.99).collect();
        // The means of voxels side by side lie up to two edges apart: here somewhat more than one.
        let spread = |value: f32| 1.06 * value;
        let points = with_box(wall, 0.0);
        points.iter().map(|point| point.map(|value| spread(value) + jitter_m())).collect()
    };
    let correlation = correlation(&measured(1), &measured(2), EDGE_M).unwrap();
    assert!(correlation.front > 0.99, "{correlation:?}");
}

/// Regression: the picture was half a square wider than the points, and in a room that is all wall the millimetres of
/// its outermost points were all that two measurements of it could differ in: 85 to 96 %.
#[test]
fn the_rim_of_a_picture_full_of_wall_says_nothing() {
    let measured = |seed: u32| -> Vec<Point3<f32>> {
        let mut state = seed;
        let mut uniform = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 16_777_216.0
        };
        // The border of the view cuts the outermost voxels: some have a point somewhere inside, some have none.
        let is_cut = |point: &Point3<f32>| point.y < -1.99;
        let wall: Vec<_> = room().into_iter().filter(|point| point.x > 3.99).collect();
        let seen = wall.into_iter().filter(|point| !is_cut(point) || uniform() < 0.5);
        let seen: Vec<_> = seen.collect();
        let floor = room().into_iter().filter(|point| point.z < -0.99 && point.y > -1.99);
        seen.into_iter()
            .chain(floor)
            .map(|point| {
                let off_m = if is_cut(&point) { 0.06 } else { 0.004 };
                point + nalgebra::Vector3::new(0.0, off_m * uniform(), 0.0)
            })
            .collect()
    };
    let correlation = correlation(&measured(1), &measured(2), EDGE_M).unwrap();
    assert!(correlation.front > 0.97, "{correlation:?}");
}

#[test]
fn the_correlation_falls_with_every_point_that_is_missing() {
    let mut last = 1.0;
    for kept_of_ten in (3..10).rev() {
        let map: Vec<_> = room()
            .into_iter()
            .enumerate()
            .filter(|(at, _)| at % 10 < kept_of_ten)
            .map(|(_, point)| point)
            .collect();
        let front = of(&map).front;
        assert!(front < last, "{kept_of_ten} of ten: {front} after {last}");
        last = front;
    }
}

#[test]
fn the_correlation_falls_as_a_part_moves_away() {
    let reference = with_box(room(), 0.0);
    let mut last = 1.0;
    for moved_cm in [4, 12, 24, 36, 48] {
        let map = with_box(room(), moved_cm as f32 / 100.0);
        let front = correlation(&reference, &map, EDGE_M).unwrap().front;
        assert!(front < last, "{moved_cm} cm: {front} after {last}");
        last = front;
    }
}

#[test]
fn what_an_object_leaves_behind_costs_correlation() {
    let ghost = of(&with_box(room(), 0.0));
    assert!(ghost.front < 0.97 && ghost.least() < ghost.front.max(ghost.top), "{ghost:?}");
}

#[test]
fn a_depth_that_is_wrong_shows_from_above() {
    let moved: Vec<_> = room()
        .into_iter()
        .map(
            |point| {
                if point.x > 3.99 { point + nalgebra::Vector3::new(0.4, 0.0, 0.0) } else { point }
            },
        )
        .collect();
    let score = of(&moved);
    // From the front it is hidden: the scale of grey grows with the farthest point.
    assert!(score.front > 0.999 && score.top < 0.99, "{score:?}");
}

#[test]
fn a_scene_of_kilometres_is_painted_at_a_coarser_scale() {
    let far = [Point3::origin(), Point3::new(5e4, -5e4, 5e4)];
    assert!((correlation(&far, &far, EDGE_M).unwrap().least() - 1.0).abs() < 1e-12);
}

/// Regression: one absurd coordinate of a damaged file made a picture of one row and 10^19 columns.
#[test]
fn a_thin_scene_of_any_length_is_painted_in_bounded_memory() {
    for length_m in [1e6, 1e20, f32::MAX] {
        let mut thin = room();
        thin.push(Point3::new(0.0, length_m, 0.0));
        assert!((correlation(&thin, &thin, EDGE_M).unwrap().least() - 1.0).abs() < 1e-12);
        let line = [Point3::origin(), Point3::new(0.0, length_m, 0.0)];
        assert!((correlation(&line, &line, EDGE_M).unwrap().least() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn without_points_there_is_nothing_to_compare() {
    let nowhere = [Point3::new(f32::NAN, 0.0, 0.0)];
    assert_eq!(
        correlation(&[], &room(), EDGE_M),
        Err(CorrelationError::Empty { which: "reference" })
    );
    assert_eq!(
        correlation(&room(), &nowhere, EDGE_M),
        Err(CorrelationError::Empty { which: "map" })
    );
    for edge_m in [0.0, f64::NAN] {
        assert!(correlation(&room(), &room(), edge_m).is_err());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn any_two_clouds_correlate_between_minus_one_and_one(
        a in prop::collection::vec(prop::array::uniform3(-20.0f32..20.0), 1..40),
        b in prop::collection::vec(prop::array::uniform3(-5.0f32..5.0), 1..40),
    ) {
        let cloud = |points: Vec<[f32; 3]>| points.into_iter().map(Point3::from).collect::<Vec<_>>();
        let (a, b) = (cloud(a), cloud(b));
        let forward = correlation(&a, &b, 0.3).unwrap();
        prop_assert!(forward.least() >= -1.0 - 1e-9 && forward.front <= 1.0 + 1e-9);
        // It does not matter which of the two is the reference.
        prop_assert_eq!(forward, correlation(&b, &a, 0.3).unwrap());
    }
}
