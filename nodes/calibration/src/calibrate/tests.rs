use nalgebra::Vector6;
use simulator::{CrossingObject, Path, PathName, Platform, Scenario, SceneName};

use super::*;
use crate::observability::Coordinate;
use crate::testing::{Recording, corner, is_covariance, normalised_error_squared, usual_mounts};

/// A mounting by ruler and eye: 3 cm and 1.1 degrees, of each coordinate.
fn badly_mounted(scenario: Scenario) -> Scenario {
    scenario.with_mounting_error(0.03, 0.02).with_depth_size(320, 240)
}

/// The bounds that an estimate must keep, whatever it claims.
const WITHIN_M: f64 = 0.01;
const WITHIN_RAD: f64 = 0.2 * std::f64::consts::PI / 180.0;

/// Checks an estimate against the truth: three standard deviations, and bounds.
fn check(name: &str, calibration: &Calibration, truth: &Vector6<f64>, within_m: f64) {
    assert!(is_covariance(&calibration.covariance), "{name}: {:?}", calibration.covariance);
    for one in &calibration.coordinates {
        let index = one.coordinate as usize;
        let off = (one.correction - truth[index]).abs();
        let coordinate = one.coordinate;
        if one.is_estimated() {
            let within = if coordinate.is_shift() { within_m } else { WITHIN_RAD };
            assert!(
                off <= 3.0 * one.std_dev && off <= within,
                "{name}: {coordinate} is off by {off:.5}, and {:.5} is claimed",
                one.std_dev
            );
        } else if one.is_held() {
            assert!(
                one.correction.abs() < 1e-9,
                "{name}: {coordinate} is held, and has moved by {}",
                one.correction
            );
        }
    }
    println!(
        "{name}: {} returns, {} edges, {} outliers, {} moving, rms {:.4} -> {:.4}, factor {:.2}, {} iterations; {:?}",
        calibration.plane_returns,
        calibration.edges,
        calibration.outliers,
        calibration.moving_returns,
        calibration.rms_before_m,
        calibration.rms_after_m,
        calibration.noise_factor,
        calibration.iterations,
        calibration.coordinates.map(|one| format!(
            "{} {:+.4} ({:.4} true, +-{:.4}, {:.2})",
            one.coordinate,
            one.correction,
            truth[one.coordinate as usize],
            one.std_dev,
            one.estimated_share
        ))
    );
}

fn calibrated(scenario: Scenario) -> (Calibration, Vector6<f64>) {
    let name = scenario.name.clone();
    let recording = Recording::of(&scenario);
    let mounts = usual_mounts();
    let truth = recording.true_correction(&mounts);
    let calibration =
        recording.calibrate(&mounts).unwrap_or_else(|error| panic!("{name}: {error}"));
    (calibration, truth)
}

const HEIGHT_IS_HELD: &str =
    "z, roll and pitch are not observable from this bag: the scan hit only vertical surfaces";

#[test]
fn in_a_furnished_corner_x_y_and_yaw_are_found() {
    for seed in 1..=4 {
        let (calibration, truth) = calibrated(badly_mounted(corner(seed)));
        let name = format!("corner, seed {seed}");
        check(&name, &calibration, &truth, WITHIN_M);
        for coordinate in [Coordinate::X, Coordinate::Y, Coordinate::Yaw] {
            assert!(calibration.of(coordinate).is_estimated(), "{name}: {coordinate}");
        }
        for coordinate in [Coordinate::Z, Coordinate::Roll, Coordinate::Pitch] {
            assert!(calibration.of(coordinate).is_held(), "{name}: {coordinate}");
        }
        assert_eq!(calibration.not_observable, [HEIGHT_IS_HELD], "{name}");
        assert!(calibration.rms_after_m < calibration.rms_before_m, "{name}");
    }
}

/// Straight ahead into a room there is less that faces sideways: y is known to half a centimetre, or not at all.
#[test]
fn in_the_rooms_of_table_2_what_is_found_is_right() {
    for scene in [SceneName::B, SceneName::C, SceneName::F, SceneName::H] {
        for seed in 1..=3 {
            let name = format!("scene {scene}, seed {seed}");
            let (calibration, truth) = calibrated(badly_mounted(Scenario::empty(scene, seed)));
            check(&name, &calibration, &truth, 2.0 * WITHIN_M);
            assert!(calibration.of(Coordinate::X).is_estimated(), "{name}");
            assert!(calibration.of(Coordinate::Yaw).is_estimated(), "{name}");
            assert!(calibration.of(Coordinate::Z).is_held(), "{name}");
        }
    }
}

/// Nothing in an empty room faces sideways: the wall ahead determines x and yaw, and y stays as it was.
#[test]
fn one_wall_determines_x_and_yaw_and_the_report_says_so() {
    for seed in 1..=3 {
        let (calibration, truth) = calibrated(badly_mounted(Scenario::empty(SceneName::A, seed)));
        check(&format!("scene A, seed {seed}"), &calibration, &truth, WITHIN_M);
        assert!(calibration.of(Coordinate::X).is_estimated());
        assert!(calibration.of(Coordinate::Yaw).is_estimated());
        assert!(calibration.of(Coordinate::Y).is_held());
        assert!(calibration.of(Coordinate::Y).std_dev >= 0.019);
        let reasons = calibration.not_observable.join("; ");
        assert!(reasons.contains("y is not observable from this bag"), "{reasons}");
    }
}

#[test]
fn who_walks_through_does_not_matter() {
    for (object, path, seed) in [
        (CrossingObject::Person, PathName::C, 5),
        (CrossingObject::Robot, PathName::A, 6),
        (CrossingObject::Cart, PathName::B, 7),
    ] {
        let scenario = badly_mounted(Scenario::crossing(SceneName::F, object, path, seed));
        let name = scenario.name.clone();
        let (calibration, truth) = calibrated(scenario);
        check(&name, &calibration, &truth, 2.0 * WITHIN_M);
        assert!(calibration.of(Coordinate::Yaw).is_estimated(), "{name}");
        assert!(calibration.moving_returns > 0, "{name}");
    }
}

/// The rig's poses carry each return to the moment of the image.
#[test]
fn a_platform_that_moves_and_turns_may_be_calibrated_too() {
    for seed in 1..=2 {
        let scenario = badly_mounted(
            Scenario::empty(SceneName::F, seed).with_platform(Platform::Sway).with_duration_s(8.0),
        );
        let (calibration, truth) = calibrated(scenario);
        check(&format!("swaying, seed {seed}"), &calibration, &truth, 2.0 * WITHIN_M);
        assert!(calibration.of(Coordinate::Yaw).is_estimated());
    }
}

/// Over the seeds the squared error is as large as the covariance says: one for each coordinate.
#[test]
fn the_covariance_is_that_of_the_errors() {
    let (mut sum, mut coordinates) = (0.0, 0);
    for seed in 20..32 {
        let scenario = badly_mounted(corner(seed)).with_duration_s(5.0);
        let (calibration, truth) = calibrated(scenario);
        let (squared, count) = normalised_error_squared(&calibration, &truth);
        sum += squared;
        coordinates += count;
    }
    let mean = sum / f64::from(u32::try_from(coordinates).unwrap());
    println!("normalised error squared {mean:.2} a coordinate, of {coordinates}");
    // 1 +- 0.24 for 36 coordinates; errors that are held in z, roll and pitch add a little.
    assert!((0.3..2.2).contains(&mean), "{mean} a coordinate");
}

#[test]
fn what_was_right_stays_right() {
    let (calibration, truth) = calibrated(corner(3).with_depth_size(320, 240));
    assert!(truth.norm() < 1e-12);
    check("well mounted", &calibration, &truth, WITHIN_M);
}

/// The start may be as far off as a mounting by eye.
#[test]
fn three_degrees_and_five_centimetres_are_found() {
    let recording = Recording::of(&corner(4).with_depth_size(320, 240));
    let usual = usual_mounts();
    for (shift_m, yaw_rad) in [(0.05, 0.052), (-0.05, 0.052), (0.05, -0.052), (-0.08, -0.07)] {
        let correction = Vector6::new(shift_m, -shift_m, 0.0, 0.0, 0.0, yaw_rad);
        let start = usual.corrected(&correction);
        let calibration = recording.calibrate(&start).unwrap();
        let name = format!("from {shift_m} m and {yaw_rad} rad");
        check(&name, &calibration, &recording.true_correction(&start), WITHIN_M);
        assert!(calibration.of(Coordinate::Y).is_estimated(), "{name}");
        assert!(calibration.rms_before_m > 2.0 * calibration.rms_after_m, "{name}");
    }
}

/// A scanner of ten beams a degree in a room whose far wall the camera does not measure: the side walls, at a slant, and a pillar.
fn long_room() -> Recording {
    let mut scenario = Scenario::from_yaml(include_str!(
        "../../../laboratory/simulator/scenes/sensors/beams-3600.yaml"
    ))
    .unwrap()
    .with_duration_s(1.0);
    scenario.rig.path = Path::still([-0.6, 0.0, 0.7, 0.1, 0.0, 0.0]);
    Recording::of(&scenario)
}

/// Regression: what a calibration settled in was taken for the mount. From 4 degrees beside it found one 9.6 degrees off, to 0.3 degrees.
#[test]
fn of_the_headings_that_settle_the_one_with_the_most_returns_is_right() {
    let recording = long_room();
    for degrees in [-6.0_f64, 4.0, 8.0] {
        let turn = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, degrees.to_radians());
        let start = usual_mounts().corrected(&turn);
        let calibration = recording.calibrate(&start).unwrap();
        check(
            &format!("from {degrees} degrees"),
            &calibration,
            &recording.true_correction(&start),
            WITHIN_M,
        );
        let (agree, contradict) = (calibration.agreeing_returns, calibration.contradicting_returns);
        assert!(agree > 10 * contradict, "{agree} {contradict}");
    }
}

/// Regression: so was one from farther off than any heading reaches.
#[test]
fn from_too_far_off_there_is_no_mount_or_the_right_one() {
    let recording = long_room();
    for degrees in [10.0_f64, 11.0, 12.0, 13.0, 14.0, 15.0] {
        let turn = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, degrees.to_radians());
        let start = usual_mounts().corrected(&turn);
        let Ok(found) = recording.calibrate(&start) else { continue };
        let yaw = found.of(Coordinate::Yaw).correction;
        let off_rad = (yaw - recording.true_correction(&start)[5]).abs();
        assert!(off_rad < 2.0 * WITHIN_RAD, "from {degrees} degrees: {off_rad}");
    }
}

/// Regression: how much a plane may scatter was that of a Kinect, so that a stereo camera showed none beyond 2.6 m.
#[test]
fn a_stereo_camera_with_more_noise_than_a_kinect_is_calibrated_by() {
    let mut scenario = badly_mounted(corner(5)).with_duration_s(5.0);
    // A RealSense D435: 3.6 mm at 1 m.
    scenario.rig.depth_camera.disparity_noise_steps = 1.33;
    let (calibration, truth) = calibrated(scenario);
    check("stereo", &calibration, &truth, 2.0 * WITHIN_M);
    assert!(calibration.of(Coordinate::X).is_estimated());
    assert!(calibration.of(Coordinate::Yaw).is_estimated());
    let (planes, noisy) = (calibration.plane_returns, calibration.noisy_returns);
    assert!(noisy * 5 < planes, "{planes} planes, {noisy} too noisy");
}

/// Regression: a mount was taken however many of the returns contradict it.
#[test]
fn a_mount_that_returns_contradict_is_not_enough() {
    let of = |agree, contradict| Agreement { agree, contradict, noisy: 0 };
    // The mount 9.6 degrees off, and the right one of a tilted scanner.
    assert!(!of(367, 1165).is_enough());
    assert!(!of(0, 0).is_enough());
    assert!(of(2439, 490).is_enough());
}

#[test]
fn a_bag_without_information_is_refused_with_numbers() {
    let recording = Recording::of(
        &Scenario::empty(SceneName::A, 1).with_depth_size(160, 120).with_duration_s(3.0),
    );
    let mounts = usual_mounts();
    let config = CalibrationConfig::default();
    let optics = recording.eye.optics();
    let error = calibrate(&recording.cycles[..1], optics, &mounts, &config).unwrap_err();
    assert!(matches!(error, CalibrationError::TooFewReturns { needed: 100, .. }), "{error}");
    let none = calibrate(&[], optics, &mounts, &config).unwrap_err();
    assert!(none.to_string().starts_with("only 0 of 0 returns"), "{none}");
    let strict = CalibrationConfig { max_std_dev_m: 1e-9, max_std_dev_rad: 1e-9, ..config };
    let error = calibrate(&recording.cycles, optics, &mounts, &strict).unwrap_err();
    assert!(matches!(error, CalibrationError::NothingObservable { .. }), "{error}");
    let bad = CalibrationConfig { max_offset_m: 0.0, ..config };
    let error = calibrate(&recording.cycles, optics, &mounts, &bad).unwrap_err();
    assert!(error.to_string().contains("max_offset_m"), "{error}");
    let hasty = CalibrationConfig { max_iterations: 1, ..config };
    let off = mounts.corrected(&Vector6::new(0.1, 0.0, 0.0, 0.0, 0.0, 0.05));
    let error = calibrate(&recording.cycles, optics, &off, &hasty).unwrap_err();
    assert!(matches!(error, CalibrationError::NotSettled { iterations: 1, .. }), "{error}");
}

#[test]
fn the_same_cycles_give_the_same_calibration() {
    let scenario = badly_mounted(Scenario::empty(SceneName::B, 8)).with_duration_s(3.0);
    let recording = Recording::of(&scenario);
    let mounts = usual_mounts();
    assert_eq!(recording.calibrate(&mounts).unwrap(), recording.calibrate(&mounts).unwrap());
}
