use nalgebra::{Isometry3, Vector3};

use super::*;
use crate::camera_file::camera_from_yaml;
use crate::testing::Random;

/// Rec-HV eq. 11 and 12.
const PUBLISHED_PX: f64 = 0.114397;
/// The field of view and the columns that the annex takes.
const FIELD_OF_VIEW_RAD: f64 = 57.0 * std::f64::consts::PI / 180.0;
const COLUMNS: usize = 640;

#[test]
fn the_angle_of_the_published_error_is_the_published_one() {
    let angle_rad = angle_of_px_rad(PUBLISHED_PX, FIELD_OF_VIEW_RAD, COLUMNS);
    // Eq. 13 rounds 57 / 640 = 0.0890625 to 0.089.
    let rounded = 0.089 / (57.0 / 640.0);
    assert!((angle_rad.to_degrees() * rounded - 0.010_181_35).abs() < 5e-8);
    assert!((angle_rad.to_degrees() - 0.010_188_48).abs() < 5e-8);
}

/// Eq. 14 and 15 print what a calculator shows that takes degrees for gradians.
#[test]
fn the_published_shifts_are_those_of_gradians() {
    let of_gradians = |angle: f64| (angle * std::f64::consts::PI / 200.0).tan() * 3.0;
    assert!((of_gradians(1.0) - 0.047).abs() < 5e-4);
    assert!((of_gradians(0.010_181_35) - 0.004_797 / 10.0).abs() < 5e-7);
    // What they should be.
    assert!((sideways_m(1_f64.to_radians(), 3.0) - 0.052_365).abs() < 1e-6);
    let angle_rad = angle_of_px_rad(PUBLISHED_PX, FIELD_OF_VIEW_RAD, COLUMNS);
    assert!((sideways_m(angle_rad, 3.0) - 0.000_533).abs() < 1e-6);
}

/// Twenty views of a board of 8 x 6 corners 25 mm apart, as the camera of Annex 2 shows them.
fn boards(camera: &CameraModel, corner_noise_px: f64) -> Vec<BoardView> {
    let mut noise = Random::new(7);
    (0..20)
        .map(|view| {
            let turn = Vector3::new(0.1, 0.05, 0.02) * (f64::from(view % 5) - 2.0);
            let aside_m = 0.1 * (f64::from(view % 3) - 1.0);
            let away_m = 0.5 + 0.02 * f64::from(view);
            let camera_from_board =
                Isometry3::new(Vector3::new(aside_m - 0.09, -0.06, away_m), turn);
            let corners = (0..48)
                .map(|corner| {
                    let (column, row) = (f64::from(corner % 8), f64::from(corner / 8));
                    let on_board_m = Point3::new(0.025 * column, 0.025 * row, 0.0);
                    let seen_px = camera.project(&(camera_from_board * on_board_m)).unwrap();
                    let (aside_px, below_px) = (noise.normal(), noise.normal());
                    let found_px =
                        seen_px + nalgebra::Vector2::new(aside_px, below_px) * corner_noise_px;
                    (on_board_m, found_px)
                })
                .collect();
            BoardView { camera_from_board, corners }
        })
        .collect()
}

/// What the published error says of the camera: its corners are found to 0.081 px along rows and along columns.
#[test]
fn the_camera_of_annex_2_has_the_error_of_annex_1_when_corners_are_found_to_8_hundredths_of_a_pixel()
 {
    let camera =
        camera_from_yaml(include_str!("../../cameras/rec_hv_annex_2.yaml")).unwrap().camera;
    let error = reprojection_error(&camera, &boards(&camera, PUBLISHED_PX / 2_f64.sqrt())).unwrap();
    assert!((error.rms_px / PUBLISHED_PX - 1.0).abs() < 0.05, "{} px", error.rms_px);
    assert_eq!(error.views_px.len(), 20);
    // Without its distortion the same camera is far off.
    let straight = CameraModel { distortion: geometry::Distortion::None, ..camera };
    let error = reprojection_error(&straight, &boards(&camera, 0.0)).unwrap();
    assert!(error.rms_px > 5.0 * PUBLISHED_PX, "{} px", error.rms_px);
    assert!(reprojection_error(&camera, &boards(&camera, 0.0)).unwrap().rms_px < 1e-9);
}

#[test]
fn without_corners_there_is_no_error() {
    let camera =
        camera_from_yaml(include_str!("../../cameras/rec_hv_annex_2.yaml")).unwrap().camera;
    assert_eq!(reprojection_error(&camera, &[]), Err(ReprojectionFailure::NoCorner));
    let behind = BoardView {
        camera_from_board: Isometry3::translation(0.0, 0.0, -1.0),
        corners: vec![(Point3::origin(), Point2::origin())],
    };
    let unseen = ReprojectionFailure::Unseen { view: 0, corner: 0 };
    assert_eq!(reprojection_error(&camera, &[behind]), Err(unseen));
}
