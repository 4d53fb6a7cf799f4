use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use nalgebra::{Matrix3, Quaternion};
use proptest::prelude::*;

use super::*;

fn any_vector() -> impl Strategy<Value = [f64; 6]> {
    (proptest::array::uniform3(-10.0..10.0_f64), -PI..PI, -FRAC_PI_2..FRAC_PI_2, -PI..PI)
        .prop_map(|([x, y, z], phi, beta, gamma)| [x, y, z, phi, beta, gamma])
}

fn rotation_of(matrix: &Matrix4<f64>) -> Matrix3<f64> {
    matrix.fixed_view::<3, 3>(0, 0).into_owned()
}

/// How far a matrix is from being a rotation.
fn distance_from_rotation(matrix: &Matrix3<f64>) -> f64 {
    let orthonormal = (matrix.transpose() * matrix - Matrix3::identity()).norm();
    orthonormal.max((matrix.determinant() - 1.0).abs())
}

proptest! {
    #[test]
    fn the_matrix_of_eq_8_is_a_rigid_motion(vector in any_vector()) {
        let matrix = homogeneous_from_pose_vector(&vector);
        prop_assert!(distance_from_rotation(&rotation_of(&matrix)) < 1e-12);
        prop_assert_eq!(matrix.row(3).into_owned(), nalgebra::RowVector4::new(0.0, 0.0, 0.0, 1.0));
    }

    #[test]
    fn the_matrix_of_eq_8_is_the_pose_of_its_vector(vector in any_vector()) {
        let difference = homogeneous_from_pose_vector(&vector) - pose_from_vector(&vector).to_homogeneous();
        prop_assert!(difference.norm() < 1e-12);
    }

    #[test]
    fn the_matrix_as_printed_is_no_rotation(
        phi in 0.1..1.4_f64, gamma in 0.1..1.4_f64, beta in -1.4..1.4_f64,
    ) {
        // Eq. 8 prints a plus before sin(phi) cos(gamma) in row 1, column 2.
        let mut printed = rotation_of(&homogeneous_from_pose_vector(&[0.0, 0.0, 0.0, phi, beta, gamma]));
        printed[(0, 1)] += 2.0 * phi.sin() * gamma.cos();
        prop_assert!(distance_from_rotation(&printed) > 1e-3);
    }

    #[test]
    fn a_pose_survives_its_vector(vector in any_vector()) {
        let pose = pose_from_vector(&vector);
        let again = pose_from_vector(&pose_vector(&pose));
        prop_assert!((again.to_homogeneous() - pose.to_homogeneous()).norm() < 1e-6);
        if vector[4].abs() < 1.5 {
            for (value, expected) in pose_vector(&pose).iter().zip(vector) {
                prop_assert!((value - expected).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn phi_turns_about_z_beta_about_y_and_gamma_about_x() {
    let turned = |vector: [f64; 6], point: [f64; 3]| {
        pose_from_vector(&vector) * nalgebra::Point3::from(point)
    };
    for (vector, point, expected) in [
        ([0.0, 0.0, 0.0, FRAC_PI_2, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        ([0.0, 0.0, 0.0, 0.0, FRAC_PI_2, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]),
        ([0.0, 0.0, 0.0, 0.0, 0.0, FRAC_PI_2], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]),
        ([1.0, 2.0, 3.0, 0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.5, 2.0, 3.0]),
        // The default of `rig_from_camera`: the optical axis is the rig's forward axis.
        ([0.0, 0.0, 0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]),
        ([0.0, 0.0, 0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]),
    ] {
        let found = turned(vector, point);
        assert!((found - nalgebra::Point3::from(expected)).norm() < 1e-12, "{vector:?}: {found}");
    }
}

fn pose(millis: i64, x_m: f64, phi_rad: f64) -> StampedPose {
    let map_from_rig = pose_from_vector(&[x_m, 0.0, 0.0, phi_rad, 0.0, 0.0]);
    StampedPose {
        stamp: Stamp::from_nanos(millis * 1_000_000),
        frame_id: "map".to_owned(),
        map_from_rig,
    }
}

fn at(buffer: &PoseBuffer, millis: i64) -> Result<StampedPose, PoseLookupError> {
    buffer.at(Stamp::from_nanos(millis * 1_000_000))
}

fn millis_of(pose: Option<&StampedPose>) -> Option<i64> {
    pose.map(|pose| pose.stamp.as_nanos() / 1_000_000)
}

#[test]
fn between_two_poses_all_goes_in_proportion_to_time() {
    let mut buffer = PoseBuffer::new(8);
    buffer.push(pose(100, 1.0, 0.0)).unwrap();
    buffer.push(pose(200, 3.0, FRAC_PI_2)).unwrap();
    let quarter = at(&buffer, 125).unwrap();
    assert_eq!((quarter.stamp.as_nanos(), quarter.frame_id.as_str()), (125_000_000, "map"));
    let expected = [1.5, 0.0, 0.0, FRAC_PI_2 / 4.0, 0.0, 0.0];
    for (value, expected) in pose_vector(&quarter.map_from_rig).iter().zip(expected) {
        assert!((value - expected).abs() < 1e-12, "{quarter:?}");
    }
    assert_eq!(at(&buffer, 100).unwrap(), pose(100, 1.0, 0.0));
    assert_eq!(at(&buffer, 200).unwrap(), pose(200, 3.0, FRAC_PI_2));
}

#[test]
fn the_rotation_takes_the_shorter_arc_over_the_seam() {
    let mut buffer = PoseBuffer::new(8);
    buffer.push(pose(0, 0.0, PI - FRAC_PI_4)).unwrap();
    buffer.push(pose(100, 0.0, -PI + FRAC_PI_4)).unwrap();
    let phi_rad = pose_vector(&at(&buffer, 50).unwrap().map_from_rig)[3];
    assert!((phi_rad.abs() - PI).abs() < 1e-9, "{phi_rad}");
}

#[test]
fn nothing_is_extrapolated() {
    let mut buffer = PoseBuffer::new(8);
    assert_eq!(at(&buffer, 0), Err(PoseLookupError::Empty));
    buffer.push(pose(100, 0.0, 0.0)).unwrap();
    assert_eq!(at(&buffer, 100).unwrap(), pose(100, 0.0, 0.0));
    buffer.push(pose(200, 0.0, 0.0)).unwrap();
    assert_eq!(at(&buffer, 75), Err(PoseLookupError::BeforeOldest { by_s: 0.025 }));
    assert_eq!(at(&buffer, 250), Err(PoseLookupError::AfterNewest { by_s: 0.05 }));
}

#[test]
fn a_gap_is_bridged_up_to_its_limit() {
    let mut buffer = PoseBuffer::new(8).with_max_gap_s(0.1);
    for millis in [0, 100, 201] {
        buffer.push(pose(millis, 0.0, 0.0)).unwrap();
    }
    assert!(at(&buffer, 50).is_ok());
    assert_eq!(at(&buffer, 150), Err(PoseLookupError::Gap { gap_s: 0.101, max_gap_s: 0.1 }));
    assert!(at(&buffer, 201).is_ok());
    assert!(at(&buffer.with_max_gap_s(f64::NAN), 50).is_err());
}

#[test]
fn a_longer_gap_is_bridged_while_the_platform_stands() {
    let mut buffer = PoseBuffer::new(8).with_max_gap_s(0.1).with_max_rest_s(0.5);
    // It stands, drives, turns, and stands for too long.
    for (millis, x_m, yaw_rad) in
        [(0, 0.0, 0.0), (400, 0.04, 0.005), (800, 0.4, 0.0), (1200, 0.4, 0.1), (1800, 0.4, 0.1)]
    {
        buffer.push(pose(millis, x_m, yaw_rad)).unwrap();
    }
    assert!(at(&buffer, 100).unwrap().map_from_rig.translation.x - 0.01 < 1e-9);
    for millis in [500, 1000, 1500] {
        assert!(matches!(at(&buffer, millis), Err(PoseLookupError::Gap { .. })), "{millis}");
    }
}

#[test]
fn a_late_pose_finds_its_place_and_a_second_one_is_refused() {
    let mut buffer = PoseBuffer::new(8);
    for millis in [300, 100, 200] {
        buffer.push(pose(millis, millis as f64, 0.0)).unwrap();
    }
    assert_eq!((millis_of(buffer.oldest()), millis_of(buffer.newest())), (Some(100), Some(300)));
    assert_eq!(at(&buffer, 150).unwrap().map_from_rig.translation.x, 150.0);
    let stamp = Stamp::from_nanos(200_000_000);
    assert_eq!(buffer.push(pose(200, 7.0, 0.0)), Err(PosePushError::Duplicate { stamp }));
    assert_eq!(at(&buffer, 200).unwrap().map_from_rig.translation.x, 200.0);
}

#[test]
fn a_full_buffer_lets_the_oldest_go() {
    let mut buffer = PoseBuffer::new(3);
    for millis in [100, 200, 300, 400] {
        buffer.push(pose(millis, 0.0, 0.0)).unwrap();
    }
    assert_eq!((buffer.len(), millis_of(buffer.oldest())), (3, Some(200)));
    buffer.push(pose(350, 0.0, 0.0)).unwrap();
    assert_eq!((buffer.len(), millis_of(buffer.oldest())), (3, Some(300)));
    let late = buffer.push(pose(250, 0.0, 0.0)).unwrap_err();
    assert_eq!(late, PosePushError::TooOld { late_s: 0.05, capacity: 3 });
    assert_eq!(buffer.len(), 3);
    // Less than two could not interpolate.
    let mut smallest = PoseBuffer::new(0);
    smallest.push(pose(0, 0.0, 0.0)).unwrap();
    smallest.push(pose(1, 0.0, 0.0)).unwrap();
    assert_eq!(smallest.len(), 2);
}

#[test]
fn a_pose_that_does_not_belong_is_refused() {
    let mut buffer = PoseBuffer::new(3);
    buffer.push(pose(0, 0.0, 0.0)).unwrap();
    let other = StampedPose { frame_id: "odom".to_owned(), ..pose(10, 0.0, 0.0) };
    let error = buffer.push(other.clone()).unwrap_err();
    assert!(error.to_string().contains("'odom'") && error.to_string().contains("'map'"), "{error}");
    let error = buffer.push(pose(10, f64::NAN, 0.0)).unwrap_err();
    let stamp = Stamp::from_nanos(10_000_000);
    assert_eq!(error, PosePushError::Unusable { stamp, source: UnusablePose::NotFinite });
    assert_eq!(buffer.len(), 1);
    buffer.clear();
    assert!(buffer.is_empty() && buffer.newest().is_none());
    assert_eq!(buffer.push(other), Ok(()));
}

proptest! {
    #[test]
    fn the_order_of_arrival_does_not_matter(
        mut order in Just((0..12_i64).collect::<Vec<_>>()).prop_shuffle(),
        asked in 0..1100_i64,
    ) {
        let filled = |order: &[i64]| {
            let mut buffer = PoseBuffer::new(12);
            for &index in order {
                buffer.push(pose(index * 100, (index * index) as f64, index as f64 * 0.1)).unwrap();
            }
            at(&buffer, asked)
        };
        let shuffled = filled(&order);
        order.sort_unstable();
        prop_assert_eq!(shuffled, filled(&order));
    }
}

/// In the coordinates of a map grid, points 8 cm apart once fell together.
#[test]
fn a_pose_too_far_for_single_precision_is_refused() {
    let at = |x_m: f64| Isometry3::translation(x_m, 0.0, 0.0);
    assert_eq!(check_pose(&at(FARTHEST_POSE_M)), Ok(()));
    let utm = at(4.5e6);
    assert_eq!(check_pose(&utm), Err(UnusablePose::TooFar { distance_m: 4.5e6 }));
    assert_eq!(check_pose(&at(f64::NAN)), Err(UnusablePose::NotFinite));
    // Regression: it was taken, and the map stayed empty.
    for w in [0.0, 2.0] {
        let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, 0.0, 0.0, 0.0));
        let none = Isometry3::from_parts(Translation3::identity(), rotation);
        assert_eq!(check_pose(&none), Err(UnusablePose::NotARotation { length: w }));
    }
    // Accepted poses keep points apart that are a tenth of a voxel apart.
    let point_m = at(FARTHEST_POSE_M).cast::<f32>() * nalgebra::Point3::new(0.0_f32, 0.0, 0.0);
    let next_m = at(FARTHEST_POSE_M).cast::<f32>() * nalgebra::Point3::new(0.008_f32, 0.0, 0.0);
    assert!(next_m.x > point_m.x);
}
