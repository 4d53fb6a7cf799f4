use geometry::{CameraModel, DepthFrame, DepthImage, DepthPixels, Distortion};
use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};
use volume::{DepthInput, DepthNoise, DepthRange};

use super::*;

const EDGE_M: f64 = 0.08;
/// Farther than all places of these tests.
const NEAR_M: f64 = 4.0;
const WIDTH_PX: usize = 320;
const HEIGHT_PX: usize = 240;
const FOCAL_PX: f64 = 240.0;

/// What stands in the map, x forward, y to the left and z up of a camera at the origin: places, as wide and as high as a voxel.
type Things = Vec<Point3<f64>>;

/// The image of a camera that sees nothing else.
pub(crate) fn view_of(
    things: &[Point3<f64>],
    map_from_rig: &Isometry3<f64>,
    stamp_s: f64,
) -> DepthView {
    let camera = CameraModel {
        width_px: WIDTH_PX,
        height_px: HEIGHT_PX,
        fx_px: FOCAL_PX,
        fy_px: FOCAL_PX,
        cx_px: 159.5,
        cy_px: 119.5,
        distortion: Distortion::None,
    };
    // Its optical axis is the rig's x axis.
    let axes = nalgebra::Matrix3::from_columns(&[-Vector3::y(), -Vector3::z(), Vector3::x()]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    let map_from_camera = map_from_rig * rotation;
    let mut depths_m = vec![f32::INFINITY; WIDTH_PX * HEIGHT_PX];
    for thing in things {
        let thing = map_from_camera.inverse_transform_point(thing);
        let half_px = 0.5 * EDGE_M / thing.z * FOCAL_PX;
        let middle_px =
            [159.5 + FOCAL_PX * thing.x / thing.z, 119.5 + FOCAL_PX * thing.y / thing.z];
        for (pixel, depth_m) in depths_m.iter_mut().enumerate() {
            let pixel = [pixel % WIDTH_PX, pixel / WIDTH_PX].map(|along| along as f64);
            let aside_px = (pixel[0] - middle_px[0]).abs().max((pixel[1] - middle_px[1]).abs());
            if thing.z > 0.0 && aside_px <= half_px {
                *depth_m = depth_m.min(thing.z as f32);
            }
        }
    }
    let stamp = Stamp::default().plus_seconds(stamp_s);
    let size_px = (WIDTH_PX, HEIGHT_PX);
    let pixels = DepthPixels::Metres(depths_m);
    let image = DepthImage::new(stamp, "camera".to_owned(), size_px, pixels).unwrap();
    let mut view = DepthView::new(DepthRange::default(), DepthNoise::default()).unwrap();
    let frame = DepthFrame::new(image, camera).unwrap();
    view.fill(&DepthInput::new(&frame, &map_from_camera)).unwrap();
    view
}

fn from_origin(things: &[Point3<f64>]) -> DepthView {
    view_of(things, &Isometry3::identity(), 0.0)
}

/// Two things at 3 m at the corners of a view in which nothing else comes back.
fn rim() -> Things {
    vec![Point3::new(3.0, -1.5, -1.0), Point3::new(3.0, 1.5, 1.0)]
}

/// The rim, and a thing.
fn with(thing: [f64; 3]) -> Things {
    [rim(), vec![thing.into()]].concat()
}

fn views_of(cycles: usize, things: &[Point3<f64>]) -> RecentViews {
    let (mut views, view) = (RecentViews::new(EDGE_M), from_origin(things));
    (0..cycles).for_each(|_| views.remember(&view));
    views
}

#[test]
fn a_place_before_black_is_empty_once_enough_cycles_have_shown_nothing_there() {
    let place = Point3::new(2.0, 0.3, 0.1);
    let was_empty = |cycles| views_of(cycles, &rim()).was_empty(&place, NEAR_M).from_near;
    assert!(!was_empty(MIN_EMPTY - 1));
    assert!(was_empty(MIN_EMPTY));
}

#[test]
fn what_was_seen_or_hidden_or_out_of_view_was_not_empty() {
    let views = views_of(VIEWS, &with([2.0, 0.3, 0.1]));
    for (place, why) in [
        (Point3::new(2.0, 0.3, 0.1), "seen"),
        (Point3::new(2.05, 0.32, 0.1), "seen, in the voxel beside"),
        (Point3::new(2.9, 0.43, 0.14), "hidden"),
        (Point3::new(2.0, 1.5, 0.1), "beyond the left border"),
        (Point3::new(2.0, 0.3, 1.2), "above the upper border"),
        (Point3::new(-2.0, 0.3, 0.1), "behind the camera"),
        (Point3::new(f64::NAN, 0.3, 0.1), "nowhere"),
    ] {
        assert!(!views.was_empty(&place, NEAR_M).from_near, "{why}");
    }
    assert!(
        views.was_empty(&Point3::new(1.5, 0.3, 0.1), NEAR_M).from_near,
        "clearly before what was seen"
    );
    assert!(
        views.was_empty(&Point3::new(2.0, -0.3, 0.1), NEAR_M).from_near,
        "in another direction"
    );
}

#[test]
fn where_nothing_came_back_the_place_must_have_been_near() {
    let place = Point3::new(2.0, 0.3, 0.1);
    let nothing = views_of(VIEWS, &rim());
    assert!(nothing.was_empty(&place, 2.1).from_near);
    assert!(!nothing.was_empty(&place, 1.9).from_near, "it may have come into range");
    assert!(nothing.was_empty(&place, 1.9).from_anywhere);
    let wall_behind = views_of(VIEWS, &with([2.9, 0.435, 0.145]));
    assert!(wall_behind.was_empty(&place, 1.9).from_near, "it would have hidden the wall");
}

/// Regression: who goes away from the camera hides the places ahead for longer than a second, and his feet on a black
/// floor stayed in the map.
#[test]
fn what_was_hidden_for_two_seconds_was_empty_before() {
    const TWO_SECONDS: usize = 14;
    let mut views = views_of(MIN_EMPTY, &rim());
    let hidden = from_origin(&with([2.0, 0.3, 0.1]));
    (0..TWO_SECONDS).for_each(|_| views.remember(&hidden));
    assert!(views.was_empty(&Point3::new(2.4, 0.36, 0.12), NEAR_M).from_near);
}

#[test]
fn each_cycle_is_asked_from_where_its_camera_was() {
    let mut views = RecentViews::new(EDGE_M);
    for step in 0..MIN_EMPTY {
        let x_m = 0.5 * step as f64;
        let things: Things = rim().iter().map(|thing| thing + Vector3::x() * x_m).collect();
        views.remember(&view_of(&things, &Translation3::new(x_m, 0.0, 0.0).into(), 0.0));
    }
    // In view from the first place; too near to the last one's to lie between its borders.
    assert!(!views.was_empty(&Point3::new(1.8, 0.6, 0.0), NEAR_M).from_near);
    assert!(views.was_empty(&Point3::new(1.8, 0.2, 0.0), NEAR_M).from_near);
}

#[test]
fn only_the_last_cycles_count_and_none_after_a_new_start() {
    let place = Point3::new(2.0, 0.3, 0.1);
    let mut views = views_of(VIEWS, &rim());
    let taken = from_origin(&with([2.0, 0.3, 0.1]));
    for _ in 0..=VIEWS - MIN_EMPTY {
        assert!(views.was_empty(&place, NEAR_M).from_near);
        views.remember(&taken);
    }
    assert!(!views.was_empty(&place, NEAR_M).from_near);
    let mut views = views_of(VIEWS, &rim());
    views.clear();
    assert!(!views.was_empty(&place, NEAR_M).from_near);
}

#[test]
fn of_what_is_beyond_the_farthest_return_nothing_is_known() {
    let beyond = Point3::new(3.2, 0.3, 0.1);
    assert!(
        !views_of(VIEWS, &rim()).was_empty(&beyond, NEAR_M).from_near,
        "it may have come into range"
    );
    let covered = views_of(VIEWS, &[]);
    assert!(
        !covered.was_empty(&Point3::new(2.0, 0.3, 0.1), NEAR_M).from_near,
        "the lens may be covered"
    );
}

/// Whether a place is gone for a camera at the origin, after one cycle that meets it and so many others, a second each,
/// from a camera at `from`.
fn has_gone_after(cycles: usize, things: &[Point3<f64>], from: [f64; 3]) -> bool {
    let place = [2.0, 0.3, 0.1];
    let mut views = RecentViews::new(EDGE_M);
    views.remember(&from_origin(&with(place)));
    let map_from_rig = Translation3::from(Vector3::from(from)).into();
    for second in 0..cycles {
        views.remember(&view_of(things, &map_from_rig, 1.0 + second as f64));
    }
    views.has_gone(&place.into(), Stamp::default(), &Point3::origin())
}

#[test]
fn what_was_met_has_gone_once_enough_cycles_show_nothing_there() {
    let here = [0.0; 3];
    assert!(has_gone_after(MIN_GONE, &rim(), here));
    assert!(!has_gone_after(MIN_GONE - 1, &rim(), here));
    assert!(has_gone_after(VIEWS, &with([2.9, 0.435, 0.145]), here), "rays go past it");
    assert!(
        has_gone_after(VIEWS, &rim(), [0.02, 0.003, 0.001]),
        "it was nearer, in that direction"
    );
}

#[test]
fn background_that_may_be_there_unseen_has_not_gone() {
    let here = [0.0; 3];
    for (things, from, why) in [
        (Vec::new(), here, "the lens may be covered"),
        (with([2.0, 0.3, 0.1]), here, "it is seen"),
        (with([1.4, 0.21, 0.07]), here, "something hides it"),
        (with([1.2, 0.25, 0.06]), here, "it may lie in the projector's shadow"),
        (rim(), [1.3, 0.0, 0.0], "it is too near to be measured"),
        (rim(), [-0.1, -0.015, -0.005], "it was farther away, in that direction"),
        (rim(), [1.0, 1.3, 0.0], "it was seen from another side"),
    ] {
        assert!(!has_gone_after(VIEWS, &things, from), "{why}");
    }
}

/// The mast of a turning platform hides what it turns to, nearer than the camera can measure.
#[test]
fn a_direction_from_which_nothing_ever_came_so_far_away_shows_nothing() {
    let place = Point3::new(2.0, 0.3, 0.1);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.3);
    let turned = Isometry3::from_parts(Translation3::identity(), turn);
    // A few things side by side, so far away in the direction in which the turned camera has the place.
    let aside = |share: f64| -> Things {
        let middle = Point3::from((turned.inverse() * place).coords * share);
        let steps = [-EDGE_M, 0.0, EDGE_M];
        let beside = steps.into_iter().flat_map(|y| steps.map(|z| Vector3::new(0.0, y, z)));
        beside.map(|offset| middle + offset).collect()
    };
    let has_gone = |views: &mut RecentViews, also_met: &[Point3<f64>]| {
        views.remember(&from_origin(&[with([2.0, 0.3, 0.1]), also_met.to_vec()].concat()));
        for second in 0..MIN_GONE {
            let rim: Things = rim().iter().map(|thing| turned * thing).collect();
            views.remember(&view_of(&rim, &turned, 1.0 + second as f64));
        }
        views.has_gone(&place, Stamp::default(), &Point3::origin())
    };
    assert!(!has_gone(&mut RecentViews::new(EDGE_M), &[]));
    assert!(!has_gone(&mut RecentViews::new(EDGE_M), &aside(0.6)), "nearer things do not tell");
    let mut views = RecentViews::new(EDGE_M);
    assert!(has_gone(&mut views, &aside(1.1)));
    views.clear();
    assert!(!has_gone(&mut views, &[]), "it was met in another run");
}

#[test]
fn only_the_cycles_since_it_was_met_show_that_something_has_gone() {
    let place = Point3::new(2.0, 0.3, 0.1);
    let (mut views, met_again) = (RecentViews::new(EDGE_M), VIEWS / 2);
    for second in 0..VIEWS {
        let is_met = second == 0 || second == met_again;
        let things = if is_met { with([2.0, 0.3, 0.1]) } else { rim() };
        views.remember(&view_of(&things, &Isometry3::identity(), second as f64));
    }
    let has_gone = |last_met: usize| {
        let last_met = Stamp::default().plus_seconds(last_met as f64);
        views.has_gone(&place, last_met, &Point3::origin())
    };
    assert!(!has_gone(met_again));
    assert!(has_gone(0), "the same cycles, were it not met again");
}
