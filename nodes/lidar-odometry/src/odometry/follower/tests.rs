use nalgebra::{Isometry3, Vector3};

use super::*;
use crate::registration::CoarseConfig;
use crate::selection::RayFilter;
use crate::testing::{Random, apart, seen, street};

fn truth(number: usize) -> Isometry3<f64> {
    Isometry3::new(Vector3::new(-20.0 + 0.6 * number as f64, 0.0, 0.0), Vector3::zeros())
}

fn cloud(number: usize) -> LidarCloud {
    let mut random = Random::new(5 + number as u64);
    let scene = street(&mut Random::new(1));
    LidarCloud {
        stamp: Stamp::default().plus_seconds(0.1 * number as f64),
        points_m: seen(&scene, &truth(number), 9000, 0.01, &mut random),
        ..LidarCloud::default()
    }
}

fn follower(config: FollowerConfig) -> Follower {
    Follower::new(config, std::sync::Arc::new(estimation::Serial)).unwrap()
}

#[test]
fn both_methods_follow_a_street_and_begin_anew_on_reset() {
    let coarse = CoarseConfig { every: 2, ..CoarseConfig::default() };
    let registration = RegistrationConfig { coarse, ..RegistrationConfig::default() };
    for method in [OdometryMethod::LocalMap, OdometryMethod::ScanToScan] {
        let mut follower = follower(FollowerConfig { method, registration, ..Default::default() });
        for round in 0..2 {
            for number in 0..5 {
                let pose = follower.step(&cloud(number), &MotionHint::default()).unwrap();
                let expected = truth(0).inv_mul(&truth(number));
                let (metres, radians) = apart(&pose.odom_from_lidar, &expected);
                assert!(
                    metres < 0.1 && radians < 0.01,
                    "{method:?} {round} {number}: {metres} {radians}"
                );
                assert_eq!(pose.quality.trouble(), None, "{method:?} {number}");
            }
            let earlier = follower.step(&cloud(0), &MotionHint::default());
            assert!(matches!(earlier, Err(FollowerError::Scan(Refusal::NotLater { .. }))));
            assert_eq!(follower.local_map().is_empty(), method == OdometryMethod::ScanToScan);
            follower.forget();
        }
    }
}

#[test]
fn a_scan_of_another_place_is_a_trouble_with_its_reason() {
    let mut lost = cloud(2);
    for point in &mut lost.points_m {
        point.z += 500.0;
    }
    for method in [OdometryMethod::LocalMap, OdometryMethod::ScanToScan] {
        let local_map = LidarOdometryConfig { max_range_m: 1000.0, ..Default::default() };
        let mut follower = follower(FollowerConfig { method, local_map, ..Default::default() });
        for number in 0..2 {
            follower.step(&cloud(number), &MotionHint::default()).unwrap();
        }
        let pose = follower.step(&lost, &MotionHint::default()).unwrap();
        let trouble = pose.quality.trouble().unwrap();
        assert!(trouble.contains("do not overlap"), "{method:?}: {trouble}");
    }
}

#[test]
fn a_choice_that_the_cloud_cannot_answer_is_an_error_and_changes_nothing() {
    let points = PointChoice::Rays(RayFilter { lowest_left_out: 1, every: 1 });
    let mut follower = follower(FollowerConfig { points, ..Default::default() });
    let error = follower.step(&cloud(0), &MotionHint::default()).unwrap_err();
    assert!(error.to_string().contains("ring"), "{error}");
    assert_eq!(follower.interval(&cloud(1)), None);
}
