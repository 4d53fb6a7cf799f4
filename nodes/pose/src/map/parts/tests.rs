//! Maps taken apart and put together, and parts that are none of a map.

use proptest::prelude::*;

use super::*;
use crate::map::testing::{Fuzz, PLACE_M, blank_map};

/// What a map says under indices in the place of ids, by its own questions.
type Description = (Vec<Vec<(u32, usize)>>, Vec<Vec<(u32, u32)>>, Vec<Vec<u32>>, Vec<Option<u32>>);

fn described(map: &Map) -> Description {
    let keyframes = ranks(&map.keyframes);
    let points = map.points.iter().map(|(_, point)| point.sightings().clone());
    let lines = map.lines.iter().map(|(_, line)| line.sightings().clone());
    let seen = points.chain(lines).map(|sightings| {
        sightings.iter().map(|(keyframe, feature)| (keyframes[&keyframe], feature)).collect()
    });
    let covisible = map.keyframes.iter().map(|(_, keyframe)| {
        let shared = keyframe.covisible.iter();
        shared.map(|(id, shared)| (keyframes[id], shared.landmarks())).collect()
    });
    let children = map
        .keyframes
        .iter()
        .map(|(_, keyframe)| keyframe.children.iter().map(|child| keyframes[child]).collect());
    let ends = [map.root, map.newest].map(|id| id.map(|id| keyframes[&id]));
    (seen.collect(), covisible.collect(), children.collect(), ends.to_vec())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]
    #[test]
    fn what_is_taken_apart_and_put_together_is_the_same_map(
        seed in any::<u64>(),
        steps in 0..400_usize,
    ) {
        let mut fuzz = Fuzz::new(2, seed);
        (0..steps).for_each(|_| fuzz.step());
        let parts = fuzz.map.parts();
        let again = Map::from_parts(parts.clone()).unwrap();
        prop_assert_eq!(again.check(), Ok(()));
        prop_assert_eq!(described(&again), described(&fuzz.map));
        prop_assert_eq!(again.parts(), parts);
    }
}

#[test]
fn of_nothing_there_is_a_map_of_nothing() {
    let map = Map::new(MapConfig::default());
    let again = Map::from_parts(map.parts()).unwrap();
    assert_eq!(format!("{again:?}"), format!("{map:?}"));
}

/// The parts of a map of three keyframes, two of which see a point and a line, and with a loop.
fn parts() -> MapParts {
    let (mut map, ids) = blank_map(3);
    let point = map.insert_point(ids[0], 0, &PLACE_M).unwrap();
    map.observe(ids[1], 1, point).unwrap();
    let line = map.insert_line(ids[0], 0, &[PLACE_M, Point3::origin()]).unwrap();
    map.observe(ids[2], 1, line).unwrap();
    map.close_loop(ids[0], ids[2], &Isometry3::translation(1.0, 0.0, 0.0)).unwrap();
    map.parts()
}

fn error(spoil: impl Fn(&mut MapParts)) -> PartsError {
    let mut parts = parts();
    spoil(&mut parts);
    Map::from_parts(parts).unwrap_err()
}

#[test]
fn parts_that_are_none_of_a_map_are_refused_by_name() {
    assert!(Map::from_parts(parts()).is_ok());
    let far = f64::INFINITY;
    assert_eq!(
        error(|parts| parts.points[0].position_m.x = f64::NAN),
        PartsError::Number { what: "point", index: 0 }
    );
    assert_eq!(
        error(|parts| parts.points[0].look.nearest_m = -1.0),
        PartsError::Number { what: "point", index: 0 }
    );
    assert_eq!(
        error(|parts| parts.lines[0].ends_m[1] = PLACE_M),
        PartsError::Number { what: "line", index: 0 }
    );
    for spoil in [
        |part: &mut KeyframePart| part.camera_from_map.translation.x = f64::INFINITY,
        |part: &mut KeyframePart| part.loops[0].1.rotation = twice_as_long(),
        |part: &mut KeyframePart| Arc::make_mut(&mut part.frame).corners[3].pixel.y = f32::NAN,
        |part: &mut KeyframePart| {
            let depth = crate::frame::MeasuredDepth { depth_m: 1.0, std_dev_m: 0.0 };
            Arc::make_mut(&mut part.frame).corner_depths[3] = Some(depth);
        },
        |part: &mut KeyframePart| {
            Arc::make_mut(&mut part.frame).lines[3].segment.end_px[1] = f32::NAN;
        },
    ] {
        let error = error(|parts| spoil(&mut parts.keyframes[2]));
        assert_eq!(error, PartsError::Number { what: "keyframe", index: 2 });
    }
    let camera = error(|parts| parts.keyframes[1].camera.fx_px = far);
    assert!(matches!(camera, PartsError::Camera { index: 1, .. }), "{camera}");
    assert_eq!(
        error(|parts| parts.keyframes[1].points.truncate(9)),
        PartsError::Features { index: 1, features: 10, listed: 9 }
    );
    assert_eq!(
        error(|parts| parts.keyframes[1].points[0] = Some(1)),
        PartsError::NotThere { index: 1, what: "point", named: 1, count: 1 }
    );
    assert_eq!(
        error(|parts| parts.keyframes[2].parent = Some(3)),
        PartsError::NotThere { index: 2, what: "parent", named: 3, count: 3 }
    );
    assert_eq!(
        error(|parts| parts.keyframes[1].number = 0),
        PartsError::Order { index: 1, number: 0, so_far: 3 }
    );
    assert_eq!(
        error(|parts| parts.keyframes_so_far = 2),
        PartsError::Order { index: 2, number: 2, so_far: 2 }
    );
    assert_eq!(
        error(|parts| parts.keyframes[1].points[0] = Some(0)),
        PartsError::Sighting { index: 1, source: MapError::SeenAlready { feature: 0 } }
    );
    assert_eq!(
        error(|parts| parts.keyframes[0].loops[0].0 = 0),
        PartsError::Sighting { index: 0, source: MapError::WithItself }
    );
    assert!(matches!(error(|parts| parts.config.scale_factor = 0.5), PartsError::Config(_)));
}

#[test]
fn parts_that_are_no_whole_are_refused_by_name() {
    let inconsistent = |spoil: &dyn Fn(&mut MapParts)| match error(spoil) {
        PartsError::Inconsistent(inconsistency) => inconsistency,
        other => panic!("{other}"),
    };
    let unseen = inconsistent(&|parts| {
        parts.keyframes.iter_mut().for_each(|keyframe| keyframe.points.fill(None));
    });
    assert_eq!(unseen, Inconsistency::Unseen);
    assert_eq!(inconsistent(&|parts| parts.keyframes[2].parent = None), Inconsistency::Roots(2));
    let cycle = inconsistent(&|parts| parts.keyframes[1].parent = Some(2));
    assert_eq!(cycle, Inconsistency::Cycle { reached: 1, keyframes: 3 });
    let own = inconsistent(&|parts| parts.keyframes[2].parent = Some(2));
    assert_eq!(own, Inconsistency::Cycle { reached: 2, keyframes: 3 });
    let half = inconsistent(&|parts| parts.keyframes[2].loops.clear());
    assert!(matches!(half, Inconsistency::OneSidedLoop(_)), "{half}");
}

fn twice_as_long() -> nalgebra::UnitQuaternion<f64> {
    nalgebra::Unit::new_unchecked(nalgebra::Quaternion::new(2.0, 0.0, 0.0, 0.0))
}
