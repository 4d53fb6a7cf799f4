use nalgebra::UnitQuaternion;

use super::*;

fn colour_at(picture: &Picture, column: usize, row: usize) -> [u8; 3] {
    let start = (row * picture.edge_px + column) * 3;
    picture.rgb[start..start + 3].try_into().unwrap()
}

/// East along x, then north, and looking north at the end.
fn corner() -> Vec<Isometry3<f64>> {
    let east = (0..=50).map(|x| Isometry3::translation(f64::from(x), 0.0, 1.0));
    let north = (1..=50).map(|y| {
        let looking = UnitQuaternion::from_scaled_axis(Vector3::z() * std::f64::consts::FRAC_PI_2);
        Isometry3::from_parts(nalgebra::Translation3::new(50.0, f64::from(y), 1.0), looking)
    });
    east.chain(north).collect()
}

fn trajectory(poses: &[Isometry3<f64>]) -> DrawnTrajectory<'_> {
    DrawnTrajectory { map_from_vehicle: poses, truth: None, surroundings_m: &[] }
}

#[test]
fn the_vehicle_stays_in_the_middle_and_what_it_came_along_lies_below_it() {
    let poses = corner();
    let drawing = drawn(&trajectory(&poses), DrawnView::AboutVehicle { radius_m: 100.0 }, 200);
    assert_eq!(drawing.grid_m, 50.0);
    let at = |right_m: i64, up_m: i64| {
        colour_at(&drawing.picture, (100 + right_m) as usize, (100 - up_m) as usize)
    };
    assert_eq!(at(0, 0), VEHICLE);
    // It looks north: the trajectory is behind it, and to the left of where that began.
    assert_eq!((at(0, -30), at(-20, -50)), (TRAJECTORY, TRAJECTORY));
    assert_eq!((at(0, 30), at(20, -50)), (BACKGROUND, GRID));
}

#[test]
fn the_whole_trajectory_fits_whatever_it_is() {
    let poses = corner();
    let whole = drawn(&trajectory(&poses), DrawnView::Whole, 200).picture;
    let has = |picture: &Picture, colour: [u8; 3]| {
        picture.rgb.as_chunks::<3>().0.iter().filter(|pixel| **pixel == colour).count()
    };
    assert!(has(&whole, TRAJECTORY) > 500 && has(&whole, VEHICLE) > 20 && has(&whole, START) > 20);
    // The trajectory goes from the lower left to the lower right and up.
    assert_eq!(colour_at(&whole, 100, 187), TRAJECTORY);
    assert_eq!(colour_at(&whole, 187, 100), TRAJECTORY);
    for poses in
        [vec![], vec![Isometry3::identity()], vec![Isometry3::translation(f64::NAN, 0.0, 0.0)]]
    {
        for view in [DrawnView::Whole, DrawnView::AboutVehicle { radius_m: 0.0 }] {
            assert_eq!(drawn(&trajectory(&poses), view, 50).picture.rgb.len(), 7500);
        }
    }
}

#[test]
fn the_truth_and_the_surroundings_are_drawn_below_the_trajectory() {
    let poses = corner();
    let truth: Vec<_> =
        poses.iter().map(|pose| Isometry3::translation(0.0, 10.0, 0.0) * pose).collect();
    let around = [Point2::new(25.0, 20.0), Point2::new(25.0, 0.0)];
    let trajectory =
        DrawnTrajectory { map_from_vehicle: &poses, truth: Some(&truth), surroundings_m: &around };
    let picture = drawn(&trajectory, DrawnView::AboutVehicle { radius_m: 100.0 }, 200).picture;
    // 25 m to the left of the vehicle at (50, 50).
    assert_eq!(colour_at(&picture, 75, 130), SURROUNDINGS);
    assert_eq!(colour_at(&picture, 75, 140), TRUTH);
    assert_eq!(colour_at(&picture, 75, 150), TRAJECTORY);
}
