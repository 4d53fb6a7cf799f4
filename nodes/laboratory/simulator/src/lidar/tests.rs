use super::*;
use crate::{Body, Material, Waypoint};

/// An ideal scanner in the rig's origin.
fn exact() -> Lidar {
    Lidar {
        rig_from_lidar: [0.0; 6],
        turn_jitter: 0.0,
        range_noise_m: 0.0,
        range_noise_ratio: 0.0,
        range_step_m: 1e-6,
        azimuth_spread_rad: 0.0,
        dropout_ratio: 0.0,
        ..Lidar::rplidar_a1()
    }
}

fn scan(lidar: &Lidar, bodies: Vec<Body>, path: &Path, turn: u64) -> Scan {
    let scene = Scene { bodies, ..Scene::default() };
    let statics = scene.static_solids();
    let start = Stamp::from_secs_nanos(100, 0);
    let view = LidarView { seed: 3, start, path, scene: &scene, statics: &statics };
    let (scan, labels) = lidar.scan(&view, turn);
    assert_eq!(labels, vec![STATIC_ID; lidar.beams]);
    scan
}

fn wall(x_m: f64, material: Material) -> Body {
    let (near_m, far_m) = if x_m > 0.0 { (x_m, x_m + 0.1) } else { (x_m - 0.1, x_m) };
    Body::cuboid("wall", [near_m, -90.0, -9.0], [far_m, 90.0, 9.0], material)
}

#[test]
fn the_message_is_laid_out_as_the_driver_does() {
    let path = Path::still([0.0; 6]);
    let scan = scan(&Lidar::rplidar_a1(), vec![wall(3.0, Material::PLASTER)], &path, 0);
    assert_eq!(scan.frame_id, "laser");
    assert_eq!(scan.stamp, Stamp::from_secs_nanos(100, 0));
    assert_eq!(scan.ranges_m.len(), 360);
    // The output of `ros2 topic echo /scan` for an A1.
    assert!((scan.angle_min_rad - -3.124_139).abs() < 1e-6);
    assert!((scan.angle_increment_rad - 0.017_453_29).abs() < 1e-7);
    assert!((scan.azimuth_rad(359) - PI).abs() < 1e-5);
    assert_eq!((scan.range_min_m, scan.range_max_m), (0.15, 12.0));
    assert!((scan.scan_time_s - 1.0 / 7.0).abs() < 0.003);
    assert!((scan.time_increment_s - scan.scan_time_s / 359.0).abs() < 1e-6);
    // Nothing behind, nothing at the sides: +Inf for no return.
    assert_eq!(scan.ranges_m[359], f32::INFINITY);
    assert_eq!(scan.ranges_m[0], f32::INFINITY);
}

#[test]
fn beams_meet_a_wall_where_geometry_says() {
    let path = Path::still([0.0; 6]);
    let scan = scan(&exact(), vec![wall(3.0, Material::PLASTER)], &path, 0);
    // Beam 179 points straight ahead.
    assert!(scan.azimuth_rad(179).abs() < 1e-5);
    assert!((scan.ranges_m[179] - 3.0).abs() < 1e-5);
    for beam in 179 - 60..=179 + 60 {
        let expected_m = 3.0 / scan.azimuth_rad(beam).cos();
        assert!((f64::from(scan.ranges_m[beam]) - expected_m).abs() < 1e-4, "beam {beam}");
    }
}

#[test]
fn ranges_have_the_stated_noise_and_step() {
    let lidar = Lidar { azimuth_spread_rad: 0.0, ..Lidar::rplidar_a1() };
    let path = Path::still([0.0; 6]);
    let mut errors_m = Vec::new();
    let mut missing = 0;
    for turn in 0..200 {
        let scan = scan(&lidar, vec![wall(3.0, Material::PLASTER)], &path, turn);
        for beam in 170..190 {
            match scan.measured_range_m(beam) {
                Some(range_m) => {
                    let quarters = f64::from(range_m) / 0.000_25;
                    assert!((quarters - quarters.round()).abs() < 2e-3);
                    let true_m = 3.0 / scan.azimuth_rad(beam).cos();
                    errors_m.push(f64::from(range_m) - true_m);
                }
                None => missing += 1,
            }
        }
    }
    let mean_m = errors_m.iter().sum::<f64>() / errors_m.len() as f64;
    let rms_m = (errors_m.iter().map(|e| e * e).sum::<f64>() / errors_m.len() as f64).sqrt();
    assert!(mean_m.abs() < 0.001, "mean {mean_m}");
    assert!((rms_m - 0.016).abs() < 0.001, "deviation {rms_m}");
    assert!((20..=65).contains(&missing), "{missing} of 4000 beams missing, 1 % expected");
}

#[test]
fn black_and_grazed_and_far_things_return_nothing() {
    let path = Path::still([0.0; 6]);
    let ahead = |x_m: f64, material| {
        scan(&exact(), vec![wall(x_m, material)], &path, 0).measured_range_m(179)
    };
    assert!(ahead(10.0, Material::PLASTER).is_some());
    assert_eq!(ahead(14.0, Material::PLASTER), None);
    assert_eq!(ahead(5.0, Material::BLACK_GLASS), None);
    assert_eq!(ahead(0.1, Material::PLASTER), None);
    // At 0.3 m a beam at 80 degrees still has the reach but grazes the wall.
    let scan = scan(&exact(), vec![wall(0.3, Material::PLASTER)], &path, 0);
    assert!(scan.measured_range_m(179 + 70).is_some());
    assert_eq!(scan.measured_range_m(179 + 85), None);
}

#[test]
fn a_turn_is_measured_clockwise_beam_after_beam() {
    // The rig drives towards one wall and away from the other at 0.5 m/s.
    let path = Path {
        waypoints: vec![
            Waypoint { time_s: 0.0, pose: [0.0; 6] },
            Waypoint { time_s: 2.0, pose: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0] },
        ],
    };
    let walls = vec![wall(3.0, Material::PLASTER), wall(-2.0, Material::PLASTER)];
    let scan = scan(&exact(), walls, &path, 0);
    let turn_s = 1.0 / 7.0;
    // The last beam is measured first, the one ahead in the middle, the first one last.
    assert!((f64::from(scan.ranges_m[359]) - 2.0).abs() < 1e-4);
    assert!((f64::from(scan.ranges_m[179]) - (3.0 - 0.5 * turn_s / 2.0)).abs() < 1e-3);
    assert!((f64::from(scan.ranges_m[0]) - (2.0 + 0.5 * turn_s)).abs() < 1e-3);
}

#[test]
fn turns_follow_each_other_unevenly_but_in_order() {
    let lidar = Lidar::rplidar_a1();
    assert_eq!(lidar.turn_start_s(9, 0), 0.0);
    let starts: Vec<f64> = (0..1000).map(|turn| lidar.turn_start_s(9, turn)).collect();
    let lengths: Vec<f64> = starts.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(lengths.iter().all(|&s| (s * 7.0 - 1.0).abs() < 0.03));
    assert!(lengths.iter().any(|&s| (s * 7.0 - 1.0).abs() > 0.003));
    assert!((starts[999] * 7.0 - 999.0).abs() < 0.02);
}

#[test]
fn glass_is_seen_through_squarely_and_mirrors_what_grazes_it() {
    let path = Path::still([0.0; 6]);
    let pane = |x_m: f64| wall(x_m, Material::GLASS);
    let ahead = |bodies| scan(&exact(), bodies, &path, 0).measured_range_m(179);
    let behind_m = ahead(vec![pane(1.0), wall(3.0, Material::PLASTER)]).unwrap();
    assert!((behind_m - 3.0).abs() < 1e-4, "{behind_m}");
    // An object in front of the glass hides it, and glass with nothing behind gives no return.
    assert!((ahead(vec![wall(1.0, Material::PLASTER), pane(2.0)]).unwrap() - 1.0).abs() < 1e-4);
    assert_eq!(ahead(vec![pane(1.0)]), None);
    // 3 m behind many panes is too weak: 0.92^2 of the light remains behind each.
    let panes = |count: u8| (0..count).map(|at| pane(0.2 + 0.15 * f64::from(at)));
    let dark = Material::matt(0.1);
    let through = |count| ahead(panes(count).chain([wall(3.0, dark)]).collect());
    assert!(through(1).is_some());
    assert_eq!(through(12), None);
    // 75 degrees are the limit.
    let scan = scan(&exact(), vec![pane(0.2), wall(0.5, Material::PLASTER)], &path, 0);
    assert!(scan.measured_range_m(179 + 70).is_some());
    assert_eq!(scan.measured_range_m(179 + 78), None);
}

#[test]
fn the_range_of_view_the_order_and_the_mark_of_no_return_are_the_message_s() {
    let path = Path::still([0.0; 6]);
    // 270 degrees from left to right, as of a scanner that is mounted upside down.
    let lidar = Lidar {
        beams: 271,
        azimuths_rad: Some([0.75 * PI, -0.75 * PI]),
        no_return: NoReturn::Zero,
        ..exact()
    };
    let scan = scan(&lidar, vec![wall(3.0, Material::PLASTER)], &path, 0);
    assert!((scan.azimuth_rad(0) - 0.75 * PI).abs() < 1e-5);
    assert!((scan.azimuth_rad(270) + 0.75 * PI).abs() < 1e-5);
    assert!(scan.angle_increment_rad < 0.0);
    assert!((scan.ranges_m[135] - 3.0).abs() < 1e-5);
    assert_eq!(scan.ranges_m[0], 0.0);
    // It looks away for a quarter of its turn.
    let measuring_s = scan.time_increment_s * 270.0;
    assert!((measuring_s / scan.scan_time_s - 0.75).abs() < 0.01);
}
