use geometry::{DepthPixels, Distortion, MaskedDepth, RigMounts};
use nalgebra::Vector3;

use super::verdict::MovingPoint;
use super::*;

const WIDTH_PX: usize = 64;
const HEIGHT_PX: usize = 48;
const FOCAL_PX: f64 = 60.0;
/// The object's distance, and that of the wall behind it.
const OBJECT_M: f64 = 1.5;
const WALL_M: f64 = 3.0;
/// The object's width and height.
const SIZE_M: [f64; 2] = [0.4, 0.6];
const SPEED_M_PER_S: f64 = 2.0;

fn camera() -> CameraModel {
    CameraModel {
        width_px: WIDTH_PX,
        height_px: HEIGHT_PX,
        fx_px: FOCAL_PX,
        fy_px: FOCAL_PX,
        cx_px: 31.5,
        cy_px: 23.5,
        distortion: Distortion::None,
    }
}

fn grid() -> VoxelGrid {
    VoxelGrid::new(0.08).unwrap()
}

fn stamp(seconds: f64) -> Stamp {
    Stamp::from_nanos(1_000_000_000).plus_seconds(seconds)
}

/// The object's left edge in the rig, after a time: it goes to the left.
fn left_m(seconds: f64) -> f64 {
    0.2 + SPEED_M_PER_S * seconds
}

/// Whether a pixel shows the object, of a camera at the rig's origin, which is turned to the left.
fn is_object(pixel: usize, seconds: f64, yaw_rad: f64) -> bool {
    let slope_m = |centre: f64, at: usize| (centre - at as f64) / FOCAL_PX;
    let azimuth_rad = slope_m(31.5, pixel % WIDTH_PX).atan() + yaw_rad;
    let y_m = OBJECT_M * azimuth_rad.tan();
    let z_m = OBJECT_M * slope_m(23.5, pixel / WIDTH_PX);
    (left_m(seconds) - SIZE_M[0]..left_m(seconds)).contains(&y_m) && z_m.abs() < 0.5 * SIZE_M[1]
}

fn image(seconds: f64, yaw_rad: f64) -> Arc<DepthImage> {
    let depth_mm = |pixel: usize| {
        let azimuth_rad = ((31.5 - (pixel % WIDTH_PX) as f64) / FOCAL_PX).atan() + yaw_rad;
        let x_m = if is_object(pixel, seconds, yaw_rad) { OBJECT_M } else { WALL_M };
        // Along the optical axis.
        (1e3 * x_m / azimuth_rad.cos() * (azimuth_rad - yaw_rad).cos()).round() as u16
    };
    let pixels = (0..WIDTH_PX * HEIGHT_PX).map(depth_mm).collect();
    let size_px = (WIDTH_PX, HEIGHT_PX);
    let pixels = DepthPixels::Millimetres(pixels);
    Arc::new(DepthImage::new(stamp(seconds), "camera".to_owned(), size_px, pixels).unwrap())
}

/// A cycle that found the object where it was then, at its velocity.
fn verdict(seconds: f64, yaw_rad: f64) -> Verdict {
    let map_from_rig = geometry::pose_from_vector(&[0.0, 0.0, 0.0, yaw_rad, 0.0, 0.0]);
    let along = |from: f64, size: f64| {
        (0..).map(move |at| from + f64::from(at) * 0.05).take_while(move |at| *at < from + size)
    };
    let places = along(left_m(seconds) - SIZE_M[0] + 0.02, SIZE_M[0] - 0.04)
        .flat_map(|y| along(0.02 - 0.5 * SIZE_M[1], SIZE_M[1] - 0.04).map(move |z| (y, z)));
    let points = places.map(|(y, z)| {
        let in_map_m = Point3::new(OBJECT_M, y, z);
        MovingPoint {
            in_rig_m: map_from_rig.inverse_transform_point(&in_map_m).cast(),
            in_map_m,
            velocity_m_per_s: Vector3::new(0.0, SPEED_M_PER_S, 0.0),
        }
    });
    Verdict {
        scan_stamp: stamp(seconds),
        view_stamp: stamp(seconds),
        map_from_rig,
        mounts: RigMounts::default(),
        colour_from_depth: Isometry3::identity(),
        robot: None,
        beams: Vec::new(),
        points: points.collect(),
        floor_in_rig: None,
        depth: None,
    }
}

/// The share of the object's pixels in a mask, and how many others are in it.
fn score(mask: &[bool], seconds: f64, yaw_rad: f64) -> (f64, usize) {
    let of_object: Vec<bool> = (0..mask.len()).map(|at| is_object(at, seconds, yaw_rad)).collect();
    let both = mask.iter().zip(&of_object).filter(|(mask, object)| **mask && **object).count();
    let size = of_object.iter().filter(|object| **object).count();
    assert!(size > 100, "{size}");
    (both as f64 / size as f64, mask.iter().filter(|mask| **mask).count() - both)
}

/// Of a robot with a bumper the filtered scans, images and clouds had the bumper as an obstacle.
#[test]
fn the_robot_itself_is_taken_out_though_nothing_moves() {
    // The wall is in the box up to 0.5 m to the left and to the right.
    let robot = RobotBox::of_corners(&[2.0, -0.5, -5.0, 4.0, 0.5, 5.0]).unwrap();
    let mut filter = MotionFilter::new(grid());
    filter.take(Verdict { robot, points: Vec::new(), ..verdict(0.0, 0.0) });
    // Nothing but the wall.
    let size_px = (WIDTH_PX, HEIGHT_PX);
    let pixels = DepthPixels::Millimetres(vec![3_000; WIDTH_PX * HEIGHT_PX]);
    let wall = DepthImage::new(stamp(0.05), "camera".to_owned(), size_px, pixels).unwrap();
    let y_m = |column: usize| (31.5 - column as f64) / FOCAL_PX * WALL_M;
    let columns: Vec<usize> = (0..WIDTH_PX).filter(|at| y_m(*at).abs() <= 0.5).collect();
    let with_margin = columns[0] - 2..columns[columns.len() - 1] + 3;
    let mask = filter.pixels(&Arc::new(wall), &camera()).unwrap().unwrap();
    for (pixel, is_masked) in mask.iter().enumerate() {
        assert_eq!(*is_masked, with_margin.contains(&(pixel % WIDTH_PX)), "pixel {pixel}");
    }

    let rows: Vec<Point3<f32>> =
        (0..WIDTH_PX).map(|at| Point3::new(-y_m(at) as f32, 0.0, WALL_M as f32)).collect();
    let cloud = OrganisedCloud::from_rows(stamp(0.05), "camera".to_owned(), WIDTH_PX, &rows);
    let is_taken = filter.points(&cloud, WIDTH_PX).unwrap();
    assert!(columns.iter().all(|at| is_taken[*at]), "{is_taken:?}");
    assert!(!is_taken[0] && !is_taken[WIDTH_PX - 1], "{is_taken:?}");

    let scan = Scan {
        stamp: stamp(0.05),
        angle_min_rad: -0.5,
        angle_increment_rad: 0.1,
        range_max_m: 8.0,
        ranges_m: vec![3.0; 11],
        ..Scan::default()
    };
    let beams = filter.beams(&scan).unwrap();
    // 0.5 m aside at 3 m are 9.6 degrees.
    assert_eq!(beams.iter().map(|beam| beam.index).collect::<Vec<_>>(), [4, 5, 6]);
}

#[test]
fn an_image_between_two_cycles_is_masked_where_the_object_has_got_to() {
    let mut filter = MotionFilter::new(grid());
    filter.take(verdict(0.0, 0.0));
    for later_s in [0.0, 0.033, 0.066, 0.1] {
        let mask = filter.pixels(&image(later_s, 0.0), &camera()).unwrap().unwrap();
        let (found, others) = score(&mask, later_s, 0.0);
        assert!(found > 0.98, "{later_s}: {found}");
        // Two pixels around the object.
        assert!(others < 250, "{later_s}: {others}");
    }
}

#[test]
fn the_rig_is_where_its_motion_takes_it_between_the_cycles() {
    let turn_rad_per_s = 1.0;
    let mut filter = MotionFilter::new(grid());
    for seconds in [-0.1, 0.0] {
        filter.take(verdict(seconds, turn_rad_per_s * seconds));
    }
    for later_s in [-0.15, -0.06, 0.05, 0.1] {
        let yaw_rad = turn_rad_per_s * later_s;
        let mask = filter.pixels(&image(later_s, yaw_rad), &camera()).unwrap().unwrap();
        let (found, others) = score(&mask, later_s, yaw_rad);
        assert!(found > 0.98 && others < 250, "{later_s}: {found}, {others}");
    }
}

#[test]
fn a_pose_that_jumps_is_no_motion() {
    let mut filter = MotionFilter::new(grid());
    filter.take(verdict(-0.1, 2.0));
    filter.take(verdict(0.0, 0.0));
    let mask = filter.pixels(&image(0.033, 0.0), &camera()).unwrap().unwrap();
    assert!(score(&mask, 0.033, 0.0).0 > 0.98);
}

#[test]
fn without_a_cycle_near_nothing_is_known() {
    let mut filter = MotionFilter::new(grid());
    let scan = Scan { stamp: stamp(0.0), ranges_m: vec![1.0], range_max_m: 8.0, ..Scan::default() };
    assert_eq!(filter.pixels(&image(0.0, 0.0), &camera()), Ok(None));
    assert_eq!(filter.beams(&scan), None);
    filter.take(verdict(0.0, 0.0));
    assert!(filter.pixels(&image(0.0, 0.0), &camera()).unwrap().is_some());
    assert_eq!(filter.pixels(&image(1.5, 0.0), &camera()), Ok(None));
    assert_eq!(filter.beams(&Scan { stamp: stamp(-1.5), ..scan }), None);
    // The time has jumped back.
    filter.take(verdict(-10.0, 0.0));
    assert_eq!(filter.pixels(&image(0.0, 0.0), &camera()), Ok(None));
}

#[test]
fn a_scan_loses_the_beams_of_its_cycle_and_those_that_end_at_moving_points() {
    let mut filter = MotionFilter::new(grid());
    let own = MovingBeam { index: 300, background_m: Some(4.0) };
    filter.take(Verdict { beams: vec![own], ..verdict(0.0, 0.0) });
    let hits = |index: usize, y_m: f64| {
        let azimuth_rad = (index as f64 - 180.0).to_radians();
        let ahead = azimuth_rad.abs() < 1.0;
        ahead && (y_m - SIZE_M[0]..y_m).contains(&(OBJECT_M * azimuth_rad.tan()))
    };
    let scan = |seconds: f64| Scan {
        stamp: stamp(seconds),
        angle_min_rad: -std::f32::consts::PI,
        angle_increment_rad: 1_f32.to_radians(),
        range_max_m: 8.0,
        ranges_m: (0..360)
            .map(|index| {
                let azimuth_rad = (index as f64 - 180.0).to_radians();
                let is_object = hits(index, left_m(seconds));
                if is_object { (OBJECT_M / azimuth_rad.cos()) as f32 } else { 5.0 }
            })
            .collect(),
        ..Scan::default()
    };
    let at_once = filter.beams(&scan(0.0)).unwrap();
    assert!(at_once.contains(&own));
    let at = |beams: &[MovingBeam]| -> Vec<usize> {
        beams.iter().map(|beam| beam.index as usize).collect()
    };
    let expected = |seconds: f64| -> Vec<usize> {
        (0..360).filter(|index| hits(*index, left_m(seconds))).collect()
    };
    assert_eq!(at(&at_once[..at_once.len() - 1]), expected(0.0));
    // The scan of a cycle that was dropped: the beams of the other are not its own.
    assert_eq!(at(&filter.beams(&scan(0.1)).unwrap()), expected(0.1));
}

#[test]
fn a_cloud_of_no_pinhole_camera_loses_the_points_beside_moving_ones() {
    let mut filter = MotionFilter::new(grid());
    filter.take(verdict(0.0, 0.0));
    // In the camera: x right, y down, z forward. The second is on the object, the third behind it.
    let none = Point3::from([f32::NAN; 3]);
    let points_m = [none, Point3::new(0.0, 0.0, 1.5), Point3::new(0.0, 0.0, 3.0)];
    let cloud = OrganisedCloud::from_rows(stamp(0.0), "camera".to_owned(), 3, &points_m);
    assert_eq!(filter.points(&cloud, 3), Some(vec![false, true, false]));
}

#[test]
fn what_is_decided_depends_on_the_last_cycle() {
    let mut filter = MotionFilter::new(grid());
    assert!(!filter.has_scan(stamp(0.0)) && !filter.has_view(stamp(0.0)));
    filter.take(Verdict { view_stamp: stamp(-0.02), ..verdict(0.0, 0.0) });
    assert!(filter.has_scan(stamp(0.0)) && !filter.has_scan(stamp(0.01)));
    assert!(filter.has_view(stamp(-0.02)) && !filter.has_view(stamp(0.0)));
}

fn colours(filter: &mut MotionFilter, seconds: f64) -> Vec<bool> {
    filter.colour_pixels(stamp(seconds), &camera()).unwrap()
}

#[test]
fn a_registered_colour_image_has_the_mask_of_the_depth_image_of_its_moment() {
    let mut filter = MotionFilter::new(grid());
    filter.keep_for_colours(true);
    filter.take(verdict(0.0, 0.0));
    for later_s in [0.0, 0.033, 0.066, 0.1] {
        assert!(!filter.has_depth(stamp(later_s)));
        let mask = filter.pixels(&image(later_s, 0.0), &camera()).unwrap().unwrap();
        assert!(filter.has_depth(stamp(later_s)));
        assert!(mask.contains(&true));
        assert_eq!(colours(&mut filter, later_s), mask, "{later_s}");
    }
    // Those before it were kept: a colour image may be late.
    let mask = filter.pixels(&image(0.033, 0.0), &camera()).unwrap().unwrap();
    assert_eq!(colours(&mut filter, 0.033), mask);
}

#[test]
fn a_colour_image_beside_the_depth_image_in_time_is_masked_where_object_and_rig_have_got_to() {
    for turn_rad_per_s in [0.0, 1.0] {
        let mut filter = MotionFilter::new(grid());
        filter.keep_for_colours(true);
        for seconds in [-0.1, 0.0] {
            filter.take(verdict(seconds, turn_rad_per_s * seconds));
        }
        for depth_s in [0.0, 0.033, 0.066] {
            let image = image(depth_s, turn_rad_per_s * depth_s);
            filter.pixels(&image, &camera()).unwrap().unwrap();
            for beside_s in [-0.04, -0.016, 0.016, 0.04] {
                let colour_s = depth_s + beside_s;
                let black = colours(&mut filter, colour_s);
                let (found, others) = score(&black, colour_s, turn_rad_per_s * colour_s);
                assert!(found > 0.98 && others < 300, "{depth_s} {colour_s}: {found}, {others}");
            }
        }
    }
}

/// Where no depth image comes, as of a compressed topic or of clouds, the cycles have theirs.
#[test]
fn without_a_depth_image_the_one_of_the_cycle_is_carried_on() {
    let mut filter = MotionFilter::new(grid());
    filter.keep_for_colours(true);
    let frame = Arc::new(DepthFrame::new(image(0.0, 0.0), camera()).unwrap());
    let own = verdict(0.0, 0.0);
    let points: Vec<Point3<f32>> = own.points.iter().map(|point| point.in_rig_m).collect();
    let rig_from_camera = RigMounts::default().rig_from_camera;
    let mask =
        MovingPixels::new(grid()).mask(&frame, (&rig_from_camera, None), None, points.iter());
    let depth = MaskedDepth::new(frame, mask.clone()).unwrap();
    filter.take(Verdict { depth: Some(depth), ..own });
    assert_eq!(colours(&mut filter, 0.0), mask);
    let black = colours(&mut filter, 0.08);
    let (found, others) = score(&black, 0.08, 0.0);
    assert!(found > 0.98 && others < 300, "{found}, {others}");
}

#[test]
fn without_any_depth_image_the_places_of_the_moving_points_are_black() {
    let mut filter = MotionFilter::new(grid());
    filter.keep_for_colours(true);
    filter.take(verdict(0.0, 0.0));
    for later_s in [0.0, 0.05] {
        let (found, others) = score(&colours(&mut filter, later_s), later_s, 0.0);
        assert!(found > 0.98 && others < 500, "{later_s}: {found}, {others}");
    }
    assert_eq!(filter.colour_pixels(stamp(1.5), &camera()), None);
}

#[test]
fn a_depth_camera_that_has_stopped_is_the_nearest_for_a_second() {
    let mut filter = MotionFilter::new(grid());
    filter.keep_for_colours(true);
    for seconds in [0.0, 0.1, 0.2, 0.3] {
        filter.take(verdict(seconds, 0.0));
    }
    filter.pixels(&image(0.1, 0.0), &camera()).unwrap();
    let black = colours(&mut filter, 0.2);
    let (found, others) = score(&black, 0.2, 0.0);
    assert!(found > 0.98 && others < 300, "{found}, {others}");
    // The time has jumped back: that image is of another run.
    filter.take(verdict(-5.0, 0.0));
    assert!(!filter.has_depth(stamp(-5.0)));
    assert_eq!(filter.colour_pixels(stamp(0.2), &camera()), None);
}

#[test]
fn nothing_is_kept_of_depth_images_while_nobody_wants_colours() {
    let mut filter = MotionFilter::new(grid());
    filter.take(verdict(0.0, 0.0));
    filter.pixels(&image(0.033, 0.0), &camera()).unwrap();
    assert_eq!(filter.views.len(), 0);
    filter.keep_for_colours(true);
    filter.pixels(&image(0.066, 0.0), &camera()).unwrap();
    assert_eq!(filter.views.len(), 1);
    filter.keep_for_colours(false);
    assert_eq!(filter.views.len(), 0);
}

/// A colour camera of another size beside the depth camera, seen through an organised cloud's own camera.
#[test]
fn an_organised_cloud_serves_as_a_depth_image() {
    let mut filter = MotionFilter::new(grid());
    filter.keep_for_colours(true);
    filter.take(verdict(0.0, 0.0));
    let (image, rays) = (image(0.0, 0.0), geometry::RayTable::new(&camera()).unwrap());
    let points: Vec<Point3<f32>> = (0..WIDTH_PX * HEIGHT_PX)
        .map(|pixel| {
            let (column, row) = (pixel % WIDTH_PX, pixel / WIDTH_PX);
            let (ray, depth_m) =
                (rays.ray(column, row).unwrap(), image.depth_m(column, row).unwrap());
            Point3::new(ray.x * depth_m, ray.y * depth_m, depth_m)
        })
        .collect();
    let cloud = OrganisedCloud::from_rows(stamp(0.0), "camera".to_owned(), WIDTH_PX, &points);
    let mask = filter.points(&cloud, points.len()).unwrap();
    assert!(filter.has_depth(stamp(0.0)));
    assert_eq!(filter.views.len(), 1);
    assert_eq!(colours(&mut filter, 0.0), mask);
}
