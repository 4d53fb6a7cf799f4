use nalgebra::{Translation3, UnitQuaternion, Vector3};

use super::*;

const EDGE_M: f64 = 0.08;
const PLACE: [f64; 3] = [3.0, 0.0, 0.0];

/// What a camera at the origin of the map measures.
fn view_of(points_m: &[[f64; 3]]) -> CloudView {
    view_from(Isometry3::identity(), points_m)
}

fn view_from(map_from_rig: Isometry3<f64>, points_m: &[[f64; 3]]) -> CloudView {
    let mut view = CloudView::new(map_from_rig, Point3::origin(), EDGE_M);
    for point in points_m {
        view.meet(&Point3::from(*point));
    }
    view
}

fn is_blank(points_m: &[[f64; 3]], place: [f64; 3]) -> bool {
    is_blank_after(10.0, points_m, place)
}

/// The same, with this as the farthest depth ever measured in any direction.
fn is_blank_after(farthest_m: f64, points_m: &[[f64; 3]], place: [f64; 3]) -> bool {
    let view = view_of(points_m);
    let mut farthest = DepthByDirection::default();
    farthest.keep_farthest(&Vector2::zeros(), &Vector2::repeat(1.0), farthest_m);
    view.is_blank(&view.bearing(&place.into()).unwrap(), &farthest)
}

#[test]
fn a_direction_is_blank_where_nothing_came_back_and_something_would() {
    assert!(is_blank(&[], PLACE));
    for (place, why) in [([0.79, 0.0, 0.0], "too near"), ([8.01, 0.0, 0.0], "too far")] {
        assert!(!is_blank(&[], place), "{why}");
    }
    for (point, why) in [
        ([3.0, 0.0, 0.0], "it is seen"),
        ([3.0, 0.05, 0.0], "it is seen, in the voxel beside"),
        ([6.0, 0.0, 0.0], "something behind it is seen"),
        ([1.5, 0.0, 0.0], "something hides it"),
        ([1.5, 0.1, 0.0], "it may lie in a shadow to the right"),
        ([1.5, -0.1, 0.0], "it may lie in a shadow to the left"),
    ] {
        assert!(!is_blank(&[point], PLACE), "{why}");
    }
    for (point, why) in [
        ([1.5, 0.4, 0.0], "far beside"),
        ([2.7, 0.23, 0.0], "not far before and beside: a short shadow"),
        ([1.5, 0.0, 0.2], "above: projector and camera stand side by side"),
        ([2.95, 0.17, 0.0], "the same surface, beside"),
        ([6.0, 0.3, 0.0], "behind and beside"),
    ] {
        assert!(is_blank(&[point], PLACE), "{why}");
    }
}

#[test]
fn a_direction_from_which_nothing_as_far_away_ever_came_is_not_blank() {
    for (farthest_m, blank) in [(2.8, false), (2.89, true), (3.0, true)] {
        assert_eq!(is_blank_after(farthest_m, &[], PLACE), blank, "{farthest_m} m");
    }
    let view = view_of(&[]);
    let place = view.bearing(&PLACE.into()).unwrap();
    assert!(!view.is_blank(&place, &DepthByDirection::default()));
}

#[test]
fn it_sees_past_a_place_to_what_is_clearly_behind() {
    for (hit_m, sees_past) in [(3.0, false), (3.1, false), (3.13, true), (6.0, true), (1.5, false)]
    {
        let view = view_of(&[[hit_m, 0.0, 0.0]]);
        assert_eq!(view.sees_past(&view.bearing(&PLACE.into()).unwrap()), sees_past, "{hit_m} m");
    }
    let blank = view_of(&[]);
    assert!(!blank.sees_past(&blank.bearing(&PLACE.into()).unwrap()));
}

#[test]
fn it_sees_as_well_from_no_farther_away_and_the_same_side() {
    for (camera, sees_as_well) in [
        ([0.0, 0.0, 0.0], true),
        ([-0.05, 0.0, 0.0], true),
        ([-0.1, 0.0, 0.0], false),
        ([1.0, 0.0, 0.0], true),
        ([0.2, 1.0, 0.0], true),
        ([0.2, 1.1, 0.0], false),
        ([5.0, 0.0, 0.0], false),
    ] {
        let map_from_rig = Translation3::from(Vector3::from(camera)).into();
        let view = view_from(map_from_rig, &[]);
        let other = Point3::origin();
        assert_eq!(view.sees_as_well_as(&other, &PLACE.into()), sees_as_well, "{camera:?}");
    }
}

#[test]
fn places_of_the_map_are_found_from_the_rigs_pose() {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
    let map_from_rig = Isometry3::from_parts(Translation3::new(1.0, 2.0, 3.0), turn);
    let view = view_from(map_from_rig, &[[2.0, 0.5, 0.0]]);
    assert_eq!(view.farthest_m(), 2.0);
    let bearing = view.bearing_in_map(&Point3::new(0.5, 4.0, 3.0)).unwrap();
    assert!((bearing.depth_m - 2.0).abs() < 1e-12);
    assert!((bearing.slopes - Vector2::new(0.25, 0.0)).norm() < 1e-12);
    assert_eq!(view.nearest().depth_m(&bearing.slopes), Some(2.0));
    assert_eq!(view.bearing_in_map(&Point3::new(0.5, 1.0, 3.0)), None, "behind");
}

#[test]
fn points_that_are_not_finite_or_behind_are_not_measured() {
    let mut view = view_of(&[]);
    for x in [f64::NAN, f64::INFINITY, 0.0, -2.0] {
        assert_eq!(view.meet(&Point3::new(x, 0.0, 0.0)), None);
    }
    assert_eq!(view.farthest_m(), 0.0);
}
