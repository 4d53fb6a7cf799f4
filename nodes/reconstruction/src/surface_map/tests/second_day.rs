//! What has gone by the next day from a place behind which nothing returns: a hall, a doorway, a black floor.

use geometry::{DepthFrame, DepthImage, DepthPixels};
use nalgebra::{Translation3, UnitQuaternion};

use super::scene::sized_cycle;
use super::*;
use crate::WholeMap;

const SIZE_PX: (usize, usize) = (320, 240);
/// Nothing returns from farther away.
const RETURNS_TO_MM: u16 = 2_300;
/// Images a second, as the scene has them.
const RATE_HZ: u32 = 7;

/// An image some of whose pixels have no return.
fn seen(
    scene: &Scene,
    index: u32,
    rig: &Isometry3<f64>,
    returns: impl Fn(usize, u16) -> bool,
) -> SegmentedCycle {
    let mut cycle = sized_cycle(scene, index, rig, None, SIZE_PX);
    let before = cycle.depth.take().unwrap();
    let depths_mm = before.frame().depths_mm().iter().enumerate();
    let depths_mm = depths_mm.map(|(pixel, &mm)| if returns(pixel, mm) { mm } else { 0 });
    let pixels = DepthPixels::Millimetres(depths_mm.collect());
    let stamp = cycle.static_cloud.stamp;
    let image = DepthImage::new(stamp, "camera".to_owned(), SIZE_PX, pixels).unwrap();
    let frame = DepthFrame::new(image, *before.frame().camera()).unwrap();
    cycle.depth = MaskedDepth::new(Arc::new(frame), before.is_moving().to_vec()).ok();
    cycle
}

/// The room with the person, or without, before a background that returns nothing.
fn before_nothing(scene: &Scene, index: u32) -> SegmentedCycle {
    seen(scene, index, &rig_at(0.0, 0.0), |_, mm| mm <= RETURNS_TO_MM)
}

/// An image of the side wall, from where the person is not in view: with it the camera has seen something by each direction.
fn elsewhere(index: u32) -> SegmentedCycle {
    let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, std::f64::consts::FRAC_PI_2);
    let rig = Isometry3::from_parts(Translation3::new(-3.0, -3.0, 0.0), turn);
    cycle(&Scene::room(), index, &rig, None)
}

fn person() -> Scene {
    Scene::room().with_person(0.2)
}

/// The map of a day on which the person stood there for `lasted_s`.
fn first_day(lasted_s: u32) -> WholeMap {
    let mut map = map(0.04);
    map.integrate(&elsewhere(0)).unwrap();
    for index in 1..=RATE_HZ * lasted_s {
        map.integrate(&before_nothing(&person(), index)).unwrap();
    }
    map.whole()
}

fn loaded(saved: &WholeMap) -> Map {
    let mut map = map(0.04);
    map.replace(&saved.points.points_m, &saved.points.normals, "map").unwrap();
    map.add_views(saved.views.clone());
    map.take_last_sights(saved.sights.clone());
    assert!(near(&points(&map), &person()) > 50);
    map
}

/// Seconds after which nothing of the person is left.
fn gone_after_s(map: &mut Map, from: u32, most_s: u32) -> Option<u32> {
    (from..from + RATE_HZ * most_s).find_map(|index| {
        map.integrate(&before_nothing(&Scene::room(), index)).unwrap();
        (near(&points(map), &person()) == 0).then_some((index - from) / RATE_HZ)
    })
}

/// What went away overnight from before a hall stayed in a loaded map for ever.
#[test]
fn what_has_gone_overnight_from_before_nothing_goes_as_within_a_day() {
    let mut map = loaded(&first_day(8));
    map.integrate(&elsewhere(0)).unwrap();
    // A quarter of `max_stop_s`.
    let gone_s = gone_after_s(&mut map, 1, 40);
    assert!(gone_s.is_some_and(|gone_s| (14..18).contains(&gone_s)), "{gone_s:?}");
    // Of what was there for longer, a quarter of that.
    let mut map = loaded(&first_day(100));
    map.integrate(&elsewhere(0)).unwrap();
    let gone_s = gone_after_s(&mut map, 1, 40);
    assert!(gone_s.is_some_and(|gone_s| (24..28).contains(&gone_s)), "{gone_s:?}");
}

/// Of a map that is saved again on a day on which nobody looked there.
#[test]
fn how_it_was_seen_last_is_saved_again() {
    let saved = first_day(8);
    let mut map = loaded(&saved);
    map.integrate(&elsewhere(0)).unwrap();
    let again = map.whole();
    let mut map = loaded(&again);
    map.integrate(&elsewhere(0)).unwrap();
    assert!(gone_after_s(&mut map, 1, 40).is_some());
}

#[test]
fn a_lens_that_is_covered_clears_nothing_of_a_loaded_map() {
    let saved = first_day(8);
    // All of it; half of it, as by a hand, for 5 s; and half of it all the time, as by a part of the robot.
    type Returns = fn(usize, u16) -> bool;
    let half: Returns = |pixel, mm| pixel % SIZE_PX.0 < SIZE_PX.0 / 2 && mm <= RETURNS_TO_MM;
    let cases: [(&str, bool, u32, Returns); 3] =
        [("all", true, 60, |_, _| false), ("a hand", true, 5, half), ("a part", false, 60, half)];
    for (name, was_open, seconds, returns) in cases {
        let mut map = loaded(&saved);
        if was_open {
            map.integrate(&elsewhere(0)).unwrap();
        }
        let before = near(&points(&map), &person());
        for index in 1..=RATE_HZ * seconds {
            let cycle = seen(&person(), index, &rig_at(0.0, 0.0), returns);
            let done = map.integrate(&cycle).unwrap();
            assert_eq!(done.cleared_voxels, 0, "{name}: image {index}");
        }
        let after = near(&points(&map), &person());
        assert!(10 * after >= 9 * before, "{name}: {after} of {before}");
    }
}

/// A camera that looks from another side, or from farther away, may see nothing of a dark surface.
#[test]
fn what_is_seen_worse_than_the_day_before_stays() {
    let saved = first_day(8);
    let away = Translation3::new(-0.5, 0.0, 0.0) * rig_at(0.0, 0.0);
    let mut map = loaded(&saved);
    map.integrate(&elsewhere(0)).unwrap();
    let before = near(&points(&map), &person());
    for index in 1..RATE_HZ * 40 {
        let returns = |_, mm| mm <= RETURNS_TO_MM;
        map.integrate(&seen(&Scene::room(), index, &away, returns)).unwrap();
    }
    assert_eq!(near(&points(&map), &person()), before);
}
