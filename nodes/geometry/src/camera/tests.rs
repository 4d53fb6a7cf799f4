use proptest::prelude::*;

use super::*;

/// The colour camera of the thesis' Kinect v1 (Rec-HV Annex 2).
fn annex_2_camera() -> CameraModel {
    CameraModel {
        width_px: 640,
        height_px: 480,
        fx_px: 522.027_679,
        fy_px: 518.133_164,
        cx_px: 305.805_053,
        cy_px: 248.569_689,
        distortion: Distortion::PlumbBob([0.138_263, -0.279_976, 0.002_072, 0.008_884, 0.0]),
    }
}

/// Strong barrel distortion that the denominator tames, in the manner of an Azure Kinect.
fn rational_camera() -> CameraModel {
    let coefficients = [0.52, -2.5, 0.000_4, -0.000_2, 1.4, 0.4, -2.3, 1.35];
    CameraModel { distortion: Distortion::Rational(coefficients), ..annex_2_camera() }
}

/// The colour camera of an OAK: a rational model with a thin prism.
fn prism_camera() -> CameraModel {
    let coefficients =
        [0.52, -2.5, 0.000_4, -0.000_2, 1.4, 0.4, -2.3, 1.35, 0.001, -0.000_4, 0.000_7, 0.000_2];
    CameraModel { distortion: Distortion::RationalPrism(coefficients), ..annex_2_camera() }
}

/// A fisheye lens that sees 150 degrees from corner to corner.
fn fisheye_camera() -> CameraModel {
    let distortion = Distortion::Equidistant([0.02, -0.01, 0.003, -0.000_5]);
    CameraModel { distortion, fx_px: 300.0, fy_px: 301.0, ..annex_2_camera() }
}

fn cameras() -> [CameraModel; 5] {
    let pinhole = CameraModel { distortion: Distortion::None, ..annex_2_camera() };
    [pinhole, annex_2_camera(), rational_camera(), prism_camera(), fisheye_camera()]
}

proptest! {
    #[test]
    fn a_pixel_seen_along_its_ray_is_the_pixel_itself(
        column in -0.5..639.49_f64, row in -0.5..479.49_f64, depth_m in 0.1..20.0_f64,
    ) {
        for camera in cameras() {
            let pixel = Point2::new(column, row);
            let ray = camera.ray(&pixel).unwrap();
            let point = Point3::new(ray.x * depth_m, ray.y * depth_m, depth_m);
            // Rounding may carry the outermost edge out of the image.
            if let Some(again) = camera.project(&point) {
                prop_assert!((again - pixel).norm() < 1e-6, "{again} is not {pixel} for {camera:?}");
            } else {
                prop_assert!(column < -0.499 || row < -0.499 || column > 639.48 || row > 479.48);
            }
        }
    }

    #[test]
    fn the_table_holds_the_rays_of_the_camera(column in 0..640_usize, row in 0..480_usize) {
        for camera in cameras() {
            let small = CameraModel { width_px: column + 1, height_px: row % 7 + 1, ..camera };
            let table = RayTable::new(&small).unwrap();
            let expected = camera.ray(&Point2::new(column as f64, (row % 7) as f64)).unwrap();
            prop_assert_eq!(table.ray(column, row % 7).unwrap(), expected.cast::<f32>());
            prop_assert_eq!(table.ray(column + 1, 0), None);
            prop_assert_eq!(table.ray(0, row % 7 + 1), None);
        }
    }

    #[test]
    fn no_number_makes_the_camera_panic(
        numbers in proptest::array::uniform12(any::<f64>()),
        ray in proptest::array::uniform2(any::<f64>()),
    ) {
        let [k1, k2, k3, k4, k5, k6, k7, k8, ..] = numbers;
        for distortion in [
            Distortion::Rational([k1, k2, k3, k4, k5, k6, k7, k8]),
            Distortion::RationalPrism(numbers),
            Distortion::Equidistant([k1, k2, k3, k4]),
        ] {
            let ray = Vector2::from(ray);
            let (_, _) = (distortion.distort(&ray), distortion.undistort(&ray));
            let camera = CameraModel { width_px: 3, height_px: 2, distortion, ..annex_2_camera() };
            let _ = RayTable::new(&camera);
        }
    }
}

/// Computed by hand from the model's definition, term by term.
#[test]
fn the_plumb_bob_model_shows_a_ray_where_its_terms_say() {
    let distortion = Distortion::PlumbBob([0.1, 0.01, 0.001, 0.002, 0.5]);
    // r2 = 0.25; radial = 1 + 0.025 + 0.000625 + 0.0078125 = 1.0334375.
    // x: 0.3 * radial + 2 * 0.001 * 0.12 + 0.002 * (0.25 + 0.18) = 0.31003125 + 0.00024 + 0.00086
    // y: 0.4 * radial + 0.001 * (0.25 + 0.32) + 2 * 0.002 * 0.12 = 0.413375 + 0.00057 + 0.00048
    let seen = distortion.distort(&Vector2::new(0.3, 0.4)).unwrap();
    assert!((seen - Vector2::new(0.311_131_25, 0.414_425)).norm() < 1e-15, "{seen}");
}

#[test]
fn the_rational_model_divides_by_its_denominator() {
    let distortion = Distortion::Rational([0.1, 0.01, 0.0, 0.0, 0.5, 0.2, 0.4, 0.8]);
    // r2 = 0.25; denominator = 1 + 0.05 + 0.025 + 0.0125 = 1.0875.
    let seen = distortion.distort(&Vector2::new(0.3, 0.4)).unwrap();
    let expected = Vector2::new(0.3, 0.4) * (1.033_437_5 / 1.087_5);
    assert!((seen - expected).norm() < 1e-15, "{seen}");
}

/// Computed by hand, as above; the prism adds s1 * r2 + s2 * r2^2 to x, s3 and s4 alike to y.
#[test]
fn a_thin_prism_shifts_what_is_off_the_axis() {
    let prism = [0.1, 0.01, 0.0, 0.0, 0.5, 0.2, 0.4, 0.8, 0.01, 0.02, -0.03, 0.04];
    let seen = Distortion::RationalPrism(prism).distort(&Vector2::new(0.3, 0.4)).unwrap();
    let shift = Vector2::new(0.01 * 0.25 + 0.02 * 0.0625, -0.03 * 0.25 + 0.04 * 0.0625);
    let expected = Vector2::new(0.3, 0.4) * (1.033_437_5 / 1.087_5) + shift;
    assert!((seen - expected).norm() < 1e-15, "{seen}");
}

#[test]
fn an_ideal_fisheye_lens_shows_equal_angles_at_equal_distances() {
    let ideal = Distortion::Equidistant([0.0; 4]);
    assert!(!ideal.is_none());
    for degrees in [0.0_f64, 1e-7, 1.0, 30.0, 60.0, 80.0] {
        let angle_rad = degrees.to_radians();
        let seen = ideal.distort(&(Vector2::new(0.6, -0.8) * angle_rad.tan())).unwrap();
        assert!((seen - Vector2::new(0.6, -0.8) * angle_rad).norm() < 1e-12, "{degrees}: {seen}");
    }
    // 0.5 * (1 + 0.1 * 0.25 + 0.2 * 0.0625).
    let seen =
        Distortion::Equidistant([0.1, 0.2, 0.0, 0.0]).distort(&Vector2::new(0.5_f64.tan(), 0.0));
    assert!((seen.unwrap() - Vector2::new(0.518_75, 0.0)).norm() < 1e-12);
}

#[test]
fn what_is_not_before_the_camera_has_no_pixel() {
    for camera in cameras() {
        for (point, seen) in [
            (Point3::new(0.0, 0.0, 1.0), true),
            (Point3::new(0.0, 0.0, -1.0), false),
            (Point3::new(0.0, 0.0, 0.0), false),
            (Point3::new(9.0, 0.0, 1.0), false),
            (Point3::new(0.0, -9.0, 1.0), false),
            (Point3::new(f64::NAN, 0.0, 1.0), false),
            (Point3::new(0.0, 0.0, f64::NAN), false),
        ] {
            assert_eq!(camera.project(&point).is_some(), seen, "{point} with {camera:?}");
        }
    }
}

#[test]
fn a_ray_beyond_the_fold_of_the_lens_model_is_not_seen() {
    // x (1 - 0.3 x^2) grows up to x = 1.054 and then comes back: at 1.7 it passes the middle again.
    let barrel = Distortion::PlumbBob([-0.3, 0.0, 0.0, 0.0, 0.0]);
    let camera = CameraModel { distortion: barrel, fx_px: 300.0, fy_px: 300.0, ..annex_2_camera() };
    assert!(camera.project(&Point3::new(1.0, 0.0, 1.0)).is_some());
    assert_eq!(camera.project(&Point3::new(1.7, 0.0, 1.0)), None);
    // Nothing is shown beyond 0.703.
    assert!(barrel.undistort(&Vector2::new(0.69, 0.0)).is_some());
    assert_eq!(barrel.undistort(&Vector2::new(0.75, 0.0)), None);
}

#[test]
fn distortion_of_zeros_is_no_distortion() {
    let zeros = CameraModel { distortion: Distortion::PlumbBob([0.0; 5]), ..annex_2_camera() };
    let none = CameraModel { distortion: Distortion::None, ..annex_2_camera() };
    let (zeros, none) = (RayTable::new(&zeros).unwrap(), RayTable::new(&none).unwrap());
    for (column, row) in (0..480).flat_map(|row| (0..640).map(move |column| (column, row))) {
        assert_eq!(zeros.ray(column, row), none.ray(column, row));
    }
}

#[test]
fn numbers_that_describe_no_camera_are_refused() {
    let good = annex_2_camera();
    assert_eq!(good.validate(), Ok(()));
    let bad_coefficients = Distortion::PlumbBob([0.0, 0.0, 0.0, f64::INFINITY, 0.0]);
    for (camera, part) in [
        (CameraModel { width_px: 0, ..good }, "0 x 480"),
        (CameraModel { width_px: usize::MAX, height_px: 2, ..good }, "16777216"),
        (CameraModel { width_px: 1 << 13, height_px: 1 << 12, ..good }, "8192 x 4096"),
        (CameraModel { fx_px: 0.0, ..good }, "0 and 518.133164"),
        (CameraModel { fy_px: f64::NAN, ..good }, "NaN"),
        (CameraModel { cx_px: f64::INFINITY, ..good }, "column inf"),
        (CameraModel { fx_px: 5e-324, ..good }, "a focal length of 5e-324 px"),
        (CameraModel { fy_px: 1e300, ..good }, "at most 1000000 px"),
        (CameraModel { cy_px: -1e5, ..good }, "a pixel 100480.0 px from the principal point"),
        (CameraModel { distortion: bad_coefficients, ..good }, "coefficient 3 is inf"),
    ] {
        let error = RayTable::new(&camera).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
}
