use geometry::{CameraModelError, DistortionError};
use proptest::prelude::*;

use super::*;

/// The calibration of the thesis' camera (Rec-HV, annex 2).
fn kinect() -> CameraInfo {
    CameraInfo {
        width: 640,
        height: 480,
        distortion_model: "plumb_bob".to_owned(),
        d: vec![0.138263, -0.279976, 0.002072, 0.008884, 0.0],
        k: [522.027679, 0.0, 305.805053, 0.0, 518.133164, 248.569689, 0.0, 0.0, 1.0],
        ..CameraInfo::default()
    }
}

#[test]
fn the_raw_camera_is_k_and_d() {
    let mut message = kinect();
    // Of the rectified image: not used.
    message.p = [9.0; 12];
    message.r = [9.0; 9];
    assert_eq!(
        camera_from_message(&message),
        Ok(CameraModel {
            width_px: 640,
            height_px: 480,
            fx_px: 522.027679,
            fy_px: 518.133164,
            cx_px: 305.805053,
            cy_px: 248.569689,
            distortion: Distortion::PlumbBob([0.138263, -0.279976, 0.002072, 0.008884, 0.0]),
        })
    );
}

/// [`kinect`] with what `camera_calibration` writes for the rectified image.
fn kinect_with_p() -> CameraInfo {
    let p = [511.25, 0.0, 310.5, -40.0, 0.0, 519.75, 247.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    CameraInfo { p, r: [9.0; 9], ..kinect() }
}

/// A lens that was taken out of an image is not taken out again.
#[test]
fn the_camera_of_a_rectified_image_is_p() {
    let message = kinect_with_p();
    let raw = camera_from_message(&message).unwrap();
    let rectified = CameraModel {
        fx_px: 511.25,
        fy_px: 519.75,
        cx_px: 310.5,
        cy_px: 247.0,
        distortion: Distortion::None,
        ..raw
    };
    for topic in [
        "/camera/depth/image_rect",
        "image_rect_raw",
        "/camera/depth/image_rect/compressedDepth",
        "/camera/rgb/image_rect_color/compressed",
        "/stereo/rectified_image",
    ] {
        assert_eq!(camera_of_image(&message, topic), Ok(rectified), "{topic}");
        let own = calibration_of_image(&message, topic);
        assert_eq!(camera_from_message(&own), Ok(rectified), "{topic}");
    }
    for topic in [
        "/camera/depth/image_raw",
        "depth/image",
        "/image_rect/points",
        "/rect/image_raw/compressedDepth",
        "/camera/direct",
        "/image_corrected",
        "",
    ] {
        assert_eq!(camera_of_image(&message, topic), Ok(raw), "{topic}");
    }
}

#[test]
fn a_rectified_image_without_p_has_the_camera_of_the_raw_one() {
    let message = kinect();
    let raw = camera_from_message(&message);
    assert_eq!(camera_of_image(&message, "/depth/image_rect"), raw);
}

#[test]
fn region_and_binning_move_and_scale_the_camera_of_a_rectified_image() {
    let mut message = kinect_with_p();
    message.k = [0.0; 9];
    message.roi =
        RegionOfInterest { x_offset: 100, y_offset: 40, width: 400, height: 300, do_rectify: true };
    (message.binning_x, message.binning_y) = (2, 4);
    let model = camera_of_image(&message, "/depth/image_rect").unwrap();
    assert_eq!((model.width_px, model.height_px), (200, 75));
    let near = |value: f64, expected: f64| (value - expected).abs() < 1e-9;
    assert!(near(model.fx_px, 511.25 / 2.0) && near(model.cy_px, 207.0 / 4.0), "{model:?}");
    message.p[1] = 0.5;
    let refused = camera_of_image(&message, "/depth/image_rect");
    let error = ConvertError::IntrinsicMatrix { index: 1, value: 0.5, expected: 0.0 };
    assert_eq!(refused, Err(error));
}

fn distortion_of(model: &str, d: &[f64]) -> Result<Distortion, ConvertError> {
    let distortion_model = model.to_owned();
    camera_from_message(&CameraInfo { distortion_model, d: d.to_vec(), ..kinect() })
        .map(|model| model.distortion)
}

/// Which lens it is: [`Distortion::of_model`].
#[test]
fn the_lens_is_that_of_the_model_and_its_coefficients() {
    let five = [0.1, 0.2, 0.3, 0.4, 0.5];
    assert_eq!(distortion_of("plumb_bob", &five), Ok(Distortion::PlumbBob(five)));
    let error = distortion_of("fov", &[0.9]).unwrap_err();
    assert!(matches!(error, ConvertError::Distortion(DistortionError::Model { .. })), "{error}");
    let error = distortion_of("plumb_bob", &[0.1, f64::NAN, 0.0, 0.0, 0.0]).unwrap_err();
    assert!(
        matches!(error, ConvertError::Camera(CameraModelError::Distortion { index: 1, .. })),
        "{error}"
    );
}

#[test]
fn a_camera_that_is_none_is_named() {
    assert_eq!(
        camera_from_message(&CameraInfo { k: [0.0; 9], ..kinect() }),
        Err(ConvertError::Uncalibrated)
    );
    let with = |index: usize, value: f64| {
        let mut message = kinect();
        message.k[index] = value;
        camera_from_message(&message).unwrap_err()
    };
    for (index, expected) in [(1, 0.0), (3, 0.0), (6, 0.0), (7, 0.0), (8, 1.0)] {
        let error = ConvertError::IntrinsicMatrix { index, value: 0.5, expected };
        assert_eq!(with(index, 0.5), error);
    }
    for (index, value) in [(0, 0.0), (0, -1.0), (4, f64::NAN), (2, f64::INFINITY), (5, f64::NAN)] {
        let error = with(index, value);
        assert!(matches!(error, ConvertError::Camera(_)), "k[{index}] = {value}: {error}");
    }
    let error = camera_from_message(&CameraInfo { width: 0, ..kinect() }).unwrap_err();
    assert!(matches!(error, ConvertError::Camera(CameraModelError::Size { .. })), "{error}");
}

#[test]
fn region_and_binning_move_and_scale_the_camera() {
    let mut message = kinect();
    message.roi = RegionOfInterest {
        x_offset: 100,
        y_offset: 40,
        width: 400,
        height: 300,
        do_rectify: false,
    };
    (message.binning_x, message.binning_y) = (2, 4);
    let model = camera_from_message(&message).unwrap();
    assert_eq!((model.width_px, model.height_px), (200, 75));
    let near = |value: f64, expected: f64| (value - expected).abs() < 1e-9;
    assert!(near(model.fx_px, 522.027679 / 2.0) && near(model.fy_px, 518.133164 / 4.0));
    assert!(near(model.cx_px, 205.805053 / 2.0) && near(model.cy_px, 208.569689 / 4.0));

    for (x_offset, width, height) in [(241, 400, 300), (u32::MAX, 400, 300), (0, 0, 5)] {
        message.roi = RegionOfInterest { x_offset, width, height, ..message.roi };
        let error = camera_from_message(&message).unwrap_err();
        assert!(matches!(error, ConvertError::RegionOutside { .. }), "{error}");
    }
}

proptest! {
    #[test]
    fn a_camera_comes_back(
        focal in proptest::array::uniform2(100.0..900.0_f64),
        centre in proptest::array::uniform2(0.0..600.0_f64),
        coefficients in proptest::array::uniform8(-0.5..0.5_f64),
        which in 0..3,
    ) {
        let [k1, k2, t1, t2, k3, ..] = coefficients;
        let distortion = match which {
            0 => Distortion::None,
            1 => Distortion::PlumbBob([k1, k2, t1, t2, k3]),
            _ => Distortion::Rational(coefficients),
        };
        let model = CameraModel {
            width_px: 640,
            height_px: 480,
            fx_px: focal[0],
            fy_px: focal[1],
            cx_px: centre[0],
            cy_px: centre[1],
            distortion,
        };
        let message = message_from_camera(&model, Stamp::from_nanos(5), "optical");
        prop_assert_eq!(&message.header.frame_id, "optical");
        prop_assert_eq!(camera_from_message(&message), Ok(model));
    }
}
