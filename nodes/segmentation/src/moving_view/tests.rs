use geometry::{CameraModel, DepthImage, DepthPixels, Distortion, pose_from_vector};
use proptest::prelude::*;

use super::*;
use crate::moving_pixels::MovingPixels;

/// An object of this size before a wall, both parallel to the image.
const OBJECT_M: f64 = 1.5;
const WALL_M: f64 = 3.0;
const HALF_WIDTH_M: f64 = 0.2;
const HALF_HEIGHT_M: f64 = 0.3;
/// What the object has above it that is not measured.
const HAIR_M: f64 = 0.1;

fn camera((width_px, height_px): (usize, usize), focal_px: f64) -> CameraModel {
    CameraModel {
        width_px,
        height_px,
        fx_px: focal_px,
        fy_px: focal_px,
        cx_px: width_px as f64 / 2.0 - 0.5,
        cy_px: height_px as f64 / 2.0 - 0.5,
        distortion: Distortion::None,
    }
}

fn depth_camera() -> CameraModel {
    camera((320, 240), 260.0)
}

fn grid() -> VoxelGrid {
    VoxelGrid::new(0.08).unwrap()
}

/// Optical axes in the rig's.
fn rig_from_camera() -> Isometry3<f64> {
    let quarter = std::f64::consts::FRAC_PI_2;
    pose_from_vector(&[0.0, 0.0, 0.0, -quarter, 0.0, -quarter])
}

/// Whether a pixel of a camera, which is this far to the right of the depth camera, shows the object or its hair, and which.
fn shows(camera: &CameraModel, right_m: f64, pixel: usize) -> [bool; 2] {
    let at = |pixel: usize, middle: f64, focal: f64| OBJECT_M * (pixel as f64 - middle) / focal;
    let x_m = at(pixel % camera.width_px, camera.cx_px, camera.fx_px) + right_m;
    let y_m = at(pixel / camera.width_px, camera.cy_px, camera.fy_px);
    let is_within = x_m.abs() < HALF_WIDTH_M;
    let is_hair = (-HALF_HEIGHT_M - HAIR_M..-HALF_HEIGHT_M).contains(&y_m);
    [is_within && y_m.abs() < HALF_HEIGHT_M, is_within && is_hair]
}

fn frame(camera: &CameraModel, depth_mm: impl Fn(usize) -> u16) -> DepthFrame {
    let size_px = (camera.width_px, camera.height_px);
    let depths_mm = (0..size_px.0 * size_px.1).map(depth_mm).collect();
    let pixels = DepthPixels::Millimetres(depths_mm);
    let image = DepthImage::new(Stamp::default(), "camera".to_owned(), size_px, pixels).unwrap();
    DepthFrame::new(image, *camera).unwrap()
}

/// The object before the wall, whose hair is not measured where there is some.
fn object(camera: &CameraModel, has_hair: bool) -> DepthFrame {
    frame(camera, |pixel| match shows(camera, 0.0, pixel) {
        [true, _] => (1e3 * OBJECT_M) as u16,
        [_, true] if has_hair => 0,
        _ => (1e3 * WALL_M) as u16,
    })
}

/// Points of the object in the rig, a voxel's edge from each other, at a velocity.
fn moving(velocity_m_per_s: Vector3<f64>) -> Vec<(Point3<f32>, Vector3<f64>)> {
    let along = |half_m: f64| {
        let points = (2.0 * half_m / 0.04) as usize;
        (0..points).map(move |index| 0.02 + index as f64 * 0.04 - half_m)
    };
    let in_camera = along(HALF_WIDTH_M)
        .flat_map(|x| along(HALF_HEIGHT_M).map(move |y| Point3::new(x, y, OBJECT_M)));
    in_camera.map(|point| ((rig_from_camera() * point).cast(), velocity_m_per_s)).collect()
}

fn mask_and_view(frame: &DepthFrame) -> (Vec<bool>, MovingView) {
    let moving = moving(Vector3::zeros());
    let points = moving.iter().map(|(point, _)| point);
    let mask = MovingPixels::new(grid()).mask(frame, (&rig_from_camera(), None), None, points);
    let view = MovingView::of_mask(frame, &rig_from_camera(), &mask, &moving, &grid());
    (mask, view)
}

fn seen(view: &MovingView, camera: &CameraModel, colour_from_depth: &Isometry3<f64>) -> Vec<bool> {
    let mut splats = Splats::new(camera);
    view.splat(colour_from_depth, (&Isometry3::identity(), 0.0), &mut splats);
    splats.into_mask()
}

/// The pixels around each true one, up to a margin.
fn widened(mask: &[bool], width_px: usize, margin_px: usize) -> Vec<bool> {
    let height_px = mask.len() / width_px;
    let mut wide = vec![false; mask.len()];
    for pixel in (0..mask.len()).filter(|pixel| mask[*pixel]) {
        let (column, row) = (pixel % width_px, pixel / width_px);
        for row in row.saturating_sub(margin_px)..(row + margin_px + 1).min(height_px) {
            let columns = column.saturating_sub(margin_px)..(column + margin_px + 1).min(width_px);
            wide[row * width_px + columns.start..row * width_px + columns.end].fill(true);
        }
    }
    wide
}

#[test]
fn in_registered_images_the_mask_is_that_of_the_depth_image() {
    let lenses = [
        Distortion::None,
        Distortion::PlumbBob([0.05, -0.02, 0.001, 0.0005, 0.0]),
        Distortion::Rational([0.3, 0.1, 0.0005, -0.0002, 0.02, 0.25, 0.08, 0.01]),
    ];
    for distortion in lenses {
        let camera = CameraModel { distortion, ..depth_camera() };
        let (mask, view) = mask_and_view(&object(&camera, false));
        assert!(mask.iter().filter(|is_moving| **is_moving).count() > 5_000);
        assert_eq!(seen(&view, &camera, &Isometry3::identity()), mask, "{distortion:?}");
    }
}

/// The margin showed the wall behind the object, and was black where a camera beside the depth camera sees that.
#[test]
fn a_camera_beside_sees_the_object_black_and_the_wall_beside_it_as_it_is() {
    for (size_px, focal_px) in [((320, 240), 260.0), ((480, 270), 300.0), ((200, 150), 100.0)] {
        for right_m in [-0.05, 0.05] {
            let camera = camera(size_px, focal_px);
            let (_, view) = mask_and_view(&object(&depth_camera(), false));
            let black = seen(&view, &camera, &Isometry3::translation(-right_m, 0.0, 0.0));
            let is_object: Vec<bool> =
                (0..black.len()).map(|pixel| shows(&camera, right_m, pixel)[0]).collect();
            let margin_px = (2.0 * focal_px / 260.0_f64).ceil() as usize + 1;
            let around = widened(&is_object, size_px.0, margin_px);
            for pixel in 0..black.len() {
                let place = (pixel % size_px.0, pixel / size_px.0);
                assert!(!is_object[pixel] || black[pixel], "{place:?} of {size_px:?} is left");
                assert!(around[pixel] || !black[pixel], "{place:?} of {size_px:?} is wall");
            }
        }
    }
}

/// The mask ended where depth did.
#[test]
fn what_is_not_measured_and_touches_the_object_is_black_within_its_reach() {
    let camera = depth_camera();
    let (_, view) = mask_and_view(&object(&camera, true));
    for right_m in [0.0, 0.05] {
        let black = seen(&view, &camera, &Isometry3::translation(-right_m, 0.0, 0.0));
        let shown: Vec<[bool; 2]> =
            (0..black.len()).map(|pixel| shows(&camera, right_m, pixel)).collect();
        let whole: Vec<bool> =
            shown.iter().map(|[is_object, is_hair]| *is_object || *is_hair).collect();
        for (pixel, around) in widened(&whole, camera.width_px, 3).into_iter().enumerate() {
            assert!(!whole[pixel] || black[pixel], "{pixel}: {:?}", shown[pixel]);
            assert!(around || !black[pixel], "{pixel} is wall");
        }
    }
    // Two edges of a voxel from the object, nothing is taken from a wall without depths.
    let dark =
        frame(
            &camera,
            |pixel| {
                if shows(&camera, 0.0, pixel)[0] { (1e3 * OBJECT_M) as u16 } else { 0 }
            },
        );
    let (_, view) = mask_and_view(&dark);
    let black = seen(&view, &camera, &Isometry3::identity());
    let is_object: Vec<bool> = (0..black.len()).map(|at| shows(&camera, 0.0, at)[0]).collect();
    let reach_px = (2.0 * 0.08 * 260.0 / OBJECT_M).ceil() as usize + 3;
    let around = widened(&is_object, camera.width_px, reach_px);
    assert!(black.iter().zip(&around).all(|(black, around)| *around || !*black));
    // The edge of a board behind the object, of which two rows are not measured.
    let board = frame(&camera, |pixel| match (shows(&camera, 0.0, pixel), pixel / 320) {
        ([true, _], _) => (1e3 * OBJECT_M) as u16,
        (_, 100..102) => 0,
        _ => (1e3 * WALL_M) as u16,
    });
    let (mask, view) = mask_and_view(&board);
    assert_eq!(seen(&view, &camera, &Isometry3::identity()), mask);
    // A hole in the wall that does not touch the object is a hole.
    let hole = frame(&camera, |pixel| match shows(&camera, 0.0, pixel) {
        [true, _] => (1e3 * OBJECT_M) as u16,
        _ if pixel % camera.width_px < 60 => 0,
        _ => (1e3 * WALL_M) as u16,
    });
    let (mask, view) = mask_and_view(&hole);
    assert_eq!(seen(&view, &camera, &Isometry3::identity()), mask);
}

#[test]
fn what_moves_is_where_its_velocity_takes_it() {
    let camera = depth_camera();
    let object = object(&camera, false);
    let moving = moving(Vector3::new(0.0, -1.5, 0.0));
    let points = moving.iter().map(|(point, _)| point);
    let mask = MovingPixels::new(grid()).mask(&object, (&rig_from_camera(), None), None, points);
    let view = MovingView::of_mask(&object, &rig_from_camera(), &mask, &moving, &grid());
    let mut splats = Splats::new(&camera);
    // The rig stands in the map's origin.
    let camera_from_map = rig_from_camera().inverse();
    view.splat(&Isometry3::identity(), (&camera_from_map, 0.016), &mut splats);
    let black = splats.into_mask();
    for (pixel, black) in black.iter().enumerate() {
        // To the right in the image.
        let is_object = shows(&camera, -0.024, pixel)[0];
        assert!(!is_object || *black, "{pixel}");
    }
    let [before, after] = [&mask, &black].map(|mask| mask.iter().filter(|it| **it).count());
    assert!(after < before + before / 20, "{before}, {after}");
}

/// What is right before the lens covers the image many times over.
#[test]
fn what_touches_the_lens_of_the_colour_camera_costs_no_more_than_what_is_far() {
    let camera = camera((1280, 720), 900.0);
    let depth = depth_camera();
    let near = frame(&depth, |_| 100);
    let moving = [(Point3::new(0.1, 0.0, 0.0), Vector3::zeros())];
    let mask = vec![true; near.depths_mm().len()];
    let view = MovingView::of_mask(&near, &rig_from_camera(), &mask, &moving, &grid());
    for ahead_m in [0.0999, 0.1, 0.1001] {
        let black = seen(&view, &camera, &Isometry3::translation(0.0, 0.0, -ahead_m));
        assert_eq!(black.iter().all(|black| *black), ahead_m < 0.1, "{ahead_m}");
    }
}

proptest! {
    /// The sums of the steps are the squares.
    #[test]
    fn a_pixel_is_covered_where_a_surface_reaches_it(
        surfaces in prop::collection::vec((-2.0..2.0_f64, -2.0..2.0_f64, 0.2..3.0_f64, 0.0..0.4_f64), 0..6),
    ) {
        let camera = camera((13, 9), 8.0);
        let mut splats = Splats::new(&camera);
        for (x, y, z, size) in &surfaces {
            splats.add(&Point3::new(*x, *y, *z), [*size, 0.5 * size]);
        }
        for (pixel, covered) in splats.into_mask().into_iter().enumerate() {
            let (column, row) = ((pixel % 13) as f64, (pixel / 13) as f64);
            let reaches = |slack: f64| surfaces.iter().any(|(x, y, z, size)| {
                let near = |at: f64, middle: f64, size: f64| {
                    (at - middle).abs() < (0.5 * size * 8.0 / z).max(0.01) + 0.5 + slack
                };
                near(column, 8.0 * x / z + 6.0, *size) && near(row, 8.0 * y / z + 4.0, 0.5 * size)
            });
            prop_assert!(covered || !reaches(-0.02), "{} is left", pixel);
            prop_assert!(!covered || reaches(0.02), "{} is too much", pixel);
        }
    }
}
