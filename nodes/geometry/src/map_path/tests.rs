use nalgebra::{Isometry3, Point3, Vector3};
use proptest::prelude::*;

use super::*;
use crate::pose_from_vector;

fn at(seconds: f64) -> Stamp {
    Stamp::default().plus_seconds(seconds)
}

fn path(frame_id: &str, since_s: f64, vertices: &[(f64, Isometry3<f64>)]) -> MapPath {
    let vertices = vertices.iter().map(|(seconds, map_from_rig)| PathVertex {
        stamp: at(*seconds),
        map_from_rig: *map_from_rig,
    });
    MapPath::new(at(since_s), frame_id, vertices.collect()).unwrap()
}

fn along(x_m: f64) -> Isometry3<f64> {
    pose_from_vector(&[x_m, 0.0, 0.0, 0.0, 0.0, 0.0])
}

#[track_caller]
fn check_same(got: &Isometry3<f64>, expected: &Isometry3<f64>) {
    let off = got.inverse() * expected;
    let off = off.translation.vector.norm() + off.rotation.angle();
    assert!(off < 1e-9, "{got} is not {expected}");
}

#[test]
fn vertices_are_known_again_by_their_stamps() {
    let before = path("map", 3.0, &[(0.0, along(0.0)), (1.0, along(1.0)), (2.0, along(2.0))]);
    // The second one has gone, and there is a new one.
    let now = path("map", 4.0, &[(0.0, along(0.0)), (2.0, along(1.9)), (3.5, along(3.4))]);
    let correction = now.correction_since(&before).unwrap();
    assert_eq!(correction.knots().len(), 2);
    check_same(&correction.at(at(-9.0)), &Isometry3::identity());
    check_same(&correction.at(at(1.0)), &along(-0.05));
    check_same(&correction.at(at(2.0)), &along(-0.1));
    check_same(&correction.at(at(9.0)), &along(-0.1));
    assert!(now.correction_since(&path("odom", 3.0, &[(0.0, along(0.0))])).is_none());
    assert!(now.correction_since(&path("map", 3.0, &[(0.1, along(0.0))])).is_none());
    assert!(now.correction_since(&path("map", 3.0, &[])).is_none());
}

#[test]
fn a_correction_is_the_same_for_every_point_of_the_platform() {
    let base_from_camera = pose_from_vector(&[0.3, -0.1, 1.2, 0.4, 0.2, -0.1]);
    let turn = |yaw: f64| pose_from_vector(&[5.0, 3.0, 0.0, yaw, 0.0, 0.0]);
    let seen_by = |lever: &Isometry3<f64>| {
        let before = path("map", 1.0, &[(0.0, turn(0.5) * lever)]);
        let now = path("map", 1.0, &[(0.0, turn(0.6) * lever)]);
        now.correction_since(&before).unwrap().at(at(0.0))
    };
    check_same(&seen_by(&base_from_camera), &seen_by(&Isometry3::identity()));
}

#[test]
fn between_two_knots_near_points_move_in_a_line_however_far_the_origin_is() {
    let far = |x_m: f64, yaw: f64| pose_from_vector(&[1000.0 + x_m, 500.0, 0.0, yaw, 0.0, 0.0]);
    let before = path("map", 2.0, &[(0.0, far(0.0, 0.0)), (1.0, far(1.0, 0.0))]);
    let now = path("map", 2.0, &[(0.0, far(0.0, 0.0)), (1.0, far(1.0, 0.2))]);
    let correction = now.correction_since(&before).unwrap();
    let place = Point3::new(1000.5, 500.0, 0.0);
    let end = correction.at(at(1.0)) * place;
    let middle = correction.at(at(0.5)) * place;
    assert!((middle - nalgebra::center(&place, &end)).norm() < 1e-9, "{middle}");
}

#[test]
fn what_is_small_stays_and_counts_when_it_has_grown() {
    let before = path("map", 2.0, &[(0.0, along(0.0)), (1.0, along(1.0))]);
    let moved = |off_m: f64| path("map", 2.0, &[(0.0, along(0.0)), (1.0, along(1.0 + off_m))]);
    let small = moved(0.015).correction_since(&before).unwrap();
    let made = small.beyond(0.02, 5.0);
    assert!(made.is_none() && !small.is_none());
    let stands = before.after(&made, &moved(0.015));
    let grown = moved(0.03).correction_since(&stands).unwrap();
    assert!((grown.largest_shift_m(5.0) - 0.03).abs() < 1e-9);
    // One that was made counts no more.
    let made = grown.beyond(0.02, 5.0);
    let stands = stands.after(&made, &moved(0.03));
    assert!(moved(0.03).correction_since(&stands).unwrap().is_none());
}

#[test]
fn a_turn_moves_what_is_far() {
    let before = path("map", 0.0, &[(0.0, along(0.0))]);
    let turned = pose_from_vector(&[0.0, 0.0, 0.0, 0.01, 0.0, 0.0]);
    let correction = path("map", 0.0, &[(0.0, turned)]).correction_since(&before).unwrap();
    assert!((correction.largest_shift_m(5.0) - 0.05).abs() < 1e-9);
}

#[test]
fn an_invalid_path_is_an_error() {
    let vertex = |seconds, map_from_rig| PathVertex { stamp: at(seconds), map_from_rig };
    let new = |vertices| MapPath::new(at(0.0), "map", vertices);
    let same = vec![vertex(1.0, along(0.0)), vertex(1.0, along(1.0))];
    assert_eq!(new(same), Err(MapPathError::Unordered { index: 1 }));
    let nowhere = vec![vertex(1.0, along(f64::NAN))];
    let error = MapPathError::Pose { index: 0, source: UnusablePose::NotFinite };
    assert_eq!(new(nowhere), Err(error));
    let late = new(vec![vertex(1.0, along(0.0))]).unwrap();
    assert_eq!(late.since(), at(1.0), "a header without a stamp");
}

#[test]
fn a_platform_does_not_jump_in_the_continuous_frame() {
    let mut frame = ContinuousFrame::default();
    let correction = pose_from_vector(&[0.3, -0.1, 0.0, 0.05, 0.0, 0.0]);
    assert_eq!(frame.map_from_continuous(at(0.0), "map"), None);
    frame.take(path("map", 1.0, &[(0.0, along(0.0)), (1.0, along(1.0))]));
    assert_eq!(frame.map_from_continuous(at(1.5), "map"), None);
    let corrected =
        path("map", 2.0, &[(0.0, along(0.0)), (1.0, correction * along(1.0)), (2.0, along(3.0))]);
    frame.take(corrected.clone());
    // A cycle of before the correction that comes after it.
    assert_eq!(frame.map_from_continuous(at(1.9), "map"), None);
    let corrected_pose = correction * along(2.0);
    let map_from_continuous = frame.map_from_continuous(at(2.0), "map").unwrap();
    check_same(&(map_from_continuous.inverse() * corrected_pose), &along(2.0));
    frame.take(corrected);
    check_same(&frame.map_from_continuous(at(3.0), "map").unwrap(), &correction);
    assert_eq!(frame.map_from_continuous(at(3.0), "odom"), None, "no path is of that map");
    frame.clear();
    assert_eq!(frame.map_from_continuous(at(4.0), "map"), None);
}

#[test]
fn late_data_take_each_correction_that_they_missed_in_order() {
    let turn = pose_from_vector(&[0.0, 0.0, 0.0, 0.5, 0.0, 0.0]);
    let shift = along(2.0);
    let made = |by: Isometry3<f64>| {
        let before = path("map", 1.0, &[(0.0, along(0.0)), (1.0, along(1.0))]);
        let now = path("map", 1.0, &[(0.0, by * along(0.0)), (1.0, by * along(1.0))]);
        now.correction_since(&before).unwrap()
    };
    let mut late = LateCorrections::default();
    assert_eq!(late.missed_at(at(1.0)), None);
    late.corrected(at(2.0), &made(turn));
    late.corrected(at(4.0), &made(shift));
    check_same(&late.missed_at(at(1.0)).unwrap(), &(shift * turn));
    check_same(&late.missed_at(at(2.0)).unwrap(), &shift);
    assert_eq!(late.missed_at(at(4.0)), None, "already in the current map");
    assert_eq!(late.missed_at(at(14.5)), None);
    assert_eq!(late.missed_at(at(3.0)), None, "a clock that was set back");
}

fn vertices() -> impl Strategy<Value = Vec<(f64, Isometry3<f64>)>> {
    let pose = (prop::array::uniform3(-20.0..20.0_f64), prop::array::uniform3(-3.0..3.0_f64))
        .prop_map(|(shift, turn)| Isometry3::new(Vector3::from(shift), Vector3::from(turn)));
    prop::collection::vec((0.01..1.0_f64, pose), 1..20).prop_map(|steps| {
        let mut seconds = 0.0;
        let next = |(step, pose)| {
            seconds += step;
            (seconds, pose)
        };
        steps.into_iter().map(next).collect()
    })
}

proptest! {
    #[test]
    fn nothing_moves_beside_the_span(
        vertices in vertices(), moved in prop::collection::vec(any::<bool>(), 20), seconds in -1.0..30.0_f64,
    ) {
        let now: Vec<_> = vertices
            .iter()
            .zip(&moved)
            .map(|((seconds, pose), moves)| (*seconds, if *moves { along(1.0) * pose } else { *pose }))
            .collect();
        let (before, now) = (path("map", 0.0, &vertices), path("map", 0.0, &now));
        let correction = now.correction_since(&before).unwrap();
        let (from, to) = correction.span();
        let stays = correction.at(at(seconds)) == Isometry3::identity();
        prop_assert!(stays || (from < at(seconds) && at(seconds) < to));
    }

    #[test]
    fn a_path_since_itself_moves_nothing(vertices in vertices(), seconds in -1.0..30.0_f64) {
        let path = path("map", 0.0, &vertices);
        let correction = path.correction_since(&path).unwrap();
        prop_assert!(correction.is_none());
        prop_assert_eq!(correction.at(at(seconds)), Isometry3::identity());
    }

    #[test]
    fn at_a_vertex_the_correction_is_that_of_the_vertex(
        one in vertices(), other in vertices(),
    ) {
        let other: Vec<_> =
            one.iter().zip(&other).map(|((seconds, _), (_, pose))| (*seconds, *pose)).collect();
        let (before, now) = (path("map", 0.0, &one), path("map", 0.0, &other));
        let correction = now.correction_since(&before).unwrap();
        for ((seconds, before), (_, now)) in one.iter().zip(&other) {
            let got = correction.at(at(*seconds)) * before;
            prop_assert!((got.translation.vector - now.translation.vector).norm() < 1e-9);
            prop_assert!(got.rotation.angle_to(&now.rotation) < 1e-6);
        }
    }
}
