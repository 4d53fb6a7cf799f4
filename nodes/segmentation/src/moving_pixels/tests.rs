use geometry::{DepthImage, DepthPixels, Distortion, Stamp, pose_from_vector};
use proptest::prelude::*;

use super::*;

const WIDTH_PX: usize = 64;
const HEIGHT_PX: usize = 48;
const EDGE_M: f64 = 0.08;

fn camera(distortion: Distortion) -> CameraModel {
    let (width_px, height_px) = (WIDTH_PX, HEIGHT_PX);
    let (fx_px, fy_px, cx_px, cy_px) = (60.0, 60.0, 31.5, 23.5);
    CameraModel { width_px, height_px, fx_px, fy_px, cx_px, cy_px, distortion }
}

/// An object of 20 x 30 pixels at 1.5 m before a wall at 3 m.
fn depths_mm() -> Vec<u16> {
    (0..WIDTH_PX * HEIGHT_PX).map(|pixel| if is_object(pixel) { 1500 } else { 3000 }).collect()
}

fn is_object(pixel: usize) -> bool {
    let (column, row) = (pixel % WIDTH_PX, pixel / WIDTH_PX);
    (20..40).contains(&column) && (10..40).contains(&row)
}

fn frame(depths_mm: Vec<u16>, distortion: Distortion) -> DepthFrame {
    let pixels = DepthPixels::Millimetres(depths_mm);
    let size_px = (WIDTH_PX, HEIGHT_PX);
    let image = DepthImage::new(Stamp::default(), "camera".to_owned(), size_px, pixels).unwrap();
    DepthFrame::new(image, camera(distortion)).unwrap()
}

/// Optical axes in the rig's.
fn rig_from_camera() -> Isometry3<f64> {
    let quarter = std::f64::consts::FRAC_PI_2;
    pose_from_vector(&[0.0, 0.0, 0.0, -quarter, 0.0, -quarter])
}

/// The points, in the rig, of the object's pixels that are far from its edge.
fn middle(distortion: Distortion, columns: Range<usize>) -> Vec<Point3<f32>> {
    let rays = RayTable::new(&camera(distortion)).unwrap();
    let pixels = (14..36).flat_map(|row| columns.clone().map(move |column| (column, row)));
    pixels
        .map(|(column, row)| {
            let ray = rays.ray(column, row).unwrap();
            let in_camera = Point3::new(ray.x * 1.5, ray.y * 1.5, 1.5).cast::<f64>();
            (rig_from_camera() * in_camera).cast::<f32>()
        })
        .collect()
}

fn mask(frame: &DepthFrame, moving: &[Point3<f32>]) -> Vec<bool> {
    let mut masks = MovingPixels::new(VoxelGrid::new(EDGE_M).unwrap());
    masks.mask(frame, (&rig_from_camera(), None), None, moving.iter())
}

#[test]
fn the_mask_reaches_the_edge_of_the_object_and_a_margin_beyond() {
    for distortion in [Distortion::None, Distortion::PlumbBob([0.05, -0.02, 0.001, 0.0, 0.0])] {
        let is_moving = mask(&frame(depths_mm(), distortion), &middle(distortion, 24..36));
        for (pixel, is_moving) in is_moving.iter().enumerate() {
            let (column, row) = (pixel % WIDTH_PX, pixel / WIDTH_PX);
            let with_margin = (20 - MARGIN_PX..40 + MARGIN_PX).contains(&column)
                && (10 - MARGIN_PX..40 + MARGIN_PX).contains(&row);
            assert_eq!(*is_moving, with_margin, "column {column}, row {row}");
        }
    }
}

/// Regression: a robot's bumper was in the map once for each place where the robot had stood.
#[test]
fn the_robot_itself_is_masked_with_a_margin_whether_or_not_something_moves() {
    // All of the object is in the box, and none of the wall.
    let robot = RobotBox::of_corners(&[0.1, -1.0, -1.0, 2.0, 1.0, 1.0]).unwrap().unwrap();
    let mut masks = MovingPixels::new(VoxelGrid::new(EDGE_M).unwrap());
    for moving in [Vec::new(), middle(Distortion::None, 24..36)] {
        let frame = frame(depths_mm(), Distortion::None);
        let camera = (&rig_from_camera(), Some(&robot));
        let is_masked = masks.mask(&frame, camera, None, moving.iter());
        assert_eq!(is_masked, mask(&frame, &middle(Distortion::None, 24..36)));
    }
}

#[test]
fn nothing_that_moves_makes_no_mask_and_pixels_without_a_depth_stop_the_growth() {
    let depths_mm = depths_mm();
    let whole = frame(depths_mm.clone(), Distortion::None);
    assert!(!mask(&whole, &[]).contains(&true));
    let holes: Vec<u16> = depths_mm
        .iter()
        .enumerate()
        .map(|(pixel, depth_mm)| if pixel % WIDTH_PX == 36 { 0 } else { *depth_mm })
        .collect();
    let is_moving = mask(&frame(holes, Distortion::None), &middle(Distortion::None, 24..34));
    // What is left of the column without depths has a margin; beyond, nothing.
    assert!(is_moving[20 * WIDTH_PX + 35 + MARGIN_PX]);
    assert!(!is_moving[20 * WIDTH_PX + 36 + MARGIN_PX]);
    let blind = frame(vec![0; depths_mm.len()], Distortion::None);
    assert!(!mask(&blind, &middle(Distortion::None, 24..36)).contains(&true));
}

#[test]
fn an_object_right_before_the_lens_is_masked_and_one_behind_it_is_not() {
    let near = frame(vec![100; WIDTH_PX * HEIGHT_PX], Distortion::None);
    assert!(mask(&near, &[Point3::new(0.1, 0.0, 0.0)]).iter().all(|is_moving| *is_moving));
    assert!(!mask(&near, &[Point3::new(-3.0, 0.0, 0.0)]).contains(&true));
}

proptest! {
    #[test]
    fn the_border_and_the_margin_are_those_of_each_pixel(
        is_moving in prop::collection::vec(prop::bool::weighted(0.7), 13 * 9),
    ) {
        let (width, height, margin) = (13_i32, 9_i32, MARGIN_PX as i32);
        let at = |column: i32, row: i32| {
            let is_inside = (0..width).contains(&column) && (0..height).contains(&row);
            is_inside.then(|| is_moving[(row * width + column) as usize])
        };
        let pixels = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
        let beside = [(-1, 0), (1, 0), (0, -1), (0, 1)];
        let is_border = |(column, row): &(i32, i32)| {
            at(*column, *row) == Some(true)
                && beside.iter().any(|(x, y)| at(column + x, row + y) == Some(false))
        };
        let expected: Vec<u32> =
            pixels.clone().filter(is_border).map(|(column, row)| (row * width + column) as u32).collect();
        prop_assert_eq!(border_of(&is_moving, width as usize, 0..height as usize), expected);
        let mut widened = is_moving.clone();
        Margin::default().add(&mut widened, width as usize);
        for ((column, row), is_widened) in pixels.zip(widened) {
            let around = -margin..=margin;
            let is_near = around.clone().any(|y| around.clone().any(|x| at(column + x, row + y) == Some(true)));
            prop_assert_eq!(is_widened, is_near, "column {}, row {}", column, row);
        }
    }
}

/// Regression: the mask grew from the feet over the floor around them, by up to 16 cm: three quarters of the static pixels that were removed
/// beside a child and a dog.
#[test]
fn the_mask_of_feet_does_not_grow_over_the_floor() {
    // A post at 2 m on a floor 0.5 m below the camera.
    let rays = RayTable::new(&camera(Distortion::None)).unwrap();
    let ray = |pixel: usize| rays.ray(pixel % WIDTH_PX, pixel / WIDTH_PX).unwrap();
    let is_post = |pixel: &usize| ray(*pixel).x.abs() < 0.1 && ray(*pixel).y < 0.25;
    let depth_m = |pixel: usize| match (is_post(&pixel), ray(pixel).y) {
        (true, _) => 2.0,
        (false, down) if down > 0.125 => 0.5 / down,
        (false, _) => 4.0,
    };
    let pixels = 0..WIDTH_PX * HEIGHT_PX;
    let seen = frame(
        pixels.clone().map(|pixel| (1e3 * depth_m(pixel)).round() as u16).collect(),
        Distortion::None,
    );
    // Its lowest voxel was judged as floor.
    let judged = pixels.clone().filter(is_post).filter(|&pixel| ray(pixel).y < 0.21);
    let moving: Vec<Point3<f32>> = judged
        .map(|pixel| {
            let in_camera = Point3::from(2.0 * ray(pixel).push(1.0)).cast::<f64>();
            (rig_from_camera() * in_camera).cast::<f32>()
        })
        .collect();
    let floor_points = (0..400).map(|index| {
        let (x, y) = (f64::from(index % 20), f64::from(index / 20));
        Point3::new(1.0 + 0.1 * x, -1.0 + 0.1 * y, -0.5)
    });
    let floor = Floor::of(&floor_points.collect::<Vec<_>>()).unwrap();
    let mut masks = MovingPixels::new(VoxelGrid::new(EDGE_M).unwrap());
    let mut masked_floor = |floor: Option<&Floor>| {
        let is_moving = masks.mask(&seen, (&rig_from_camera(), None), floor, moving.iter());
        assert!(pixels.clone().filter(is_post).all(|pixel| is_moving[pixel]));
        let below = |pixel: &usize| ray(*pixel).x.abs() < 0.1 && !is_post(pixel);
        pixels.clone().filter(|pixel| below(pixel) && is_moving[*pixel]).count()
    };
    let columns = (0..WIDTH_PX).filter(|&column| ray(column).x.abs() < 0.1).count();
    let (with, without) = (masked_floor(Some(&floor)), masked_floor(None));
    assert!(with <= MARGIN_PX * columns && without > MARGIN_PX * columns, "{with}, {without}");
}
