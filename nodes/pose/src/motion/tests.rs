use estimation::perturbation::left::{perturbation_between, perturbed};
use estimation::twist::part_of_motion;
use nalgebra::{Translation3, UnitQuaternion};
use proptest::prelude::*;

use super::*;
use crate::solve::testing::{Random, any_pose};

fn stamp(seconds: f64) -> Stamp {
    Stamp::from_secs_nanos(1_700_000_000, 0).plus_seconds(seconds)
}

fn known(seconds: f64, camera_from_map: Isometry3<f64>) -> KnownPose {
    let covariance = by_std_devs(&Vector3::repeat(0.003), &Vector3::repeat(0.001));
    KnownPose { stamp: stamp(seconds), camera_from_map, covariance }
}

fn screw(x: f64, about_y: f64) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(x, 0.02, -0.01),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.01, about_y, 0.0)),
    )
}

proptest! {
    #[test]
    fn a_constant_velocity_is_predicted_exactly_whatever_the_intervals(
        start in any_pose(), passed_s in 0.02..0.2_f64, ahead_s in 0.02..0.2_f64,
    ) {
        let rate = screw(0.4, 0.8);
        let at = |seconds: f64| part_of_motion(&rate, seconds) * start;
        let (before, last) = (known(0.0, at(0.0)), known(passed_s, at(passed_s)));
        let next = stamp(passed_s + ahead_s);
        let found = constant_velocity(Some(&before), &last, next, &MotionConfig::default()).unwrap();
        let error = perturbation_between(&at(passed_s + ahead_s), &found.camera_from_map);
        prop_assert!(error.norm() < 1e-6, "{error}");
    }
}

#[test]
fn the_covariance_of_a_prediction_is_of_the_size_of_its_errors() {
    let config = MotionConfig::default();
    const DRAWS: u32 = 400;
    for (passed_s, ahead_s) in [(0.033, 0.033), (0.033, 0.2), (0.2, 0.05)] {
        let mut sum = 0.0;
        let mut random = Random::new(11);
        for _ in 0..DRAWS {
            // A velocity that changes evenly, by an acceleration that is drawn.
            let acceleration =
                random.perturbation(config.acceleration_m_per_s2, config.acceleration_rad_per_s2);
            let velocity = Vector6::new(0.3, -0.1, 0.2, 0.1, 0.3, -0.2);
            let at = |seconds: f64| {
                let shift = velocity * seconds + acceleration * (0.5 * seconds * seconds);
                perturbed(&Isometry3::identity(), &shift)
            };
            let measured = |seconds: f64, random: &mut Random| {
                known(seconds, perturbed(&at(seconds), &random.perturbation(0.003, 0.001)))
            };
            let before = measured(-passed_s, &mut random);
            let last = measured(0.0, &mut random);
            let found = constant_velocity(Some(&before), &last, stamp(ahead_s), &config).unwrap();
            let error = perturbation_between(&at(ahead_s), &found.camera_from_map);
            sum += error.dot(&found.covariance.unwrap().cholesky().unwrap().solve(&error));
        }
        let nees = sum / f64::from(DRAWS);
        println!("{passed_s} s, then {ahead_s} s: NEES {nees:.2}");
        // 95 % of the means of this many are within 0.34; the motion's own curvature adds a little.
        assert!((nees - 6.0).abs() < 0.5, "{passed_s} {ahead_s}: {nees}");
    }
}

#[test]
fn time_that_goes_back_and_gaps_are_said() {
    let config = MotionConfig::default();
    let (before, last) = (known(0.0, Isometry3::identity()), known(0.1, screw(0.1, 0.1)));
    let run = |before: Option<&KnownPose>, at| constant_velocity(before, &last, stamp(at), &config);
    assert!(run(Some(&before), 0.2).is_ok());
    assert!(matches!(
        run(Some(&before), 0.05),
        Err(NoPrediction::TimeWentBack { by_s }) if (by_s - 0.05).abs() < 1e-6
    ));
    assert_eq!(run(Some(&before), 0.1), Err(NoPrediction::TimeWentBack { by_s: 0.0 }));
    assert!(matches!(
        run(Some(&before), 0.7),
        Err(NoPrediction::Gap { gap_s, max_gap_s: 0.5 }) if (gap_s - 0.6).abs() < 1e-6
    ));
    assert_eq!(run(None, 0.2), Err(NoPrediction::NoVelocity));
    assert!(matches!(run(Some(&last), 0.2), Err(NoPrediction::TimeWentBack { .. })));
    let lost = known(0.0, Isometry3::translation(f64::NAN, 0.0, 0.0));
    assert_eq!(run(Some(&lost), 0.2), Err(NoPrediction::NotFinite));
    let long_ago = known(-1.0, Isometry3::identity());
    assert!(matches!(run(Some(&long_ago), 0.2), Err(NoPrediction::Gap { .. })));
}

/// Samples of a rate that turns about one axis and grows evenly.
fn growing_rate(from_s: f64, to_s: f64, step_s: f64) -> Vec<GyroSample> {
    let count = ((to_s - from_s) / step_s).round() as usize;
    (0..=count)
        .map(|index| {
            let seconds = from_s + index as f64 * step_s;
            let rate_rad_per_s = Vector3::new(0.0, 0.5 + 2.0 * seconds, 0.0);
            GyroSample { stamp: stamp(seconds), rate_rad_per_s }
        })
        .collect()
}

#[test]
fn a_gyroscope_is_integrated_over_the_interval_and_no_more() {
    let config = MotionConfig::default();
    let samples = growing_rate(-0.1, 0.3, 0.01);
    for (from_s, to_s) in [(0.0, 0.1), (0.013, 0.0457), (0.003, 0.004)] {
        let turn = integrated_turn(&samples, stamp(from_s), stamp(to_s), &config).unwrap();
        let expected = 0.5 * (to_s - from_s) + (to_s * to_s - from_s * from_s);
        let found = turn.begin_from_end.scaled_axis();
        assert!((found - expected * Vector3::y()).norm() < 1e-8, "{found} {expected}");
    }
    let turn = |span_s| integrated_turn(&samples, stamp(0.0), stamp(span_s), &config).unwrap();
    assert!(turn(0.2).covariance[(0, 0)] > turn(0.1).covariance[(0, 0)]);
}

#[test]
fn a_gyroscope_that_does_not_cover_the_interval_says_nothing() {
    let config = MotionConfig::default();
    let samples = growing_rate(0.0, 0.1, 0.01);
    let run = |samples: &[GyroSample], from_s, to_s| {
        integrated_turn(samples, stamp(from_s), stamp(to_s), &config)
    };
    // Half a sample's distance is bridged.
    let bridged = run(&samples, 0.0, 0.104).unwrap().begin_from_end.angle();
    assert!((bridged - (0.05 + 0.01 + 0.004 * 0.7)).abs() < 1e-6, "{bridged}");
    assert!(matches!(
        run(&samples, -0.05, 0.1),
        Err(NoPrediction::NotCovered { missing_s }) if (missing_s - 0.05).abs() < 1e-6
    ));
    assert!(matches!(run(&samples, 0.2, 0.3), Err(NoPrediction::NotCovered { .. })));
    assert!(matches!(run(&[], 0.0, 0.1), Err(NoPrediction::NotCovered { .. })));
    assert!(matches!(run(&samples[..1], 0.0, 0.1), Err(NoPrediction::NotCovered { .. })));
    assert!(matches!(run(&samples, 0.1, 0.0), Err(NoPrediction::TimeWentBack { .. })));
    let mut disordered = samples.clone();
    disordered.swap(3, 4);
    assert!(matches!(run(&disordered, 0.0, 0.1), Err(NoPrediction::TimeWentBack { .. })));
    let mut spoilt = samples;
    spoilt[5].rate_rad_per_s.x = f64::NAN;
    assert_eq!(run(&spoilt, 0.0, 0.1), Err(NoPrediction::NotFinite));
}

#[test]
fn a_gyroscope_corrects_the_rotation_of_a_prediction_and_keeps_the_translation() {
    let config = MotionConfig::default();
    let start = screw(1.0, 0.7);
    let last = known(0.1, start);
    // The camera moves straight, then rotates while it moves on: only the gyroscope measures it.
    let straight = Isometry3::translation(0.0, 0.0, -0.02);
    let before = known(0.0, straight.inverse() * start);
    let predicted = constant_velocity(Some(&before), &last, stamp(0.2), &config).unwrap();
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.1, 0.0));
    let truth = Isometry3::from_parts(Translation3::identity(), turn.inverse()) * straight * start;
    let read = Turn { begin_from_end: turn, covariance: 1e-6 * nalgebra::Matrix3::identity() };
    let mended = turned(&predicted, &last, &read).unwrap();
    assert!(perturbation_between(&truth, &mended.camera_from_map).norm() < 1e-9);
    let variances = mended.covariance.unwrap().diagonal();
    assert!((variances[4] - (1e-6 + 1e-6)).abs() < 1e-9, "{variances}");
    assert_eq!(variances[0], predicted.covariance.unwrap()[(0, 0)]);
}

#[test]
fn wheels_move_the_camera_as_they_move_the_platform() {
    let config = MotionConfig::default();
    let camera_from_base = screw(0.3, 1.2);
    let map_from_odom = Isometry3::new(Vector3::new(5.0, -2.0, 0.0), Vector3::z());
    let before = Isometry3::new(Vector3::new(1.0, 2.0, 0.0), 0.4 * Vector3::z());
    let now = before * Isometry3::new(Vector3::new(0.1, 0.0, 0.0), 0.05 * Vector3::z());
    let camera_at = |base: &Isometry3<f64>| camera_from_base * (map_from_odom * base).inverse();
    let last = known(0.0, camera_at(&before));
    let step =
        WheelStep { odom_from_base_before: before, odom_from_base_now: now, camera_from_base };
    let found = by_wheels(&last, &step, stamp(0.1), &config).unwrap();
    assert!(perturbation_between(&camera_at(&now), &found.camera_from_map).norm() < 1e-9);
    let farther =
        WheelStep { odom_from_base_now: before * Isometry3::translation(0.4, 0.0, 0.0), ..step };
    let less_sure = by_wheels(&last, &farther, stamp(0.1), &config).unwrap();
    assert!(less_sure.covariance.unwrap().trace() > found.covariance.unwrap().trace());
    assert!(matches!(
        by_wheels(&last, &step, stamp(-0.1), &config),
        Err(NoPrediction::TimeWentBack { .. })
    ));
    let spoilt =
        WheelStep { odom_from_base_now: Isometry3::translation(f64::NAN, 0.0, 0.0), ..step };
    assert_eq!(by_wheels(&last, &spoilt, stamp(0.1), &config), Err(NoPrediction::NotFinite));
}

#[test]
fn the_defaults_are_valid_and_bad_values_are_named() {
    assert_eq!(MotionConfig::default().validate(), Ok(()));
    let bad = MotionConfig { max_gap_s: f64::NAN, ..MotionConfig::default() };
    assert!(bad.validate().unwrap_err().to_string().starts_with("parameter max_gap_s "));
}
