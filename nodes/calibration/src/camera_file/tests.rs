use nalgebra::{Point2, Vector2};

use super::*;

/// Rec-HV Annex 2, as the node of the camera would load it.
const ANNEX_2: &str = include_str!("../../cameras/rec_hv_annex_2.yaml");

#[test]
fn annex_2_loads_as_it_is() {
    let file = camera_from_yaml(ANNEX_2).unwrap();
    assert_eq!(file.name.as_deref(), Some("narrow_stereo"));
    let CameraModel { width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion } = file.camera;
    assert_eq!((width_px, height_px), (640, 480));
    let rounded = |value: f64| (value * 1e6).round() / 1e6;
    // The matrices with six digits, as the annex prints them a second time.
    assert_eq!(
        [fx_px, fy_px, cx_px, cy_px].map(rounded),
        [522.027_679, 518.133_164, 305.805_053, 248.569_689]
    );
    let Distortion::PlumbBob(coefficients) = distortion else { panic!("{distortion:?}") };
    assert_eq!(coefficients.map(rounded), [0.138_263, -0.279_976, 0.002_072, 0.008_884, 0.0]);
    let rectified = file.rectified.unwrap();
    assert_eq!((rectified.fx_px, rectified.distortion), (528.405_090_332_031_2, Distortion::None));
}

/// The projection matrix of Annex 2 is not independent: `camera_calibration` computes it from the other two as the
/// camera of the largest rectangle that the undistorted image fills (`getOptimalNewCameraMatrix` with alpha 0, on a
/// grid of 9 x 9 pixels). Our lens model must give the same.
#[test]
fn the_projection_matrix_of_annex_2_follows_from_the_others() {
    const GRID: usize = 9;
    let CameraFile { camera, rectified, .. } = camera_from_yaml(ANNEX_2).unwrap();
    let printed = rectified.unwrap();
    let place = |index: usize, size_px: usize| (index * size_px) as f64 / (GRID - 1) as f64;
    let ray = |column: usize, row: usize| -> Vector2<f64> {
        camera
            .ray(&Point2::new(place(column, camera.width_px), place(row, camera.height_px)))
            .unwrap()
    };
    let last = GRID - 1;
    let along = |ray_of: &dyn Fn(usize) -> f64, choose: fn(f64, f64) -> f64| {
        (0..GRID).map(ray_of).reduce(choose).unwrap()
    };
    let left = along(&|row| ray(0, row).x, f64::max);
    let right = along(&|row| ray(last, row).x, f64::min);
    let top = along(&|column| ray(column, 0).y, f64::max);
    let bottom = along(&|column| ray(column, last).y, f64::min);
    let fx_px = (camera.width_px - 1) as f64 / (right - left);
    let fy_px = (camera.height_px - 1) as f64 / (bottom - top);
    let ours = [fx_px, fy_px, -fx_px * left, -fy_px * top];
    let theirs = [printed.fx_px, printed.fy_px, printed.cx_px, printed.cy_px];
    for (ours, theirs) in ours.into_iter().zip(theirs) {
        // OpenCV computes in single precision here.
        assert!((ours - theirs).abs() < 1e-4, "{ours} is not the printed {theirs}");
    }
}

#[test]
fn files_of_other_cameras_are_read_too() {
    let rational = ANNEX_2
        .replace("plumb_bob", "rational_polynomial")
        .replace("cols: 5", "cols: 8")
        .replace("0.008884031820898908, 0.0]", "0.008884031820898908, 0., 1, 2e-1, .5]");
    let Distortion::Rational(coefficients) = camera_from_yaml(&rational).unwrap().camera.distortion
    else {
        panic!("no rational model")
    };
    assert_eq!(coefficients[4..], [0.0, 1.0, 0.2, 0.5]);
    let with = |model: &str, numbers: &str, count: usize| {
        let text = rational.replace("rational_polynomial", model);
        let (before, behind) = text.split_once("distortion_coefficients").unwrap();
        let end = behind.find(']').unwrap();
        let numbers = format!(":\n  rows: 1\n  cols: {count}\n  data: [{numbers}");
        camera_from_yaml(&format!("{before}distortion_coefficients{numbers}{}", &behind[end..]))
            .map(|file| file.camera.distortion)
    };
    let prism = with("rational_polynomial", "0, 0, 0, 0, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0", 14);
    assert!(matches!(prism, Ok(Distortion::RationalPrism([.., 0.5, 0.0, 0.0, 0.0]))), "{prism:?}");
    let tilted = with("rational_polynomial", "1, 0, 0, 0, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.1", 14);
    assert!(tilted.unwrap_err().to_string().contains("13"));
    let fisheye = with("equidistant", "0, 0.1, 0, 0", 4);
    assert!(matches!(fisheye, Ok(Distortion::Equidistant([0.0, 0.1, 0.0, 0.0]))), "{fisheye:?}");

    // Files of 2009 name no model, and need no rectified camera.
    let (before, _) = ANNEX_2.split_once("rectification_matrix").unwrap();
    let old = before.replace("distortion_model: plumb_bob\n", "");
    let file = camera_from_yaml(&old).unwrap();
    assert!(matches!(file.camera.distortion, Distortion::PlumbBob(_)) && file.rectified.is_none());
}

#[test]
fn what_is_wrong_with_a_file_is_said() {
    let error = |from: &str, to: &str| {
        assert!(ANNEX_2.contains(from), "{from}");
        camera_from_yaml(&ANNEX_2.replace(from, to)).unwrap_err().to_string()
    };
    for (from, to, parts) in [
        ("image_width: 640", "image_width: wide", ["invalid", "line 3"].as_slice()),
        ("image_width: 640", "image_width: 0", &["0 x 480"]),
        ("camera_matrix", "matrix", &["camera_matrix"]),
        ("522.0276786799784, 0.0,", "522.0276786799784,", &["camera_matrix", "3 x 3"]),
        (
            "522.0276786799784, 0.0,",
            "522.0276786799784, 0.5,",
            &["camera_matrix", "element 1 is 0.5"],
        ),
        ("522.0276786799784", "-1", &["-1 and 518"]),
        ("plumb_bob", "fov", &["fov"]),
        ("plumb_bob", "equidistant", &["distortion_coefficients", "4"]),
        ("cols: 5", "cols: 4", &["distortion_coefficients", "1 x 4"]),
        ("0.13826258934353136", ".nan", &["coefficient 0"]),
        ("528.4050903320312, 0.0,", "528.4050903320312, 3.0,", &["projection_matrix", "element 1"]),
    ] {
        let error = error(from, to);
        assert!(parts.iter().all(|part| error.contains(part)), "{from} -> {to}: {error}");
    }
    assert!(camera_from_yaml("").is_err());
    assert!(camera_from_yaml("- 1").is_err());
}
