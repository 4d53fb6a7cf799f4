//! Depth images that are rendered of clouds without pixels.

use std::f64::consts::SQRT_2;

use nalgebra::Point3;
use proptest::prelude::*;

use super::super::CloudCamera;
use super::super::points_in_view::MOST_PIXELS;
use super::organised::STAMP;
use crate::{Cloud, DepthFrame};

fn cloud(points_m: Vec<Point3<f32>>) -> Cloud {
    Cloud { stamp: STAMP, frame_id: "camera".to_owned(), points_m }
}

/// The point at 2 m with these slopes.
fn at([x, y]: [f64; 2]) -> Point3<f32> {
    Point3::new(2.0 * x as f32, 2.0 * y as f32, 2.0)
}

/// A wall at 2 m with a point each `pitch`, between these slopes in both axes.
fn wall(least: f64, most: f64, pitch: f64) -> Vec<Point3<f32>> {
    let steps = ((most - least) / pitch).round() as usize;
    let slopes = (0..=steps).map(move |step| least + pitch * step as f64);
    slopes.clone().flat_map(|y| slopes.clone().map(move |x| at([x, y]))).collect()
}

/// Each point on its own: rain.
fn scattered(points: usize) -> Vec<Point3<f32>> {
    // The golden ratio's multiples and those of the square root of two lie evenly, and on no grid.
    let slope = |index: usize, ratio: f64| ((index as f64 * ratio).fract() - 0.5) * 0.9;
    (0..points).map(|index| at([slope(index, 1.618_034), slope(index, SQRT_2)])).collect()
}

fn pitch(frame: &DepthFrame) -> f64 {
    1.0 / frame.camera().fx_px
}

/// The share of pixels without a depth between these slopes.
fn holes(frame: &DepthFrame, least: f64, most: f64) -> f64 {
    let camera = frame.camera();
    let within = |slope: f64| slope > least && slope < most;
    let pixels = frame.depths_mm().iter().enumerate().filter(|(pixel, _)| {
        let (column, row) = (pixel % camera.width_px, pixel / camera.width_px);
        within((column as f64 - camera.cx_px) / camera.fx_px)
            && within((row as f64 - camera.cy_px) / camera.fy_px)
    });
    let (all, empty) = pixels
        .fold((0, 0), |(all, empty), (_, depth_mm)| (all + 1, empty + usize::from(*depth_mm == 0)));
    f64::from(empty as u32) / f64::from(all)
}

proptest! {
    /// Every point is in the image, or one before it; and no depth is of no point.
    #[test]
    fn a_pixel_has_the_depth_of_its_nearest_point(
        points_m in proptest::collection::vec((-1.0..1.0_f32, -1.0..1.0_f32, 0.5..9.0_f32), 1..400),
    ) {
        let point = |(x, y, z): (f32, f32, f32)| Point3::new(x * z, y * z, z);
        let points_m: Vec<Point3<f32>> = points_m.into_iter().map(point).collect();
        let frame = CloudCamera::default().frame_of_points(&cloud(points_m.clone()));
        let width_px = frame.camera().width_px;
        let mut nearest_mm = vec![0.0_f32; frame.depths_mm().len()];
        for point_m in &points_m {
            let pixel = frame.camera().project(&point_m.cast()).unwrap();
            let at = &mut nearest_mm[pixel.y.round() as usize * width_px + pixel.x.round() as usize];
            let depth_mm = point_m.z * 1e3;
            *at = if *at == 0.0 { depth_mm } else { at.min(depth_mm) };
        }
        for (depth_mm, expected_mm) in frame.depths_mm().iter().zip(&nearest_mm) {
            prop_assert!((f32::from(*depth_mm) - expected_mm).abs() <= 0.51);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_points_make_a_bounded_image(
        points_m in proptest::collection::vec(proptest::array::uniform3(any::<f32>()), 0..200),
    ) {
        let points_m: Vec<Point3<f32>> = points_m.into_iter().map(Point3::from).collect();
        let mut camera = CloudCamera::default();
        for _ in 0..2 {
            let frame = camera.frame_of_points(&cloud(points_m.clone()));
            prop_assert!(frame.depths_mm().len() <= MOST_PIXELS);
        }
    }

    /// Points so dense that the finest pitch is chosen, and two that stretch the image as far as they are apart.
    #[test]
    fn an_image_as_large_as_can_be_has_no_more_pixels_than_are_allowed(
        least in proptest::array::uniform2(-1.8..0.0_f64),
        most in proptest::array::uniform2(0.05..1.8_f64),
    ) {
        let mut points_m = wall(0.0, 0.05, 1e-3);
        points_m.extend([at(least), at(most)]);
        let frame = CloudCamera::default().frame_of_points(&cloud(points_m));
        let pixels = frame.depths_mm().len();
        prop_assert!(pixels <= MOST_PIXELS, "{pixels}");
        // A finer pitch would have been too many, or is finer than the dense points are apart.
        prop_assert!(2 * pixels > MOST_PIXELS || pitch(&frame) < 1.2e-3, "{pixels}: {}", pitch(&frame));
    }
}

/// Pixels as large as the points of a wall lie apart, but for the steps between the pitches and the holes that are allowed.
fn assert_fits(frame: &DepthFrame, spacing: f64, what: &str) {
    let times = pitch(frame) / spacing;
    assert!((0.85..1.19).contains(&times), "{what}: pixels {times} times the spacing {spacing}");
    let holes = holes(frame, -0.3, 0.2);
    assert!(holes < 0.28, "{what}: {holes} of the pixels are holes");
}

#[test]
fn pixels_are_as_fine_as_the_surfaces_have_no_holes() {
    for spacing in [0.001, 0.002, 0.004, 0.0067, 0.01, 0.033] {
        let frame = CloudCamera::default().frame_of_points(&cloud(wall(-0.3, 0.2, spacing)));
        assert_fits(&frame, spacing, "a wall");
    }
}

/// A third of the points is missing, each time another one.
fn without_a_third(points_m: &[Point3<f32>], missing: u32) -> Vec<Point3<f32>> {
    let is_measured = |index: u32| (index.wrapping_mul(2_654_435_761) >> 16) % 3 != missing % 3;
    let measured = points_m.iter().zip(0_u32..).filter(|(_, index)| is_measured(*index));
    measured.map(|(point_m, _)| *point_m).collect()
}

#[test]
fn the_camera_stays_while_the_same_is_seen() {
    let points_m = wall(-0.49, 0.39, 0.005);
    let mut known = CloudCamera::default();
    let first = known.frame_of_points(&cloud(points_m.clone()));
    for missing in 0..6 {
        let mut measured = without_a_third(&points_m, missing);
        // And another one of the outermost columns.
        measured.retain(|point_m| point_m.x > 2.0 * (-0.49 + 0.005 * missing as f32));
        let next = known.frame_of_points(&cloud(measured));
        assert_eq!(next.camera(), first.camera(), "{missing}");
    }
}

#[test]
fn pixels_become_coarser_for_a_sensor_that_measures_fewer_points_from_now_on() {
    for spacing in [0.008, 0.012, 0.05] {
        let mut known = CloudCamera::default();
        let _dense = known.frame_of_points(&cloud(wall(-0.3, 0.2, 0.005)));
        let sparse = known.frame_of_points(&cloud(wall(-0.3, 0.2, spacing)));
        assert_fits(&sparse, spacing, "fewer points");
    }
}

#[test]
fn pixels_become_finer_for_a_sensor_that_measures_more_points_from_now_on() {
    for spacing in [0.003, 0.001] {
        let mut known = CloudCamera::default();
        let _sparse = known.frame_of_points(&cloud(wall(-0.3, 0.2, 0.005)));
        let dense = known.frame_of_points(&cloud(wall(-0.3, 0.2, spacing)));
        assert_fits(&dense, spacing, "more points");
    }
}

#[test]
fn one_cloud_of_scattered_points_leaves_no_coarse_pixels() {
    for points in [1, 30, 1_000, 3_000] {
        let mut known = CloudCamera::default();
        let _before = known.frame_of_points(&cloud(wall(-0.3, 0.2, 0.005)));
        let rain = known.frame_of_points(&cloud(scattered(points)));
        assert!(pitch(&rain) > 0.01, "{points} points: {}", pitch(&rain));
        let after = known.frame_of_points(&cloud(wall(-0.3, 0.2, 0.005)));
        assert_fits(&after, 0.005, "after scattered points");
    }
}

/// Where pixels are coarse, most neighbours of a small object's pixels are beyond its border.
#[test]
fn a_small_object_has_no_coarser_pixels_than_its_points_are_apart() {
    for (spacing, before) in [(0.002, scattered(50)), (0.01, wall(0.0, 0.04, 0.002))] {
        let object = wall(0.0, 0.04, spacing);
        let mut known = CloudCamera::default();
        let _before = known.frame_of_points(&cloud(before));
        let times = pitch(&known.frame_of_points(&cloud(object))) / spacing;
        assert!((0.85..1.19).contains(&times), "{spacing}: pixels {times} times as large");
    }
}

#[test]
fn a_stray_point_widens_its_own_image_alone() {
    let seen = wall(-0.5, 0.4, 0.005);
    let mut known = CloudCamera::default();
    let before = known.frame_of_points(&cloud(seen.clone()));
    let mut with_stray = seen.clone();
    with_stray.push(at([1.7, 1.7]));
    let stray = known.frame_of_points(&cloud(with_stray));
    assert!(stray.camera().width_px > 2 * before.camera().width_px);
    assert_eq!(pitch(&stray), pitch(&before));
    assert_eq!(known.frame_of_points(&cloud(seen)).camera(), before.camera());
}

/// Points so far apart that the image has coarser pixels than the surfaces need.
#[test]
fn pixels_that_were_coarse_for_the_size_of_the_image_do_not_stay_so() {
    let seen = wall(-0.3, 0.2, 0.002);
    let fewer = cloud(without_a_third(&seen, 0));
    let mut strays = seen.clone();
    strays.extend([at([1.7, 1.7]), at([-1.7, -1.7])]);
    let (seen, strays) = (cloud(seen), cloud(strays));
    for clouds in [[&seen, &strays, &fewer], [&strays, &strays, &seen]] {
        let mut known = CloudCamera::default();
        let _first = known.frame_of_points(clouds[0]);
        let coarse = known.frame_of_points(clouds[1]);
        assert!(pitch(&coarse) > 0.003, "{}", pitch(&coarse));
        let times = pitch(&known.frame_of_points(clouds[2])) / 0.002;
        assert!((0.85..1.19).contains(&times), "{times}");
    }
}

#[test]
fn pixels_are_as_large_as_the_rings_of_a_lidar_are_apart() {
    let rings = (-8..8).map(|ring| 0.035 * f64::from(ring));
    let points = rings.flat_map(|y| (-200..200).map(move |x| at([0.003 * f64::from(x), y])));
    let rings = cloud(points.collect());
    let mut known = CloudCamera::default();
    let first = known.frame_of_points(&rings);
    assert!((0.85..1.19).contains(&(pitch(&first) / 0.035)), "{}", pitch(&first));
    assert_eq!(known.frame_of_points(&rings), first);
}

#[test]
fn what_is_beyond_120_degrees_is_left_out() {
    let frame = CloudCamera::default().frame_of_points(&cloud(wall(0.0, 3.0, 0.04)));
    let camera = frame.camera();
    let reach = (camera.width_px as f64 - 1.0 - camera.cx_px) / camera.fx_px;
    assert!((reach - 1.732).abs() < pitch(&frame), "{reach}");
    let behind = at([0.0, 0.0]) * -1.0;
    let blind = CloudCamera::default().frame_of_points(&cloud(vec![behind]));
    assert_eq!(blind.depths_mm(), [0]);
}

#[test]
fn a_cloud_without_points_is_an_image_in_which_nothing_was_measured() {
    let seen = cloud(wall(-0.5, 0.4, 0.005));
    let mut known = CloudCamera::default();
    let before = known.frame_of_points(&seen);
    let frame = known.frame_of_points(&cloud(vec![]));
    assert_eq!((frame.depths_mm(), frame.image().stamp), (&[0][..], STAMP));
    assert_eq!(known.frame_of_points(&seen), before);
}
