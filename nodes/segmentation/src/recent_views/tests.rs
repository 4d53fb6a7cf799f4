use geometry::{Cloud, Stamp};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::*;
use crate::view;

const CELL_M: f64 = 0.08;
/// Farther than all places of these tests.
const NEAR_M: f64 = 4.0;

/// A cycle that shows these points of the rig frame.
fn cycle_of(points_m: Vec<Point3<f32>>, x_m: f64) -> DetectedCycle {
    DetectedCycle {
        depth: None,
        scan_rays: std::sync::Arc::default(),
        index: 0,
        scan_stamp: Stamp::default(),
        voxel_points: vec![1; points_m.len()],
        points_before_reduction: points_m.len(),
        reduced_cloud: Cloud { stamp: Stamp::default(), frame_id: "rig".to_owned(), points_m },
        map_from_rig: Translation3::new(x_m, 0.0, 0.0).into(),
        map_frame_id: "map".to_owned(),
        setup: geometry::CycleSetup::default(),
        zones: Vec::new(),
        moving_beams: Vec::new(),
    }
}

/// A frame of points at 3 m around a view in which nothing comes back.
fn rim() -> Vec<Point3<f32>> {
    vec![Point3::new(3.0, -1.5, -1.0), Point3::new(3.0, 1.5, 1.0)]
}

/// The views of so many cycles alike, and the camera's view.
fn views_of(cycles: usize, points_m: &[Point3<f32>]) -> (RecentViews, View) {
    let (mut views, mut view) = (RecentViews::default(), View::default());
    for _ in 0..cycles {
        let cycle = cycle_of(points_m.to_vec(), 0.0);
        view::widen(&mut view, &cycle);
        views.remember(&cycle, CELL_M);
    }
    (views, view)
}

#[test]
fn a_place_before_black_is_empty_once_enough_cycles_have_shown_nothing_there() {
    let place = Point3::new(2.0, 0.3, 0.1);
    let was_empty = |cycles| {
        let (views, view) = views_of(cycles, &rim());
        views.was_empty(&place, &view, NEAR_M)
    };
    assert!(!was_empty(MIN_EMPTY - 1));
    assert!(was_empty(MIN_EMPTY));
}

#[test]
fn what_was_seen_or_hidden_or_out_of_view_was_not_empty() {
    let mut points_m = rim();
    points_m.push(Point3::new(2.0, 0.3, 0.1));
    let (views, view) = views_of(VIEWS, &points_m);
    for (place, why) in [
        (Point3::new(2.0, 0.3, 0.1), "seen"),
        (Point3::new(2.05, 0.32, 0.1), "seen, in the voxel beside"),
        (Point3::new(2.9, 0.43, 0.14), "hidden"),
        (Point3::new(2.0, 1.5, 0.1), "beyond the left border"),
        (Point3::new(2.0, 0.3, 1.0), "above the upper border"),
        (Point3::new(-2.0, 0.3, 0.1), "behind the camera"),
        (Point3::new(f64::NAN, 0.3, 0.1), "nowhere"),
    ] {
        assert!(!views.was_empty(&place, &view, NEAR_M), "{why}");
    }
    assert!(
        views.was_empty(&Point3::new(1.5, 0.3, 0.1), &view, NEAR_M),
        "clearly before what was seen"
    );
    assert!(views.was_empty(&Point3::new(2.0, -0.3, 0.1), &view, NEAR_M), "in another direction");
}

#[test]
fn where_nothing_came_back_the_place_must_have_been_near() {
    let place = Point3::new(2.0, 0.3, 0.1);
    let (blank, view) = views_of(VIEWS, &rim());
    assert!(blank.was_empty(&place, &view, 2.1));
    assert!(!blank.was_empty(&place, &view, 1.9), "it may have come into range");
    let (wall_behind, view) =
        views_of(VIEWS, &[rim(), vec![Point3::new(2.9, 0.435, 0.145)]].concat());
    assert!(wall_behind.was_empty(&place, &view, 1.9), "it would have hidden the wall");
}

/// A black floor shows the lower border of the view not before something stands on it.
#[test]
fn a_border_that_nothing_came_back_from_was_in_view_all_the_same() {
    let (views, mut view) = views_of(VIEWS, &rim());
    let foot = Point3::new(2.0, 0.125, -0.875);
    assert!(!views.was_empty(&foot, &view, NEAR_M));
    view::widen(&mut view, &cycle_of(vec![foot.cast()], 0.0));
    assert!(views.was_empty(&foot, &view, NEAR_M));
}

/// Regression: who goes away from the camera hides the places ahead for longer than a second, and his feet on a black
/// floor stayed in the map.
#[test]
fn what_was_hidden_for_two_seconds_was_empty_before() {
    const TWO_SECONDS: usize = 14;
    let place = Point3::new(2.4, 0.36, 0.12);
    let (mut views, view) = views_of(MIN_EMPTY, &rim());
    let hidden = cycle_of([rim(), vec![Point3::new(2.0, 0.3, 0.1)]].concat(), 0.0);
    for _ in 0..TWO_SECONDS {
        views.remember(&hidden, CELL_M);
    }
    assert!(views.was_empty(&place, &view, NEAR_M));
}

#[test]
fn each_cycle_is_asked_from_where_its_camera_was() {
    let (mut views, mut view) = (RecentViews::default(), View::default());
    for step in 0..MIN_EMPTY {
        let cycle = cycle_of(rim(), 0.5 * step as f64);
        view::widen(&mut view, &cycle);
        views.remember(&cycle, CELL_M);
    }
    // In view from the first place; too near to the last one's to lie between its borders.
    assert!(!views.was_empty(&Point3::new(1.8, 0.6, 0.0), &view, NEAR_M));
    assert!(views.was_empty(&Point3::new(1.8, 0.2, 0.0), &view, NEAR_M));
}

#[test]
fn only_the_last_cycles_count_and_none_after_a_new_start() {
    let place = Point3::new(2.0, 0.3, 0.1);
    let (mut views, view) = views_of(VIEWS, &rim());
    let taken = cycle_of([rim(), vec![place.cast()]].concat(), 0.0);
    for _ in 0..=VIEWS - MIN_EMPTY {
        assert!(views.was_empty(&place, &view, NEAR_M));
        views.remember(&taken, CELL_M);
    }
    assert!(!views.was_empty(&place, &view, NEAR_M));
    let (mut views, view) = views_of(VIEWS, &rim());
    views.clear();
    assert!(!views.was_empty(&place, &view, NEAR_M));
}

#[test]
fn of_what_is_beyond_the_farthest_return_nothing_is_known() {
    let beyond = Point3::new(3.2, 0.3, 0.1);
    let (views, mut view) = views_of(VIEWS, &rim());
    view::widen(&mut view, &cycle_of(vec![beyond.cast()], 0.0));
    assert!(!views.was_empty(&beyond, &view, NEAR_M), "it may have come into range");
    let (blank, _) = views_of(VIEWS, &[]);
    assert!(
        !blank.was_empty(&Point3::new(2.0, 0.3, 0.1), &view, NEAR_M),
        "the lens may be covered"
    );
}

/// Whether a place is gone for a camera at the origin, after one cycle that meets it and so many others, a second each,
/// from a camera at `from`.
fn has_gone_after(cycles: usize, points_m: &[Point3<f32>], from: [f64; 3]) -> bool {
    let place = Point3::new(2.0, 0.3, 0.1);
    let mut views = RecentViews::default();
    views.remember(&cycle_of([rim(), vec![place.cast()]].concat(), 0.0), CELL_M);
    for second in 0..cycles {
        let mut cycle = cycle_of(points_m.to_vec(), 0.0);
        cycle.map_from_rig = Translation3::from(Vector3::from(from)).into();
        cycle.reduced_cloud.stamp = Stamp::default().plus_seconds(1.0 + second as f64);
        views.remember(&cycle, CELL_M);
    }
    views.has_gone(&place, Stamp::default(), &Point3::origin())
}

#[test]
fn what_was_met_has_gone_once_enough_cycles_show_nothing_there() {
    let here = [0.0; 3];
    assert!(has_gone_after(MIN_GONE, &rim(), here));
    assert!(!has_gone_after(MIN_GONE - 1, &rim(), here));
    let behind = [rim(), vec![Point3::new(2.9, 0.435, 0.145)]].concat();
    assert!(has_gone_after(VIEWS, &behind, here), "rays go past it");
    assert!(has_gone_after(VIEWS, &rim(), [0.1, 0.015, 0.005]), "it was nearer, in that direction");
}

#[test]
fn background_that_may_be_there_unseen_has_not_gone() {
    let here = [0.0; 3];
    let with = |point: [f32; 3]| [rim(), vec![Point3::from(point)]].concat();
    for (points_m, from, why) in [
        (Vec::new(), here, "the lens may be covered"),
        (with([2.0, 0.3, 0.1]), here, "it is seen"),
        (with([1.4, 0.21, 0.07]), here, "something hides it"),
        (with([1.2, 0.25, 0.06]), here, "it may lie in the projector's shadow"),
        (rim(), [1.3, 0.0, 0.0], "it is too near to be measured"),
        (rim(), [-0.1, -0.015, -0.005], "it was farther away, in that direction"),
        (rim(), [1.0, 1.3, 0.0], "it was seen from another side"),
    ] {
        assert!(!has_gone_after(VIEWS, &points_m, from), "{why}");
    }
}

/// The mast of a turning platform hides what it turns to, nearer than the camera can measure.
#[test]
fn a_direction_from_which_nothing_ever_came_so_far_away_shows_nothing() {
    let place = Point3::new(2.0, 0.3, 0.1);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.3);
    let turned = Isometry3::from_parts(Translation3::identity(), turn);
    let aside = |distance_m: f64| (turned.inverse() * place * distance_m).cast::<f32>();
    let has_gone = |views: &mut RecentViews, also_met: &[Point3<f32>]| {
        let first = [rim(), vec![place.cast()], also_met.to_vec()].concat();
        views.remember(&cycle_of(first, 0.0), CELL_M);
        for second in 0..MIN_GONE {
            let mut cycle = cycle_of(rim(), 0.0);
            cycle.map_from_rig = turned;
            cycle.reduced_cloud.stamp = Stamp::default().plus_seconds(1.0 + second as f64);
            views.remember(&cycle, CELL_M);
        }
        views.has_gone(&place, Stamp::default(), &Point3::origin())
    };
    assert!(!has_gone(&mut RecentViews::default(), &[]));
    assert!(!has_gone(&mut RecentViews::default(), &[aside(0.6)]), "nearer things do not tell");
    let mut views = RecentViews::default();
    assert!(has_gone(&mut views, &[aside(1.1)]));
    views.clear();
    assert!(!has_gone(&mut views, &[]), "it was met in another run");
}

#[test]
fn only_the_cycles_since_it_was_met_show_that_something_has_gone() {
    let place = Point3::new(2.0, 0.3, 0.1);
    let (mut views, met_again) = (RecentViews::default(), VIEWS / 2);
    for second in 0..VIEWS {
        let seen = if second == 0 || second == met_again { vec![place.cast()] } else { Vec::new() };
        let mut cycle = cycle_of([rim(), seen].concat(), 0.0);
        cycle.reduced_cloud.stamp = Stamp::default().plus_seconds(second as f64);
        views.remember(&cycle, CELL_M);
    }
    let has_gone = |last_met: usize| {
        let last_met = Stamp::default().plus_seconds(last_met as f64);
        views.has_gone(&place, last_met, &Point3::origin())
    };
    assert!(!has_gone(met_again));
    assert!(has_gone(0), "the same cycles, were it not met again");
}
