//! The box around the robot itself.

use geometry::RobotBox;

use super::*;

/// A post 0.3 m ahead of the scanner, in the box, and a wall behind.
const ROBOT_BOX_M: [f64; 6] = [-0.2, -0.2, -0.9, 0.35, 0.2, 0.1];

fn with_box(config: DetectionConfig) -> Detector {
    Detector::new(DetectionConfig { robot_box_m: ROBOT_BOX_M, ..config }).unwrap()
}

/// Regression: a robot's bumper was in the map once for each place where the robot had stood. Nothing ever clears it: the camera does not
/// look there again.
#[test]
fn the_robot_itself_is_in_no_cloud() {
    let robot = RobotBox::of_corners(&ROBOT_BOX_M).unwrap().unwrap();
    let in_rig = [Point3::new(0.3_f32, 0.0, 0.0), Point3::new(2.0, 0.0, 0.0)];
    let in_camera = cloud(in_rig.iter().map(|p| Point3::new(-p.y, -p.z, p.x)).collect());
    let organised = organised(2, &in_camera.points_m);
    let image = Arc::new(depth_image((4, 2), vec![0, 300, 0, 0, 0, 0, 0, 3000]));
    for config in [rec_hv(), DetectionConfig::default()] {
        let projector = with_box(config.clone()).depth_projector(RayTable::new(&CAMERA).unwrap());
        for view in [
            View::PointsInCamera(&in_camera),
            View::OrganisedPoints(&organised),
            View::Depth(projector.image(&image).unwrap()),
        ] {
            let detected = step_with(&mut with_box(config.clone()), &scan(None), view).unwrap();
            let points_m = &detected.cycle.reduced_cloud.points_m;
            assert_eq!(points_m.len(), 1, "{view:?}");
            assert!(points_m[0].x > 1.0, "{points_m:?}");
            assert_eq!(detected.cycle.setup.robot, Some(robot));
            let shown_m = detected.cycle.depth.map(|frame| frame.image().depth_m(1, 0));
            // It hides what is behind it.
            if matches!(view, View::Depth(_)) && config.pipeline.method == Method::FreeSpace {
                assert_eq!(shown_m, Some(Some(0.3)));
            }
        }
    }
}

/// The posts before a scanner are no part of the scene, and what they hide is unknown.
#[test]
fn beams_that_end_at_the_robot_itself_have_no_return() {
    let mut turn = scan(None);
    turn.ranges_m[170..190].fill(0.3);
    let seen = |mut detector: Detector| {
        let detected = step(&mut detector, &turn);
        (detected.statistics.unknown_beams, detected.cycle.scan_rays.len())
    };
    let (unknown, rays) = seen(Detector::new(DetectionConfig::default()).unwrap());
    assert_eq!(seen(with_box(DetectionConfig::default())), (unknown + 20, rays - 20));
}
