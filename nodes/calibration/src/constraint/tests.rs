use geometry::{DepthImage, Distortion, pose_from_vector};
use nalgebra::Vector3;
use proptest::prelude::*;

use super::*;
use crate::testing::{Eye, depth_of_plane_m, small_camera, usual_mounts};

fn constraint(point: [f64; 3], normal: [f64; 3], motion: [f64; 6]) -> Constraint {
    Constraint {
        beam: 0,
        kind: Kind::Plane,
        step_rad: 0.0175,
        point_in_lidar_m: Point3::from(point),
        image_rig_from_rig: pose_from_vector(&motion),
        surface: Surface {
            normal: Vector3::from(normal).normalize(),
            offset_m: 2.0,
            std_dev_m: 0.01,
            normal_std_dev_rad: 0.01,
        },
        std_dev_m: 0.02,
    }
}

proptest! {
    #[test]
    fn the_derivative_is_that_of_the_distance(
        point in proptest::array::uniform3(-5.0..5.0_f64),
        normal in proptest::array::uniform3(0.1..1.0_f64),
        motion in proptest::array::uniform6(-0.3..0.3_f64),
        mount in proptest::array::uniform6(-0.5..0.5_f64),
    ) {
        let constraint = constraint(point, normal, motion);
        let lidar = usual_mounts().rig_from_lidar * pose_from_vector(&mount);
        let mounts = RigMounts { rig_from_lidar: lidar, ..usual_mounts() };
        let here = constraint.linearised(&mounts);
        for coordinate in 0..6 {
            const STEP: f64 = 1e-6;
            let mut correction = Vector6::zeros();
            correction[coordinate] = STEP;
            let there = constraint.linearised(&mounts.corrected(&correction)).distance_m;
            correction[coordinate] = -STEP;
            let back = constraint.linearised(&mounts.corrected(&correction)).distance_m;
            let slope = (there - back) / (2.0 * STEP);
            prop_assert!((slope - here.jacobian[coordinate]).abs() < 1e-6, "coordinate {coordinate}");
        }
    }

    #[test]
    fn the_displacement_of_a_return_is_that_of_its_matrix(
        point in proptest::array::uniform3(-5.0..5.0_f64),
        correction in proptest::array::uniform6(-1e-5..1e-5_f64),
    ) {
        let constraint = constraint(point, [1.0, 0.0, 0.0], [0.0; 6]);
        let mounts = usual_mounts();
        let correction = Vector6::from(correction);
        let moved = mounts.corrected(&correction).rig_from_lidar * constraint.point_in_lidar_m;
        let moved_m = (moved - mounts.rig_from_lidar * constraint.point_in_lidar_m).norm();
        let squared = correction.dot(&(constraint.linearised(&mounts).displacement_matrix() * correction));
        prop_assert!((moved_m - squared.sqrt()).abs() < 1e-9, "{moved_m} {squared}");
    }
}

/// A scan of a box before a wall, as a scanner at `mounts` would have it, without noise.
fn scan_of(ranges_m: impl Fn(f64) -> f64) -> Vec<LidarReturn> {
    let step_rad = 1_f64.to_radians();
    (-30..=30)
        .enumerate()
        .map(|(beam, degrees)| {
            let azimuth_rad = f64::from(degrees) * step_rad;
            let range_m = ranges_m(azimuth_rad);
            let image_rig_from_rig = nalgebra::Isometry3::identity();
            LidarReturn { beam, azimuth_rad, range_m, step_rad, image_rig_from_rig }
        })
        .collect()
}

/// A wall 4 m away, and a box from 2.5 m on, up to `y = 0.25 m` on the right and `y = 0` on the left.
fn room(eye: &Eye) -> DepthImage {
    let forward = Vector3::z();
    eye.image(|x, y| {
        let is_box = (0.0..0.1).contains(&x);
        Some(depth_of_plane_m(&forward, if is_box { 2.5 } else { 4.0 }, x, y))
    })
}

#[test]
fn the_returns_of_a_true_scan_lie_on_the_surfaces_and_edges() {
    let eye = Eye::new(small_camera(Distortion::None));
    let image = room(&eye);
    // To the right is -y.
    let is_box = |azimuth_rad: f64| (0.0..0.1).contains(&-azimuth_rad.tan());
    let returns =
        scan_of(|azimuth_rad| if is_box(azimuth_rad) { 2.5 } else { 4.0 } / azimuth_rad.cos());
    let config = CalibrationConfig::default();
    let mounts = usual_mounts();
    let constraints = constraints_of(&returns, |_| true, &image, eye.optics(), &mounts, &config);
    let edges: Vec<&Constraint> = constraints.iter().filter(|one| one.kind == Kind::Edge).collect();
    assert_eq!(edges.len(), 2, "{edges:?}");
    for edge in &edges {
        let linearised = edge.linearised(&mounts);
        // Half a step of a beam at 2.5 m.
        assert!(linearised.distance_m.abs() < 0.03, "{linearised:?}");
        // It determines y alone, seen straight ahead.
        assert!(linearised.jacobian[1].abs() > 0.98 && linearised.jacobian[2].abs() < 0.05);
    }
    let planes = constraints.len() - edges.len();
    assert!((40..=58).contains(&planes), "{planes}");
    for one in constraints.iter().filter(|one| one.kind == Kind::Plane) {
        let linearised = one.linearised(&mounts);
        assert!(linearised.distance_m.abs() < 1e-4, "{one:?}");
        assert!((linearised.jacobian[0] - 1.0).abs() < 1e-3, "{linearised:?}");
        assert!((0.01..0.05).contains(&one.std_dev_m));
    }
    // What is not static is left out, and an edge with either of its beams.
    let none = constraints_of(&returns, |_| false, &image, eye.optics(), &mounts, &config);
    assert!(none.is_empty());
    let near = edges[0].beam;
    let without =
        constraints_of(&returns, |place| place != near, &image, eye.optics(), &mounts, &config);
    assert!(without.iter().filter(|one| one.kind == Kind::Edge).count() < 2);
}

#[test]
fn a_scan_of_another_place_lies_on_nothing() {
    let eye = Eye::new(small_camera(Distortion::None));
    let image = room(&eye);
    let config = CalibrationConfig::default();
    for range_m in [1.0, 3.2, 6.0] {
        let returns = scan_of(|_| range_m);
        let found =
            constraints_of(&returns, |_| true, &image, eye.optics(), &usual_mounts(), &config);
        assert!(found.is_empty(), "{range_m} m: {found:?}");
    }
}
