use super::*;

/// A Kinect's (freiburg1, as its authors calibrated it), and a wide lens by the rational model.
fn cameras() -> [CameraModel; 2] {
    let kinect = CameraModel {
        width_px: 640,
        height_px: 480,
        fx_px: 517.3,
        fy_px: 516.5,
        cx_px: 318.6,
        cy_px: 255.3,
        distortion: Distortion::PlumbBob([0.2624, -0.9531, -0.0054, 0.0026, 1.1633]),
    };
    let wide = Distortion::Rational([0.55, -2.6, 0.0006, -0.0002, 1.5, 0.43, -2.43, 1.43]);
    [kinect, CameraModel { distortion: wide, ..kinect }]
}

/// A pattern on the plane at 1 m, smooth.
fn brightness(x: f64, y: f64) -> f64 {
    127.0 + 60.0 * (9.0 * x).sin() + 60.0 * (11.0 * y + 3.0 * x).cos()
}

#[test]
fn a_pattern_seen_through_a_lens_is_what_a_pinhole_would_see() {
    for camera in cameras() {
        let pixels = (0..480).flat_map(|row| (0..640).map(move |column| (column, row)));
        let seen = pixels.map(|(column, row)| {
            let ray = camera.ray(&Point2::new(f64::from(column), f64::from(row)));
            ray.map_or(0, |ray| brightness(ray.x, ray.y).round() as u8)
        });
        let image = GrayImage::new(640, 480, seen.collect()).unwrap();
        let rectification = Rectification::new(&camera).unwrap();
        let rectified = rectification.rectify(&image).unwrap();
        let mut compared = 0;
        for row in 0..480 {
            for column in 0..640 {
                let x = (column as f64 - camera.cx_px) / camera.fx_px;
                let y = (row as f64 - camera.cy_px) / camera.fy_px;
                if !rectification.is_seen(column, row) {
                    continue;
                }
                let found = f64::from(rectified.pixel(column, row).unwrap());
                assert!((found - brightness(x, y)).abs() < 2.0, "{column} {row}: {found}");
                compared += 1;
            }
        }
        assert!(compared > 640 * 480 * 9 / 10, "{compared}");
    }
}

#[test]
fn without_distortion_nothing_changes() {
    let camera = CameraModel { distortion: Distortion::None, ..cameras()[0] };
    let pixels: Vec<u8> = (0..640 * 480_u64).map(|index| (index * 7919 % 251) as u8).collect();
    let image = GrayImage::new(640, 480, pixels.clone()).unwrap();
    let rectification = Rectification::new(&camera).unwrap();
    assert_eq!(rectification.rectify(&image).unwrap(), image);
    let depths = pixels.iter().map(|&pixel| u16::from(pixel) * 10).collect();
    let depth = DepthImage::new(
        geometry::Stamp::default(),
        "camera".to_owned(),
        (640, 480),
        DepthPixels::Millimetres(depths),
    );
    let depth = depth.unwrap();
    assert_eq!(rectification.rectify_depth(&depth).unwrap(), depth);
}

#[test]
fn a_depth_is_never_a_mixture_and_none_where_nothing_is_seen() {
    let camera = cameras()[0];
    // Seen from twice as wide as the lens sees.
    let target = CameraModel { fx_px: 250.0, fy_px: 250.0, distortion: Distortion::None, ..camera };
    let rectification = Rectification::between(&camera, &target).unwrap();
    let depths = (0..640 * 480).map(|index| if index % 640 < 320 { 1.0 } else { 3.0 }).collect();
    let depth = DepthImage::new(
        geometry::Stamp::default(),
        "camera".to_owned(),
        (640, 480),
        DepthPixels::Metres(depths),
    );
    let rectified = rectification.rectify_depth(&depth.unwrap()).unwrap();
    let (mut near, mut far) = (0, 0);
    for row in 0..480 {
        for column in 0..640 {
            match rectified.depth_m(column, row) {
                None => assert!(!rectification.is_seen(column, row)),
                Some(1.0) => near += 1,
                Some(3.0) => far += 1,
                Some(other) => panic!("{other}"),
            }
        }
    }
    assert!(near > 10_000 && far > 10_000, "{near} {far}");
    assert!(!rectification.is_seen(0, 0) && !rectification.is_seen(640, 0));
}

#[test]
fn what_does_not_fit_is_refused() {
    let [camera, _] = cameras();
    let rectification = Rectification::new(&camera).unwrap();
    let other = GrayImage::new(2, 2, vec![0; 4]).unwrap();
    let error = rectification.rectify(&other).unwrap_err();
    assert_eq!(
        error,
        RectificationError::ImageSize { width_px: 2, height_px: 2, camera_px: (640, 480) }
    );
    assert_eq!(Rectification::between(&camera, &camera), Err(RectificationError::DistortedTarget));
    let line = CameraModel { height_px: 1, ..camera };
    let too_small = RectificationError::TooSmall { width_px: 640, height_px: 1 };
    assert_eq!(Rectification::new(&line), Err(too_small));
    let blind = CameraModel { fx_px: 0.0, ..camera };
    assert!(matches!(Rectification::new(&blind), Err(RectificationError::Camera(_))));
}
