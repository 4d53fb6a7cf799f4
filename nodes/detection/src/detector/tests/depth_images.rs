//! The depth image of each cycle.

use super::*;

#[test]
fn every_cycle_has_a_depth_image_whatever_was_measured() {
    let camera = CameraModel { width_px: 40, height_px: 30, fx_px: 30.0, fy_px: 30.0, ..CAMERA };
    let depth_mm = |pixel: usize| 1000 + 7 * (pixel % 40) as u16 + 11 * (pixel / 40) as u16;
    let image = Arc::new(depth_image((40, 30), (0..1200).map(depth_mm).collect()));
    let pixels = (0..1200).map(|pixel| (pixel % 40, pixel / 40));
    let points: Vec<_> = pixels
        .map(|(column, row)| {
            let depth_m = image.depth_m(column, row).unwrap();
            let x = (column as f32 - camera.cx_px as f32) / 30.0;
            Point3::new(x * depth_m, row as f32 / 30.0 * depth_m, depth_m)
        })
        .collect();
    let mut twisted = points.clone();
    twisted.reverse();
    let free_space = || Detector::new(DetectionConfig::default()).unwrap();
    let projector = free_space().depth_projector(RayTable::new(&camera).unwrap());
    let (in_pixels, reversed) = (organised(40, &points), organised(40, &twisted));
    let (cloud, nothing) = (cloud(points), cloud(vec![]));
    let of_image = View::Depth(projector.image(&image).unwrap());
    let frame_of = |mut detector: Detector, view| {
        let cycle = step_with(&mut detector, &scan(None), view).unwrap().cycle;
        (cycle.reduced_cloud.stamp, cycle.depth)
    };
    let measured = |frame: &DepthFrame| {
        let of_pixel = |at: usize| {
            frame.image().depth_m(at % frame.camera().width_px, at / frame.camera().width_px)
        };
        (0..frame.image().pixels().len()).filter_map(of_pixel).count()
    };
    for view in [of_image, View::OrganisedPoints(&in_pixels)] {
        let (_, frame) = frame_of(free_space(), view);
        assert_eq!(frame.unwrap().image(), &*image, "{view:?}");
    }
    // Not computed with a pinhole camera, or without pixels: rendered.
    for (view, least) in [
        (View::OrganisedPoints(&reversed), 800),
        (View::PointsInCamera(&cloud), 800),
        (View::PointsInCamera(&nothing), 0),
    ] {
        let (stamp, frame) = frame_of(free_space(), view);
        let frame = frame.unwrap();
        assert_eq!((frame.image().stamp, frame.image().frame_id.as_str()), (stamp, "camera"));
        assert!(measured(&frame) >= least, "{} pixels of {view:?}", measured(&frame));
    }
    for view in [of_image, View::OrganisedPoints(&in_pixels), View::PointsInCamera(&cloud)] {
        assert_eq!(frame_of(detector(), view).1, None);
    }
}

#[test]
fn why_an_organised_cloud_was_rendered_is_in_the_statistics() {
    let points: Vec<_> = (0..1200).map(|pixel| slope_point(pixel % 40, pixel / 40)).collect();
    let reversed: Vec<_> = points.iter().rev().copied().collect();
    let (in_pixels, reversed) = (organised(40, &points), organised(40, &reversed));
    let mut detector = Detector::new(DetectionConfig::default()).unwrap();
    let mut not_pinhole = |view| {
        let statistics = step_with(&mut detector, &scan(None), view).unwrap().statistics;
        statistics.not_pinhole.map(|error| error.to_string())
    };
    assert_eq!(not_pinhole(View::OrganisedPoints(&in_pixels)), None);
    assert_eq!(not_pinhole(View::PointsInCamera(reversed.cloud())), None);
    let reason = not_pinhole(View::OrganisedPoints(&reversed)).unwrap();
    assert!(reason.contains("focal length"), "{reason}");
}

/// The pixels of the cloud before are kept for a cloud that lacks a quarter of its points, of which alone coarser ones are chosen.
#[test]
fn a_detector_that_has_forgotten_chooses_the_pixels_of_its_images_anew() {
    let points: Vec<_> = (0..1200).map(|pixel| slope_point(pixel % 40, pixel / 40)).collect();
    let is_measured =
        |index: usize| !((index as u32).wrapping_mul(2_654_435_761) >> 16).is_multiple_of(4);
    let fewer = points.iter().enumerate().filter(|(index, _)| is_measured(*index));
    let fewer = cloud(fewer.map(|(_, point_m)| *point_m).collect());
    let points = cloud(points);
    let fresh = || Detector::new(DetectionConfig::default()).unwrap();
    let camera = |detector: &mut Detector, cloud| {
        let view = View::PointsInCamera(cloud);
        *step_with(detector, &scan(None), view).unwrap().cycle.depth.unwrap().camera()
    };
    let mut detector = fresh();
    let first = camera(&mut detector, &points);
    assert_eq!(camera(&mut detector, &fewer), first);
    detector.forget();
    assert_ne!(camera(&mut detector, &fewer), first);
}

/// What a camera of 30 px sees in a pixel of a wall.
fn slope_point(column: usize, row: usize) -> Point3<f32> {
    Point3::new(2.0 * column as f32 / 30.0 - 1.3, 2.0 * row as f32 / 30.0 - 1.0, 2.0)
}
