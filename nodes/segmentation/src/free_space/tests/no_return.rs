//! Places from whose direction nothing came back before.

use super::*;

/// Regression: who stood in a doorway with nothing behind it when all began was background there, which no ray passed
/// after he had left, and the next one was half left in the map for as long as he came through it.
#[test]
fn who_stands_before_nothing_takes_no_part_of_those_who_come_after() {
    let frame =
        [upright(4.52, [-1.6, -0.6], [-0.6, 0.6]), upright(4.52, [0.6, 1.6], [-0.6, 0.6])].concat();
    let body = upright(3.0, [-0.24, 0.24], [-0.56, 0.56]);
    let in_doorway = [frame.clone(), body.clone()].concat();
    let mut random = Random::new(1);
    let view = look(&furnished(), 0, &rig_at(0.0, 0.0, 0.0), Isometry3::identity(), &mut random);
    let cut_of_the_next = |stayed: u32, away: u32| {
        let mut segmenter = Segmenter::new(config()).unwrap();
        let mut cut = |index: u32, points_m: &[Point3<f32>]| {
            let cycle = with_points(&view.cycle, index, points_m.to_vec());
            segmenter.step(&cycle, |_| ()).unwrap().cycle.dynamic_cloud.points_m.len()
        };
        for index in 0..stayed {
            assert_eq!(cut(index, &in_doorway), 0);
        }
        for index in stayed..stayed + away {
            assert_eq!(cut(index, &frame), 0);
        }
        cut(stayed + away, &in_doorway)
    };
    const STOOD: u32 = 8;
    const FOR_LONG: u32 = 160;
    assert_eq!(cut_of_the_next(STOOD, 24), body.len());
    assert_eq!(cut_of_the_next(STOOD, 12), 0, "it may be dark and seen now and then");
    assert_eq!(cut_of_the_next(FOR_LONG, 24), 0, "it belongs there, and was not seen for a while");
}

/// Regression: before a robot that drove on, the floor, which was too slanting to be seen from farther away, was newly
/// occupied; it was cut out of the map, and taken for an object that grew with each cycle.
#[test]
fn a_floor_that_comes_into_range_is_not_newly_occupied() {
    const SEEN_UNTIL_M: f32 = 3.0;
    let floor = patch(1.5, 6.5);
    let wall = upright(7.0, [-0.6, 0.6], [0.2, 0.9]);
    let mut segmenter = Segmenter::new(config()).unwrap();
    let mut random = Random::new(1);
    let view = look(&furnished(), 0, &rig_at(0.0, 0.0, 0.0), Isometry3::identity(), &mut random);
    for index in 0..40 {
        let driven_m = 0.4 * CYCLE_S as f32 * index as f32;
        let from_here = |point: &Point3<f32>| Point3::new(point.x - driven_m, point.y, point.z);
        let floor = floor.iter().map(from_here);
        let floor = floor.filter(|point| (1.5..SEEN_UNTIL_M).contains(&point.x));
        let points_m = floor.chain(wall.iter().map(from_here)).collect();
        let mut cycle = with_points(&view.cycle, index, points_m);
        cycle.map_from_rig = Translation3::new(f64::from(driven_m), 0.0, 0.0).into();
        let cut = segmenter.step(&cycle, |_| ()).unwrap().cycle.dynamic_cloud.points_m;
        assert!(cut.is_empty(), "cycle {index}: {cut:?}");
    }
}

/// Regression: a person right before the lens, nearer than the camera can measure, left no return in half of the image. The walls and
/// the floor that appeared when she had passed were newly occupied: 2 % of the static points of a flat.
#[test]
fn a_surface_that_appears_where_nothing_returned_is_an_object_only_if_it_is_no_larger() {
    let rim =
        [upright(4.52, [-2.2, -1.7], [-0.6, 0.6]), upright(4.52, [1.7, 2.2], [-0.6, 0.6])].concat();
    let mut random = Random::new(1);
    let view = look(&furnished(), 0, &rig_at(0.0, 0.0, 0.0), Isometry3::identity(), &mut random);
    let cut_of = |appears: &[Point3<f32>]| {
        let mut segmenter = Segmenter::new(config()).unwrap();
        let mut cut = |index: u32, points_m: Vec<Point3<f32>>| {
            let cycle = with_points(&view.cycle, index, points_m);
            segmenter.step(&cycle, |_| ()).unwrap().cycle.dynamic_cloud.points_m.len()
        };
        for index in 0..10 {
            assert_eq!(cut(index, rim.clone()), 0);
        }
        cut(10, [&rim, appears].concat())
    };
    let body = upright(3.0, [-0.24, 0.24], [-0.8, 0.8]);
    assert_eq!(cut_of(&body), body.len());
    assert_eq!(cut_of(&upright(3.0, [-1.04, 1.04], [-0.8, 0.8])), 0, "a wall");
}
