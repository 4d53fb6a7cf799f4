//! Operations one by one, and ten thousand of them in any order.

use nalgebra::{Isometry3, Point3, Vector3};
use proptest::prelude::*;

use super::testing::{Fuzz, PLACE_M, blank, blank_frame, blank_map};
use super::*;

#[test]
fn ten_thousand_steps_in_any_order_leave_the_map_consistent() {
    let mut fuzz = Fuzz::new(1, 1);
    for step in 0..10_000 {
        fuzz.step();
        if step % 10 == 0 {
            assert_eq!(fuzz.map.check(), Ok(()), "after {step} steps");
        }
    }
    assert_eq!(fuzz.map.check(), Ok(()));
    // Each kind of step was done many times, and none only refused.
    assert!(fuzz.done.iter().all(|done| *done > 50), "{:?}", fuzz.done);
    assert!(fuzz.map.keyframes.len() > 5 && fuzz.map.points.len() > 5);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]
    #[test]
    fn whatever_is_done_a_snapshot_is_as_it_was(seed in any::<u64>(), steps in 1..300_usize) {
        let mut fuzz = Fuzz::new(2, seed);
        for _ in 0..steps {
            fuzz.step();
        }
        let (snapshot, before) = (fuzz.map.clone(), format!("{:?}", fuzz.map));
        for _ in 0..100 {
            fuzz.step();
        }
        prop_assert_eq!(fuzz.map.check(), Ok(()));
        prop_assert_eq!(before, format!("{snapshot:?}"));
    }
}

#[test]
fn what_is_broken_is_found() {
    let (mut map, ids) = blank_map(3);
    let point = map.insert_point(ids[0], 0, &PLACE_M).unwrap();
    map.observe(ids[1], 0, point).unwrap();
    assert_eq!(map.check(), Ok(()));
    let break_by = |spoil: &dyn Fn(&mut Map)| {
        let mut broken = map.clone();
        spoil(&mut broken);
        broken.check().unwrap_err()
    };
    assert_eq!(
        break_by(&|map| map.keyframes.get_mut(ids[1]).unwrap().points[0] = None),
        Inconsistency::OneSidedSighting(ids[1])
    );
    assert_eq!(
        break_by(&|map| map.keyframes.get_mut(ids[2]).unwrap().points[0] = Some(point)),
        Inconsistency::OneSidedFeature(ids[2])
    );
    assert_eq!(
        break_by(&|map| map.keyframes.get_mut(ids[0]).unwrap().covisible.clear()),
        Inconsistency::Covisibility(ids[0])
    );
    assert_eq!(
        break_by(&|map| map.keyframes.get_mut(ids[2]).unwrap().parent = None),
        Inconsistency::Roots(2)
    );
    assert_eq!(
        break_by(&|map| map.keyframes.get_mut(ids[1]).unwrap().children.clear()),
        Inconsistency::OneSidedBranch(ids[2])
    );
    assert_eq!(
        break_by(&|map| {
            // The two are connected.
            map.set_parent(ids[1], ids[2]);
        }),
        Inconsistency::Cycle { reached: 1, keyframes: 3 }
    );
    assert_eq!(
        break_by(&|map| {
            let edge = LoopEdge { camera_from_other: Isometry3::identity() };
            map.keyframes.get_mut(ids[1]).unwrap().loops.insert(ids[2], edge);
        }),
        Inconsistency::OneSidedLoop(ids[1])
    );
}

#[test]
fn the_parent_of_a_keyframe_is_the_one_that_sees_most_with_it() {
    let (mut map, ids) = blank_map(3);
    let frame = blank_frame(10, 5);
    let points: Vec<PointId> =
        (0..3).map(|corner| map.insert_point(ids[0], corner, &PLACE_M).unwrap()).collect();
    map.observe(ids[1], 0, points[0]).unwrap();
    let sees: Vec<_> = points.iter().copied().enumerate().collect();
    let new = map.insert_keyframe(NewKeyframe { points: &sees, ..blank(&frame) }).unwrap();
    assert_eq!(map.keyframes.get(new).unwrap().parent(), Some(ids[0]));
    assert_eq!(
        map.neighbours(new, 1),
        [(ids[0], Shared { points: 3, lines: 0 }), (ids[1], Shared { points: 1, lines: 0 })]
    );
    assert_eq!(map.neighbours(new, 2).len(), 1);
    // The parent of one that sees nothing of the map is the newest.
    let lost = map.insert_keyframe(blank(&frame)).unwrap();
    assert_eq!(map.keyframes.get(lost).unwrap().parent(), Some(new));
    assert_eq!(map.seen_from(&points), [(new, 3), (ids[0], 3), (ids[1], 1)]);
    assert_eq!(map.landmarks_of([ids[1], lost]), (vec![points[0]], Vec::new()));
    assert_eq!((map.count_seen_by(new), map.count_seen_by(lost)), ((3, 0), (0, 0)));
}

#[test]
fn the_children_of_a_removed_keyframe_get_those_that_see_most_with_them_as_parents() {
    let (mut map, ids) = blank_map(4);
    // All are children of 1, a child of 0; 2 sees something with 0, and 3 with 2.
    map.set_parent(ids[2], ids[1]);
    map.set_parent(ids[3], ids[1]);
    let point = map.insert_point(ids[0], 0, &PLACE_M).unwrap();
    map.observe(ids[2], 0, point).unwrap();
    let point = map.insert_point(ids[2], 1, &PLACE_M).unwrap();
    map.observe(ids[3], 0, point).unwrap();
    let alone = map.insert_point(ids[1], 0, &PLACE_M).unwrap();
    let pose = Isometry3::translation(1.0, 0.0, 0.0);
    map.set_pose(ids[1], &pose).unwrap();
    let culled = map.cull_keyframe(ids[1]).unwrap();
    let camera_from_parent = pose;
    assert_eq!(culled, CulledKeyframe { parent: ids[0], camera_from_parent, landmarks: 1 });
    assert!(!map.points.contains(alone));
    let parent = |id| map.keyframes.get(id).unwrap().parent();
    assert_eq!([parent(ids[2]), parent(ids[3])], [Some(ids[0]), Some(ids[2])]);
    assert_eq!(map.check(), Ok(()));
    assert_eq!(map.cull_keyframe(ids[0]), Err(MapError::Root));
    assert_eq!(map.cull_keyframe(ids[1]), Err(MapError::NoKeyframe(ids[1])));
}

/// Regression: the ends of loops stayed for ever, and a map that closes some on each round grew with every round.
#[test]
fn a_loop_ends_at_the_parent_of_an_end_that_goes() {
    let (mut map, ids) = blank_map(5);
    let along_m = |x| Isometry3::translation(x, 0.0, 0.0);
    for (id, x_m) in ids.iter().zip([0.0, 1.0, 2.0, 3.0, 4.0]) {
        map.set_pose(*id, &along_m(x_m)).unwrap();
    }
    map.set_parent(ids[3], ids[2]);
    map.set_parent(ids[4], ids[3]);
    // As it was measured: half a metre more than by the poses.
    map.close_loop(ids[4], ids[0], &along_m(4.5)).unwrap();
    let loops = |map: &Map, id| map.keyframes.get(id).unwrap().loops().clone();
    assert_eq!(loops(&map, ids[0])[&ids[4]].camera_from_other, along_m(-4.5));
    map.cull_keyframe(ids[4]).unwrap();
    assert_eq!(loops(&map, ids[3])[&ids[0]].camera_from_other, along_m(3.5));
    assert_eq!(loops(&map, ids[0])[&ids[3]].camera_from_other, along_m(-3.5));
    assert_eq!(map.check(), Ok(()));
    // What the parent knows already stays as it is known there.
    map.close_loop(ids[2], ids[0], &along_m(2.1)).unwrap();
    map.cull_keyframe(ids[3]).unwrap();
    assert_eq!(loops(&map, ids[2])[&ids[0]].camera_from_other, along_m(2.1));
    assert_eq!(map.check(), Ok(()));
    // A loop with its own parent closes nothing.
    map.set_parent(ids[2], ids[0]);
    map.cull_keyframe(ids[2]).unwrap();
    assert!(loops(&map, ids[0]).is_empty());
    assert_eq!(map.check(), Ok(()));
}

#[test]
fn two_points_that_are_one_are_seen_by_all_that_saw_either() {
    let (mut map, ids) = blank_map(3);
    let kept = map.insert_point(ids[0], 0, &PLACE_M).unwrap();
    let dropped = map.insert_point(ids[1], 3, &PLACE_M).unwrap();
    map.observe(ids[0], 5, dropped).unwrap();
    map.observe(ids[2], 4, dropped).unwrap();
    map.count_predicted(kept, FoundTimes::once(true));
    map.count_predicted(dropped, FoundTimes::once(false));
    assert_eq!(map.fuse(kept, dropped), Ok(Fused { moved: 2, freed: 1 }));
    let point = map.points.get(kept).unwrap();
    let seen: Vec<_> = point.sightings().iter().collect();
    assert_eq!(seen, [(ids[0], 0), (ids[1], 3), (ids[2], 4)]);
    assert_eq!(point.sightings().found_share(), 0.5);
    assert_eq!(map.keyframes.get(ids[0]).unwrap().points()[5], None);
    assert_eq!(map.check(), Ok(()));
    assert_eq!(map.fuse(kept, dropped), Err(MapError::NoLandmark));
    assert_eq!(map.fuse(kept, kept), Err(MapError::WithItself));
}

#[test]
fn what_cannot_be_is_refused_and_changes_nothing() {
    let (mut map, ids) = blank_map(2);
    let point = map.insert_point(ids[0], 0, &PLACE_M).unwrap();
    let before = format!("{map:?}");
    let nowhere = Point3::new(f64::NAN, 0.0, 0.0);
    let far = Isometry3::translation(f64::INFINITY, 0.0, 0.0);
    assert_eq!(map.observe(ids[0], 1, point), Err(MapError::SeenAlready { feature: 0 }));
    assert_eq!(
        map.observe(ids[1], 10, point),
        Err(MapError::NoFeature { feature: 10, features: 10 })
    );
    assert_eq!(map.insert_point(ids[0], 0, &PLACE_M), Err(MapError::FeatureTaken { feature: 0 }));
    assert_eq!(map.insert_point(ids[0], 1, &nowhere), Err(MapError::NotFinite));
    assert_eq!(map.insert_line(ids[0], 0, &[PLACE_M; 2]), Err(MapError::NotFinite));
    assert_eq!(map.set_point(point, &nowhere), Err(MapError::NotFinite));
    assert_eq!(map.set_pose(ids[0], &far), Err(MapError::NotFinite));
    assert_eq!(map.close_loop(ids[0], ids[0], &far), Err(MapError::WithItself));
    assert_eq!(map.close_loop(ids[0], ids[1], &far), Err(MapError::NotFinite));
    assert_eq!(before, format!("{map:?}"));
}

#[test]
fn a_point_looks_as_most_see_it_and_from_between_them() {
    let (mut map, _) = blank_map(0);
    let at = |x_m: f64| Isometry3::translation(-x_m, 0.0, 0.0);
    let frame = blank_frame(1, 0);
    let mut other = (*frame).clone();
    other.corners[0].descriptor.0[0] = u64::MAX;
    other.corners[0].level = 3;
    let frames = [std::sync::Arc::new(other), std::sync::Arc::clone(&frame), frame];
    let ids: Vec<KeyframeId> = frames
        .iter()
        .zip([-1.0, 0.0, 1.0])
        .map(|(frame, x_m)| {
            let new = NewKeyframe { camera_from_map: at(x_m), ..blank(frame) };
            map.insert_keyframe(new).unwrap()
        })
        .collect();
    let place_m = Point3::new(0.0, 0.0, 2.0);
    let point = map.insert_point(ids[0], 0, &place_m).unwrap();
    map.observe(ids[1], 0, point).unwrap();
    map.observe(ids[2], 0, point).unwrap();
    map.refresh_point(point).unwrap();
    let look = map.points.get(point).unwrap().look();
    assert_eq!(look.descriptor, crate::feature::points::Descriptor::default());
    assert!((look.towards_cameras + Vector3::z()).norm() < 1e-12);
    let farthest_m = 5.0_f64.sqrt() * 1.2_f64.powi(3);
    assert!((look.farthest_m - farthest_m).abs() < 1e-9);
    assert!((look.nearest_m - farthest_m / 1.2_f64.powi(7)).abs() < 1e-9);
}
