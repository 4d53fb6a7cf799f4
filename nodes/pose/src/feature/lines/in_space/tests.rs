//! Lines of known place under depth images of known surfaces.

use geometry::{CameraModel, DepthImage, DepthPixels, Distortion, Stamp};
use nalgebra::{Point2, Point3, Vector3};

use super::{DepthSensor, NoLineInSpace, SegmentDepthConfig, SegmentInSpace, segment_in_space};
use crate::feature::lines::LineSegment;
use crate::feature::lines::testing::Random;

/// What the Kinect's depth deviates by, in 1/m.
const NOISE: f64 = 1.5e-3;

fn camera() -> CameraModel {
    CameraModel {
        width_px: 320,
        height_px: 240,
        fx_px: 260.0,
        fy_px: 262.0,
        cx_px: 158.3,
        cy_px: 121.9,
        distortion: Distortion::None,
    }
}

/// A depth image: the depth along the axis as `depth_m` gives it for a pixel's ray, with noise of its inverse.
fn depth_image(noise: f64, depth_m: impl Fn(Point2<f64>) -> Option<f64>) -> DepthImage {
    let (camera, mut random) = (camera(), Random::new(4));
    let mut depths_m = Vec::new();
    for row in 0..camera.height_px {
        for column in 0..camera.width_px {
            let off = noise * random.normal();
            let pixel = Point2::new(column as f64, row as f64);
            let depth_m = depth_m(pixel).map(|depth_m| 1.0 / (1.0 / depth_m + off));
            depths_m.push(depth_m.map_or(f32::NAN, |depth_m| depth_m as f32));
        }
    }
    let size_px = (camera.width_px, camera.height_px);
    let pixels = DepthPixels::Metres(depths_m);
    DepthImage::new(Stamp::default(), "camera".to_owned(), size_px, pixels).unwrap()
}

/// The depth at which a pixel sees a plane, `normal . p = offset`.
fn plane(normal: [f64; 3], offset_m: f64) -> impl Fn(Point2<f64>) -> Option<f64> {
    move |pixel| {
        let ray = camera().ray(&pixel).unwrap();
        Some(offset_m / Vector3::from(normal).dot(&Vector3::new(ray.x, ray.y, 1.0)))
    }
}

fn segment(start_px: [f32; 2], end_px: [f32; 2]) -> LineSegment {
    LineSegment { start_px, end_px, response: 10.0 }
}

fn found(segment: &LineSegment, depth: &DepthImage) -> Result<SegmentInSpace, NoLineInSpace> {
    let (sensor, config) = (DepthSensor::default(), SegmentDepthConfig::default());
    segment_in_space(segment, depth, &camera(), sensor, &config)
}

/// The point that a pixel sees at a depth.
fn seen(px: [f32; 2], depth_m: impl Fn(Point2<f64>) -> Option<f64>) -> Point3<f64> {
    let pixel = Point2::from(px.map(f64::from));
    let (ray, depth_m) = (camera().ray(&pixel).unwrap(), depth_m(pixel).unwrap());
    Point3::new(ray.x * depth_m, ray.y * depth_m, depth_m)
}

#[test]
fn a_line_on_a_slanting_plane_lies_on_it() {
    let surface = || plane([0.5, -0.3, 1.0], 2.0);
    for noise in [0.0, NOISE] {
        let depth = depth_image(noise, surface());
        for ends in [[[40.3, 30.8], [250.1, 180.4]], [[60.0, 200.0], [60.0, 40.0]]] {
            let segment = segment(ends[0], ends[1]);
            let line = found(&segment, &depth).unwrap();
            // Without noise a float's depth and the median beside the segment are what is left.
            let within_m = if noise > 0.0 { 0.012 } else { 0.002 };
            for (point, px) in [(line.start_m, ends[0]), (line.end_m, ends[1])] {
                let off_m = (point - seen(px, surface())).norm();
                assert!(off_m < within_m + 0.012, "{noise}: {off_m} m along");
                let off_m = Vector3::new(0.5, -0.3, 1.0).normalize().dot(&point.coords)
                    - 2.0 / Vector3::new(0.5, -0.3, 1.0_f64).norm();
                assert!(off_m.abs() < within_m, "{noise}: {off_m} m off the plane");
            }
            assert!(line.support > 0.97, "{line:?}");
            let usual_m = noise * 2.0 * 2.0;
            assert!(line.rms_m < 1.5 * usual_m + 0.003, "{line:?}");
        }
    }
}

#[test]
fn the_stated_deviation_is_that_of_the_ends() {
    let surface = || plane([0.2, 0.1, 1.0], 2.5);
    let segment = segment([60.2, 50.7], [230.9, 170.3]);
    let truth_m = seen(segment.start_px, surface()).z;
    let (mut squares, mut stated) = (0.0, 0.0);
    let rounds = 40;
    for round in 0..rounds {
        // Noise as a Kinect has it: alike over a window of 5 x 5 pixels.
        let mut random = Random::new(round);
        let windows: Vec<f64> = (0..64 * 48).map(|_| NOISE * random.normal()).collect();
        let depth = depth_image(0.0, |pixel| {
            let window = (pixel.y as usize / 5) * 64 + pixel.x as usize / 5;
            surface()(pixel).map(|depth_m| 1.0 / (1.0 / depth_m + windows[window]))
        });
        let line = found(&segment, &depth).unwrap();
        squares += (line.start_m.z - truth_m).powi(2) / rounds as f64;
        stated += line.start_std_dev_m / rounds as f64;
    }
    let ratio = squares.sqrt() / stated;
    assert!((0.4..1.6).contains(&ratio), "it deviates by {ratio} of what is stated");
}

#[test]
fn at_a_depth_edge_the_line_is_that_of_the_nearer_surface() {
    let near = || plane([0.0, 0.2, 1.0], 1.5);
    let far = || plane([0.3, 0.0, 1.0], 3.0);
    for turned in [false, true] {
        // What is near fills one half; the edge is upright.
        let is_near = move |pixel: Point2<f64>| (pixel.x < 150.5) != turned;
        let surface = move |pixel| if is_near(pixel) { near()(pixel) } else { far()(pixel) };
        let depth = depth_image(NOISE, surface);
        let segment = segment([150.5, 40.0], [150.5, 200.0]);
        let line = found(&segment, &depth).unwrap();
        for (point, px) in [(line.start_m, segment.start_px), (line.end_m, segment.end_px)] {
            let off_m = point.z - seen(px, near()).z;
            assert!(off_m.abs() < 0.01, "{turned}: {off_m}");
        }
        assert!(line.support > 0.9, "{line:?}");
    }
}

#[test]
fn the_shadow_beside_an_edge_and_holes_do_not_matter() {
    let near = || plane([0.0, 0.2, 1.0], 1.5);
    // Nothing is measured right of the edge, nor on a quarter of its left.
    let surface = |pixel: Point2<f64>| {
        let is_hole = (60.0..100.0).contains(&pixel.y);
        if pixel.x < 150.5 && !is_hole { near()(pixel) } else { None }
    };
    let segment = segment([150.5, 40.0], [150.5, 200.0]);
    let line = found(&segment, &depth_image(NOISE, surface)).unwrap();
    assert!((0.65..0.8).contains(&line.support), "{line:?}");
    let off_m = (line.start_m - seen(segment.start_px, near())).norm();
    assert!(off_m < 0.015, "{off_m}");
}

#[test]
fn a_line_reaches_no_farther_than_depth_shows() {
    let near = || plane([0.0, 0.2, 1.0], 1.5);
    let surface = |pixel: Point2<f64>| if pixel.y > 90.0 { near()(pixel) } else { None };
    let segment = segment([150.5, 40.0], [150.5, 200.0]);
    let line = found(&segment, &depth_image(0.0, surface)).unwrap();
    let first = seen([150.5, 90.5], near());
    assert!((line.start_m - first).norm() < 0.01, "{line:?} {first}");
    assert!((line.end_m - seen(segment.end_px, near())).norm() < 0.01);
}

#[test]
fn outliers_are_left_out() {
    let near = || plane([0.0, 0.2, 1.0], 1.5);
    let segment = segment([150.5, 40.0], [150.5, 200.0]);
    // Something else stands before a third of the line, at its start, in its middle or at its end.
    for hidden in [30.0..93.0, 110.0..163.0, 147.0..230.0] {
        let surface =
            |pixel: Point2<f64>| if hidden.contains(&pixel.y) { Some(0.9) } else { near()(pixel) };
        let line = found(&segment, &depth_image(NOISE, surface)).unwrap();
        assert!((0.6..0.72).contains(&line.support), "{hidden:?}: {line:?}");
        let off = |point: Point3<f64>| Vector3::new(0.0, 0.2, 1.0).dot(&point.coords) - 1.5;
        assert!(off(line.start_m).abs() < 0.01 && off(line.end_m).abs() < 0.01, "{line:?}");
    }
}

#[test]
fn what_has_too_few_depths_is_refused() {
    let segment = segment([150.5, 40.0], [150.5, 200.0]);
    let refusal = found(&segment, &depth_image(0.0, |_| None)).unwrap_err();
    assert_eq!(refusal, NoLineInSpace::TooFewDepths { measured: 0, places: 161 });
    let far = found(&segment, &depth_image(0.0, plane([0.0, 0.0, 1.0], 9.0))).unwrap_err();
    assert_eq!(far, NoLineInSpace::TooFewDepths { measured: 0, places: 161 });
    let part = |pixel: Point2<f64>| (pixel.y > 130.0).then_some(1.0);
    let refusal = found(&segment, &depth_image(0.0, part)).unwrap_err();
    assert!(matches!(refusal, NoLineInSpace::TooFewDepths { measured: 60..=80, .. }), "{refusal}");
}

#[test]
fn a_line_over_a_curved_surface_is_refused() {
    let segment = segment([60.0, 120.0], [260.0, 120.0]);
    // An upright cylinder, 2 m off in the middle, from nearly flat to round.
    for (radius_m, is_line, is_bent) in [
        (60.0, true, false),
        (10.0, false, true),
        (7.0, false, true),
        (1.5, false, false),
        (0.9, false, false),
    ] {
        let cylinder = |pixel: Point2<f64>| {
            // (x d)^2 + (d - c)^2 = r^2 for the depth d, the axis being c = 2 + r m off.
            let (x, c) = (camera().ray(&pixel)?.x, 2.0 + radius_m);
            let (a, b) = (x * x + 1.0, -2.0 * c);
            let root = b * b - 4.0 * a * (c * c - radius_m * radius_m);
            (root >= 0.0).then(|| (-b - root.sqrt()) / (2.0 * a))
        };
        for noise in [0.0, NOISE] {
            let result = found(&segment, &depth_image(noise, cylinder));
            let kind = match result {
                Ok(_) => (true, false),
                Err(NoLineInSpace::Bent { .. }) => (false, true),
                Err(_) => (false, false),
            };
            assert_eq!(kind, (is_line, is_bent), "radius {radius_m}, noise {noise}: {result:?}");
        }
    }
}

#[test]
fn two_lines_that_intersect_are_not_one() {
    // The inner corner of a room: the middle is far, the ends are near.
    let corner = |pixel: Point2<f64>| {
        let x = camera().ray(&pixel)?.x;
        Some(3.0 / (1.0 + 0.8 * x.abs()))
    };
    let result = found(&segment([60.0, 120.0], [260.0, 120.0]), &depth_image(NOISE, corner));
    assert!(
        matches!(result, Err(NoLineInSpace::Bent { .. } | NoLineInSpace::NotStraight { .. })),
        "{result:?}"
    );
}

#[test]
fn depths_without_any_order_are_refused() {
    let depth = depth_image(0.1, plane([0.0, 0.0, 1.0], 2.0));
    let refusal = found(&segment([60.0, 120.0], [260.0, 120.0]), &depth).unwrap_err();
    assert!(matches!(refusal, NoLineInSpace::NotStraight { .. }), "{refusal}");
}

#[test]
fn a_segment_that_is_none_is_refused() {
    let depth = depth_image(0.0, plane([0.0, 0.0, 1.0], 2.0));
    for ends in [
        [[5.0, 5.0], [5.0, 5.0]],
        [[f32::NAN, 0.0], [5.0, 5.0]],
        [[0.0, 0.0], [f32::INFINITY, 5.0]],
        [[-1e9, 0.0], [1e9, 0.0]],
    ] {
        assert_eq!(found(&segment(ends[0], ends[1]), &depth), Err(NoLineInSpace::NoRay));
    }
    // Out of the image there is no depth.
    let refusal = found(&segment([-50.0, -50.0], [-10.0, -10.0]), &depth).unwrap_err();
    assert!(matches!(refusal, NoLineInSpace::TooFewDepths { measured: 0, .. }), "{refusal}");
}

#[test]
fn each_bad_parameter_is_named() {
    type Spoil = fn(&mut SegmentDepthConfig);
    assert_eq!(SegmentDepthConfig::default().validate(), Ok(()));
    let cases: [(&str, Spoil); 7] = [
        ("farthest_side_px", |c| c.farthest_side_px = 0),
        ("step_std_devs", |c| c.step_std_devs = -1.0),
        ("max_std_devs", |c| c.max_std_devs = f64::NAN),
        ("max_bend_std_devs", |c| c.max_bend_std_devs = 0.0),
        ("min_samples", |c| c.min_samples = 2),
        ("min_support", |c| c.min_support = 1.5),
        ("min_agreement", |c| c.min_agreement = -0.1),
    ];
    for (name, spoil) in cases {
        let mut config = SegmentDepthConfig::default();
        spoil(&mut config);
        let message = config.validate().unwrap_err().to_string();
        assert!(message.contains(name), "{message}");
    }
}
