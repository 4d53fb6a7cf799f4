use geometry::{Cloud, DetectedCycle, VoxelGrid};
use nalgebra::Isometry3;

use super::*;
use crate::cycle_points::CyclePoints;
use crate::view::View;

const CELL_M: f64 = 0.08;

/// A cycle whose points are screens, 0.4 m wide and 0.8 m high, at these places; and a frame of points that
/// spans the view.
fn cycle(index: i64, screens: &[(f64, f64)]) -> (DetectedCycle, Vec<MovingGroup>) {
    let mut points_m = vec![Point3::new(4.0, 2.0, 0.0), Point3::new(4.0, -2.0, 0.0)];
    let mut groups = Vec::new();
    for &(x_m, y_m) in screens {
        let first = points_m.len();
        for column in 0..5 {
            for row in 0..10 {
                let (y_m, z_m) =
                    (y_m - 0.16 + 0.08 * f64::from(column), -0.4 + 0.08 * f64::from(row));
                points_m.push(Point3::new(x_m, y_m, z_m).cast::<f32>());
            }
        }
        let points = (first..points_m.len()).collect();
        groups.push(MovingGroup {
            points,
            in_zone: true,
            in_free_space: true,
            is_newly_occupied: true,
            moves_in_place: false,
            has_stayed: false,
        });
    }
    let stamp = Stamp::from_nanos(index * 143_000_000);
    let cycle = DetectedCycle {
        depth: None,
        scan_rays: std::sync::Arc::default(),
        index: index as u32,
        scan_stamp: stamp,
        voxel_points: vec![1; points_m.len()],
        points_before_reduction: points_m.len(),
        reduced_cloud: Cloud { stamp, frame_id: "rig".to_owned(), points_m },
        map_from_rig: Isometry3::identity(),
        map_from_continuous: None,
        map_frame_id: "map".to_owned(),
        setup: geometry::CycleSetup::default(),
        zones: Vec::new(),
        moving_beams: Vec::new(),
    };
    (cycle, groups)
}

fn points_of(cycle: &DetectedCycle) -> CyclePoints<'_> {
    CyclePoints::of(cycle, &VoxelGrid::new(CELL_M).unwrap())
}

/// What a cycle shows, and the view that it spans.
fn seen<'a>(points: &'a CyclePoints<'a>) -> CycleView<'a> {
    let mut view = View::default();
    view.widen(points);
    CycleView { points, view, floor: None, cell_m: CELL_M }
}

fn update(tracker: &mut Tracker, index: i64, screens: &[(f64, f64)]) -> Vec<Track> {
    let (cycle, groups) = cycle(index, screens);
    tracker.predict(cycle.reduced_cloud.stamp);
    tracker.update(&seen(&points_of(&cycle)), &groups, &|_| false).tracks
}

fn tracker() -> Tracker {
    Tracker::new(FreeSpaceConfig::default())
}

#[test]
fn an_object_is_a_track_from_its_second_cycle_and_its_velocity_is_found() {
    let mut tracker = tracker();
    let mut tracks = Vec::new();
    for index in 0..12 {
        tracks = update(&mut tracker, index, &[(2.0, -0.8 + 0.143 * index as f64)]);
        assert_eq!(tracks.len(), usize::from(index > 0));
    }
    assert_eq!((tracks[0].id, tracks[0].unseen_cycles), (0, 0));
    assert!((tracks[0].velocity_m_per_s - Vector3::new(0.0, 1.0, 0.0)).norm() < 0.1);
    assert!((tracks[0].position_m - Point3::new(2.0, -0.8 + 0.143 * 11.0, -0.04)).norm() < 0.03);
    assert!((tracks[0].extent_m - Vector3::new(0.08, 0.4, 0.8)).norm() < 0.02);
    assert!((tracks[0].age_s - 11.0 * 0.143).abs() < 1e-9);
}

#[test]
fn one_that_is_seen_once_is_none_and_one_that_is_gone_ends() {
    let mut tracker = tracker();
    update(&mut tracker, 0, &[(2.0, 0.0)]);
    for index in 1..5 {
        assert_eq!(update(&mut tracker, index, &[]), []);
    }
    for index in 5..8 {
        update(&mut tracker, index, &[(2.0, 0.5)]);
    }
    let unseen = update(&mut tracker, 8, &[]);
    assert_eq!((unseen[0].id, unseen[0].unseen_cycles), (0, 1));
    for index in 9..30 {
        update(&mut tracker, index, &[]);
    }
    assert_eq!(update(&mut tracker, 30, &[]), []);
    // A number is used once.
    update(&mut tracker, 31, &[(2.0, 0.5)]);
    assert_eq!(update(&mut tracker, 32, &[(2.0, 0.5)])[0].id, 1);
}

/// Regression: a person of whom a hand and a foot came into view first was two objects for as long as it was seen, each
/// with a part of it.
#[test]
fn a_body_whose_ends_come_into_view_first_is_one() {
    let mut tracker = tracker();
    update(&mut tracker, 0, &[(2.0, -1.0), (2.0, -0.3)]);
    assert_eq!(tracker.objects.len(), 2);
    for index in 1..8 {
        let y_m = -0.65 + 0.143 * index as f64;
        let body = [(2.0, y_m - 0.35), (2.0, y_m), (2.0, y_m + 0.35)];
        let tracks = update(&mut tracker, index, &body);
        assert_eq!(tracks.len(), 1, "cycle {index}: {tracks:?}");
        assert!((tracks[0].position_m.y - y_m).abs() < 1e-6, "cycle {index}: {tracks:?}");
        assert_eq!(tracker.objects.len(), 1);
    }
}

#[test]
fn one_behind_another_coasts_and_keeps_its_number() {
    let mut tracker = tracker();
    let far = |index: i64| (3.0, -1.0 + 0.143 * index as f64);
    for index in 0..14 {
        // From the third cycle on for five cycles it is hidden by one that stands nearer.
        let hidden = (5..9).contains(&index);
        let screens: &[(f64, f64)] =
            if hidden { &[(1.5, -0.1)] } else { &[(1.5, -0.1), far(index)] };
        let tracks = update(&mut tracker, index, screens);
        if index > 1 {
            assert_eq!(tracks.iter().map(|track| track.id).collect::<Vec<_>>(), [0, 1]);
            let off_m = (tracks[1].position_m.y - far(index).1).abs();
            assert!(off_m < 0.15, "{off_m} m off in cycle {index}");
        }
    }
}

#[test]
fn two_that_meet_in_one_group_are_parted_by_where_they_are_expected() {
    let mut tracker = tracker();
    let places = |index: i64| {
        let travelled_m = 0.143 * index as f64;
        [(2.0, -1.0 + travelled_m), (2.45, 1.0 - travelled_m)]
    };
    for index in 0..15 {
        let tracks = update(&mut tracker, index, &places(index));
        if index > 1 {
            assert_eq!(tracks.iter().map(|track| track.id).collect::<Vec<_>>(), [0, 1]);
            assert!(tracks[0].velocity_m_per_s.y > 0.3 && tracks[1].velocity_m_per_s.y < -0.3);
        }
    }
}

/// Regression: the screen of a robot whose pole no ray meets was one object, and its base, farther back, another that
/// nobody tracked; the track's position was that of the screen.
#[test]
fn what_hangs_above_a_group_belongs_to_it_and_what_stands_beside_it_does_not() {
    let column = |x_m: f64, from_m: f64| {
        (0..4).map(move |row| Point3::new(x_m, 0.0, from_m + 0.08 * f64::from(row)))
    };
    let mut cycle = cycle(0, &[]).0;
    let mut objects = |bottom: (f64, f64), top: (f64, f64)| {
        cycle.reduced_cloud.points_m = column(bottom.0, bottom.1)
            .chain(column(top.0, top.1))
            .map(|point: Point3<f64>| point.cast())
            .collect();
        let points = points_of(&cycle);
        let cloud =
            CycleView { points: &points, view: View::default(), floor: None, cell_m: CELL_M };
        super::clusters::clusters(&cloud, &[&[0, 1, 2, 3], &[4, 5, 6, 7]], &[]).len()
    };
    assert_eq!(objects((2.3, -1.1), (2.0, 0.1)), 1, "the screen before and above its base");
    assert_eq!(objects((2.3, -1.1), (2.0, -1.1)), 2, "two who stand one behind the other");
    assert_eq!(objects((2.6, -1.1), (2.0, 0.1)), 2, "what hangs too far away");
}

/// Regression: the box in which a robot was expected lay about the centre of its pixels, which is that of the large
/// screen, and did not hold the base a metre below: when base and screen came apart, the base was left behind.
#[test]
fn all_of_what_was_seen_is_expected_wherever_most_of_its_pixels_are() {
    let (mut cycle, mut groups) = cycle(0, &[(2.0, 0.0)]);
    let base = cycle.reduced_cloud.points_m.len();
    cycle.reduced_cloud.points_m.push(Point3::new(2.3, 0.0, -1.2));
    cycle.voxel_points.push(1);
    groups[0].points.push(base);
    let points = points_of(&cycle);
    let mut tracker = tracker();
    tracker.predict(cycle.reduced_cloud.stamp);
    tracker.update(&seen(&points), &groups, &|_| false);
    let expected = tracker.predict(cycle.reduced_cloud.stamp)[0];
    for &point in &groups[0].points {
        let offset_m = (points.in_map[point] - expected.centre_m).abs();
        assert!(offset_m <= expected.half_extent_m, "{point}: {offset_m} of {expected:?}");
    }
}

/// Regression: the background that a person who left had hidden became an object of its own, and was removed to the end of a recording.
#[test]
fn what_only_the_expectation_of_another_object_claims_begins_no_track() {
    for shows_motion in [true, false] {
        let mut tracker = tracker();
        for index in 0..4 {
            let (cycle, mut groups) = cycle(index, &[(2.0, -0.8), (2.0, 0.8)]);
            (groups[1].is_newly_occupied, groups[1].in_zone) = (shows_motion, false);
            tracker.predict(cycle.reduced_cloud.stamp);
            let tracks = tracker.update(&seen(&points_of(&cycle)), &groups, &|_| false).tracks;
            let count = if shows_motion { 2 } else { 1 };
            assert_eq!(tracks.len(), if index > 0 { count } else { 0 });
        }
    }
}

#[test]
fn no_object_is_expected_to_be_larger_than_one_may_be() {
    let mut tracker = tracker();
    let row: Vec<(f64, f64)> = (0..6).map(|screen| (3.0, -1.0 + 0.4 * f64::from(screen))).collect();
    update(&mut tracker, 0, &row);
    let expected = tracker.predict(Stamp::from_nanos(143_000_000));
    let half_width_m = FreeSpaceConfig::default().max_object_width_m / 2.0;
    assert_eq!((expected.len(), expected[0].half_extent_m.y), (1, half_width_m));
}
