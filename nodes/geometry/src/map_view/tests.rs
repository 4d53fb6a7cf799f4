use nalgebra::Vector3;
use proptest::prelude::*;

use super::*;

fn camera() -> CameraModel {
    let (width_px, height_px) = (640, 480);
    let distortion = Distortion::None;
    CameraModel {
        width_px,
        height_px,
        fx_px: 525.25,
        fy_px: 525.5,
        cx_px: 319.5,
        cy_px: 239.5,
        distortion,
    }
}

fn view(x_m: f64, yaw_rad: f64) -> MapView {
    let map_from_camera =
        Isometry3::new(Vector3::new(x_m, -1.25, 0.75), Vector3::new(0.0, 0.0, yaw_rad));
    MapView { stamp: Stamp::from_nanos(1_500_000_000), map_from_camera, camera: camera() }
}

#[test]
fn a_view_survives_its_text() {
    let before = view(2.5, 0.7);
    let after: MapView = before.to_string().parse().unwrap();
    assert_eq!((after.stamp, after.camera), (before.stamp, before.camera));
    let error = before.map_from_camera.inverse() * after.map_from_camera;
    assert!(error.translation.vector.norm() < 1e-4 && error.rotation.angle() < 1e-4, "{error}");
}

#[test]
fn a_text_that_is_no_view_is_none() {
    let text = view(1.0, 0.0).to_string();
    for (part, other) in
        [("640", "0"), ("640", "-1"), ("640", "1e300"), ("525.25", "nan"), ("0.75", "x")]
    {
        assert!(text.contains(part));
        assert_eq!(text.replacen(part, other, 1).parse::<MapView>(), Err(NoView), "{other}");
    }
    assert_eq!("".parse::<MapView>(), Err(NoView));
    assert_eq!(format!("{text} 1").parse::<MapView>(), Err(NoView));
    let without_direction = "1 0 0 0 0 0 0 0 640 480 525 525 319 239";
    assert_eq!(without_direction.parse::<MapView>(), Err(NoView));
}

#[test]
fn views_that_show_the_same_are_kept_once() {
    let mut views: MapViews =
        [view(0.0, 0.0), view(0.2, 0.0), view(0.0, 0.2)].into_iter().collect();
    assert_eq!(views.as_slice(), [view(0.0, 0.0)]);
    views.add(view(0.0, 0.3));
    views.add(view(0.35, 0.0));
    assert_eq!(views.as_slice().len(), 3);
}

/// Regression: the one pixel of a cloud without points in view kept out all later views from there.
#[test]
fn a_wider_view_takes_the_place_of_a_narrower_one_near_it() {
    let pixels = |width_px| CameraModel { width_px, ..camera() };
    let with = |x_m: f64, width_px| MapView { camera: pixels(width_px), ..view(x_m, 0.0) };
    let mut views: MapViews = [with(0.0, 1), with(0.4, 320), view(0.2, 0.0)].into_iter().collect();
    assert_eq!(views.as_slice(), [view(0.2, 0.0)], "near both");
    views.add(with(0.0, 639));
    assert_eq!(views.as_slice(), [view(0.2, 0.0)]);
    // It is found where it is.
    views.add(view(0.45, 0.0));
    assert_eq!(views.as_slice().len(), 1);
}

#[test]
fn the_views_of_what_is_gone_are_forgotten_in_the_order_in_which_they_came() {
    let at = |x_m: f64| MapView { stamp: Stamp::default().plus_seconds(x_m), ..view(x_m, 0.0) };
    let mut views: MapViews = [at(1.0), at(2.0), at(3.0)].into_iter().collect();
    views.forget_until(Stamp::default());
    assert_eq!(views.as_slice().len(), 3);
    views.forget_until(at(2.0).stamp);
    assert_eq!(views.as_slice(), [at(3.0)]);
    // They would be added again, and after the clock was set back all before them go.
    views.add(at(1.0));
    views.forget_until(at(2.0).stamp);
    assert_eq!(views.as_slice(), []);
}

#[test]
fn the_oldest_views_make_room() {
    let views: MapViews = (0..MapViews::MOST + 1).map(|index| view(index as f64, 0.0)).collect();
    assert!(views.as_slice().len() <= MapViews::MOST);
    let last = views.as_slice().last().unwrap();
    assert_eq!(last, &view(MapViews::MOST as f64, 0.0));
    // What went is forgotten, and would be added again; what stayed is known.
    let mut again = views.clone();
    again.add(view(0.0, 0.0));
    again.add(*last);
    assert_eq!(again.as_slice().len(), views.as_slice().len() + 1);
}

#[test]
fn views_move_by_the_correction_of_their_moment() {
    let early = view(0.0, 0.0);
    let late = MapView { stamp: early.stamp.plus_seconds(5.0), ..view(1.0, 0.0) };
    let mut views: MapViews = [early, late].into_iter().collect();
    let shift = Isometry3::translation(10.0, 0.0, 0.0);
    views.correct(|stamp| if stamp == early.stamp { shift } else { Isometry3::identity() });
    let moved = MapView { map_from_camera: shift * early.map_from_camera, ..early };
    assert_eq!(views.as_slice(), [moved, late]);
    // They are found where they are now.
    views.add(view(10.1, 0.0));
    assert_eq!(views.as_slice().len(), 2);
}

proptest! {
    #[test]
    fn each_view_is_near_one_that_is_kept(places in proptest::collection::vec((-2.0..2.0, -3.0..3.0), 1..60)) {
        let all: Vec<_> = places.into_iter().map(|(x_m, yaw_rad)| view(x_m, yaw_rad)).collect();
        let kept: MapViews = all.iter().copied().collect();
        prop_assert!(all.iter().all(|view| kept.as_slice().iter().any(|known| known.is_near(view))));
        for (index, one) in kept.as_slice().iter().enumerate() {
            prop_assert!(kept.as_slice().iter().skip(index + 1).all(|other| !one.is_near(other)));
        }
    }
}
