use std::f64::consts::FRAC_PI_2;

use estimation::Serial;
use geometry::{CameraModel, Distortion, OrientedPoints, Stamp, pose_from_vector};

use super::*;
use crate::saved_map::SavedMap;

/// A wall of 4 m by 2.4 m at x = 3 m, seen from the origin.
fn wall(normal_x: f32, is_there: impl Fn(f32) -> bool) -> (SeenSpace, PreparedMap) {
    let along = |cells: i32| (0..cells).map(|cell| cell as f32 * 0.05 + 0.025);
    let all = along(80).flat_map(|y| along(48).map(move |z| (y - 2.0, z - 1.2)));
    let points_m: Vec<_> =
        all.filter(|(y, _)| is_there(*y)).map(|(y, z)| Point3::new(3.0, y, z)).collect();
    let normals = vec![Vector3::new(normal_x, 0.0, 0.0); points_m.len()];
    let (width_px, height_px, fx_px, fy_px) = (160, 120, 144.0, 144.0);
    let (cx_px, cy_px, distortion) = (79.5, 59.5, Distortion::None);
    let view = MapView {
        stamp: Stamp::default(),
        map_from_camera: pose_from_vector(&[0.0, 0.0, 0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2]),
        camera: CameraModel { width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion },
    };
    let points = OrientedPoints { points_m, normals, colours: Vec::new() };
    let map = SavedMap { points, views: vec![view], edge_m: 0.05 };
    let prepared = PreparedMap::new(&map, &Serial).unwrap();
    (SeenSpace::of(&prepared, &map.views, &Serial), prepared)
}

fn sight((space, map): &(SeenSpace, PreparedMap), x_m: f64, y_m: f64) -> Sight {
    space.sight(&(map.level_from_map * Point3::new(x_m, y_m, 0.0)), &-Vector3::x(), 0.05)
}

#[test]
fn free_is_what_is_clearly_before_a_surface_and_in_view() {
    let space = wall(-1.0, |_| true);
    assert_eq!(sight(&space, 2.0, 0.0), Sight::ThroughFromItsFront);
    let place_m = space.1.level_from_map * Point3::new(2.0, 0.0, 0.0);
    let from_behind = space.0.sight(&place_m, &Vector3::x(), 0.05);
    assert_eq!(from_behind, Sight::Through);
    // At the wall, behind it, too near to the camera, and beside the image.
    for (x_m, y_m) in [(2.95, 0.0), (3.5, 0.0), (0.5, 0.0), (2.0, 1.6)] {
        assert_eq!(sight(&space, x_m, y_m), Sight::NotThrough, "{x_m} {y_m}");
    }
    assert!(!space.0.is_empty() && SeenSpace::default().is_empty());
}

#[test]
fn a_hole_says_nothing_and_neither_does_a_surface_that_was_seen_from_its_other_side() {
    let space = wall(-1.0, |y| y.abs() > 0.4);
    assert_eq!(sight(&space, 2.0, 0.0), Sight::NotThrough);
    assert_eq!(sight(&space, 2.0, 0.6), Sight::ThroughFromItsFront);
    assert_eq!(sight(&wall(1.0, |_| true), 2.0, 0.0), Sight::NotThrough);
}

/// A file may say that a camera has one column and thousands of rows: scaled by its width, each view would take a thousand times
/// the memory.
#[test]
fn an_image_of_any_shape_is_rendered_small() {
    let view = |size: &str| format!("1 0 0 0 0 0 0 1 {size} 144 144 0 0").parse().unwrap();
    for size in ["1 14000", "14000 1", "480 640", "640 480"] {
        let optics = Optics::of(&view(size));
        assert!(optics.width_px.max(optics.height_px) <= MOST_ALONG_SIDE, "{size}: {optics:?}");
    }
    let optics = Optics::of(&view("640 480"));
    assert_eq!((optics.width_px, optics.height_px), (80, 60));
}
