use super::*;
use crate::{Path, Waypoint};

/// A scenario that is quick to run through.
fn quick() -> Scenario {
    Scenario::small().with_depth_size(64, 48).with_duration_s(4.0)
}

#[test]
fn samples_come_in_the_order_of_their_stamps_at_the_rates_of_the_drivers() {
    let scenario = quick();
    let samples: Vec<Sample> = scenario.samples().unwrap().collect();
    assert!(samples.windows(2).all(|pair| pair[0].stamp() <= pair[1].stamp()));
    assert_eq!(samples[0].stamp(), scenario.start);
    let count = |is: fn(&Sample) -> bool| samples.iter().filter(|sample| is(sample)).count();
    assert_eq!(count(|s| matches!(s, Sample::Pose(_))), 121);
    assert_eq!(count(|s| matches!(s, Sample::Depth { .. })), 120);
    // 28 turns in 4 s; the last one may end a little late.
    let scans = count(|s| matches!(s, Sample::Scan { .. }));
    assert!((27..=28).contains(&scans), "{scans} scans");
    // Info, image and truth share their stamp and stay together.
    for (index, sample) in samples.iter().enumerate() {
        if let Sample::Depth { image, labels } = sample {
            assert!(
                matches!(samples[index - 1], Sample::CameraInfo { stamp, .. } if stamp == image.stamp)
            );
            assert!(
                matches!(&samples[index + 1], Sample::ObjectPoses(p) if p.stamp == image.stamp)
            );
            assert_eq!(image.frame_id, "camera_depth_optical_frame");
            assert_eq!((image.width_px(), image.height_px()), (64, 48));
            assert_eq!(labels.stamp, image.stamp);
        }
    }
    // After every scan there is an image and a pose: no cycle is lost at the end.
    let last = |is: fn(&Sample) -> bool| samples.iter().rfind(|s| is(s)).unwrap().stamp();
    let last_scan = last(|s| matches!(s, Sample::Scan { .. }));
    assert!(last_scan < last(|s| matches!(s, Sample::Depth { .. })));
    assert!(last_scan < last(|s| matches!(s, Sample::Pose(_))));
}

#[test]
fn the_same_seed_gives_the_same_samples_and_another_one_gives_others() {
    // Ranges of no return are +Inf, which equals itself; nothing is NaN.
    let run = |seed| quick().with_seed(seed).samples().unwrap().collect::<Vec<Sample>>();
    let first = run(1);
    assert!(first == run(1));
    let other = run(2);
    let differing = |is: fn(&Sample) -> bool| {
        let of = |samples: &[Sample]| samples.iter().filter(|s| is(s)).cloned().collect::<Vec<_>>();
        let (first, other) = (of(&first), of(&other));
        first.iter().zip(&other).filter(|(a, b)| a != b).count() as f64 / first.len() as f64
    };
    assert_eq!(differing(|s| matches!(s, Sample::Depth { .. })), 1.0);
    assert!(differing(|s| matches!(s, Sample::Scan { .. })) > 0.99);
    assert_eq!(differing(|s| matches!(s, Sample::Pose(_))), 0.0);
}

#[test]
fn a_frame_does_not_depend_on_what_was_asked_for_before_it() {
    let scenario = quick();
    let mut samples = scenario.samples().unwrap();
    let alone = samples.image(70).unwrap();
    for _ in 0..50 {
        samples.next();
    }
    assert!(samples.image(70).unwrap() == alone);
}

#[test]
fn poses_are_true_or_as_noisy_as_asked_for() {
    let poses = |scenario: &Scenario| -> Vec<StampedPose> {
        let only_pose = |sample| match sample {
            Sample::Pose(pose) => Some(pose),
            _ => None,
        };
        scenario.samples().unwrap().filter_map(only_pose).collect()
    };
    let scenario = quick().with_depth_size(8, 6).with_duration_s(60.0);
    for pose in poses(&scenario) {
        assert_eq!(pose.frame_id, "map");
        assert!(pose.map_from_rig.translation.vector.norm() < 1e-12);
        assert!(pose.map_from_rig.rotation.angle() < 1e-9);
    }
    let noisy = poses(&scenario.with_pose_noise(0.01, 0.002));
    let mean_square = |value: &dyn Fn(&StampedPose) -> f64| {
        noisy.iter().map(|pose| value(pose).powi(2)).sum::<f64>() / noisy.len() as f64 / 3.0
    };
    let position_m = mean_square(&|pose| pose.map_from_rig.translation.vector.norm()).sqrt();
    let rotation_rad = mean_square(&|pose| pose.map_from_rig.rotation.angle()).sqrt();
    assert!((position_m / 0.01 - 1.0).abs() < 0.05, "{position_m}");
    assert!((rotation_rad / 0.002 - 1.0).abs() < 0.05, "{rotation_rad}");
}

/// A moving rig has no cached background: images must match the pose of each image.
#[test]
fn a_moving_rig_sees_the_far_wall_come_nearer() {
    let mut scenario = quick().without_objects();
    let at = |time_s, x_m| Waypoint { time_s, pose: [x_m, 0.0, 1.5, 0.0, 0.0, 0.0] };
    scenario.rig.path = Path { waypoints: vec![at(0.0, 1.0), at(4.0, 3.0)] };
    assert!(scenario.map_from_rig(0.0).translation.vector.norm() < 1e-12);
    let mut images = 0;
    for sample in scenario.samples().unwrap() {
        let Sample::Depth { image, .. } = sample else { continue };
        let time_s = image.stamp.seconds_since(scenario.start);
        // 1.5 m up, a little right of the middle: the far wall above the monitor.
        let depth_m = f64::from(image.depth_m(33, 23).unwrap_or_default());
        let expected_m = 5.0 - (1.0 + time_s / 2.0);
        if depth_m > 0.0 {
            assert!((depth_m - expected_m).abs() < 4.0 * 2.85e-3 * expected_m * expected_m);
            images += 1;
        }
    }
    assert!(images > 110, "{images}");
    // The empty scene is looked at from every second of the way.
    let cloud = scenario.static_scene_cloud().unwrap();
    let still = quick().static_scene_cloud().unwrap();
    assert!(cloud.points_m.len() > 3 * still.points_m.len());
}

#[test]
fn stamps_deviate_as_asked_for_and_stay_in_order_and_readings_are_the_same() {
    let exact = quick();
    let wrong = quick().with_stamp_errors(0.02, 0.003);
    let images = |scenario: &Scenario| -> Vec<geometry::DepthImage> {
        let image = |sample| match sample {
            Sample::Depth { image, labels } => {
                assert_eq!(image.stamp, labels.stamp);
                Some(image)
            }
            _ => None,
        };
        scenario.samples().unwrap().filter_map(image).collect()
    };
    let (exact_images, wrong_images) = (images(&exact), images(&wrong));
    let late_s: Vec<f64> = exact_images
        .iter()
        .zip(&wrong_images)
        .map(|(exact, wrong)| {
            assert_eq!(exact.pixels(), wrong.pixels());
            wrong.stamp.seconds_since(exact.stamp)
        })
        .collect();
    let mean_s = late_s.iter().sum::<f64>() / late_s.len() as f64;
    let variance = late_s.iter().map(|s| (s - mean_s).powi(2)).sum::<f64>() / late_s.len() as f64;
    assert!((mean_s - 0.02).abs() < 0.001, "mean {mean_s}");
    assert!((variance.sqrt() - 0.003).abs() < 0.0007, "deviation {}", variance.sqrt());
    let stamps: Vec<Stamp> = wrong.samples().unwrap().map(|sample| sample.stamp()).collect();
    assert!(stamps.is_sorted());
    // Jitter that could change the order is rejected.
    assert!(quick().with_stamp_errors(0.0, 0.01).samples().is_err());
}

#[test]
fn a_mounting_error_moves_the_scanner_by_the_seed() {
    let mounting = |seed: u64| {
        quick().with_seed(seed).with_mounting_error(0.01, 0.02).rig.lidar.rig_from_lidar
    };
    assert_eq!(mounting(1), mounting(1));
    assert_ne!(mounting(1), mounting(2));
    let nominal = quick().rig.lidar.rig_from_lidar;
    for (axis, (wrong, right)) in mounting(1).iter().zip(nominal).enumerate() {
        let std_dev = if axis < 3 { 0.01 } else { 0.02 };
        assert!(*wrong != right && (wrong - right).abs() < 3.5 * std_dev);
    }
}
