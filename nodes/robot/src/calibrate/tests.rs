use std::path::Path;

use clap::Parser;
use detection::shell::DetectionParameters;
use node_shell::parameters::{self, Assignment};
use simulator::{CrossingObject, PathName, Platform, Scenario, SceneName};

use super::*;
use crate::run::tf_bag;
use laboratory::write_bag;

#[derive(Parser)]
struct CommandLine {
    #[command(flatten)]
    args: CalibrateArgs,
}

fn args(bag: &Path, more: &[&str]) -> CalibrateArgs {
    let bag = bag.to_str().unwrap();
    let arguments = ["calibrate", bag].into_iter().chain(more.iter().copied());
    CommandLine::try_parse_from(arguments).unwrap().args
}

/// A bag of a scenario whose scanner is mounted badly, as small as tests need it.
fn bag(folder: &Path, scenario: Scenario) -> (PathBuf, [f64; 6]) {
    let mut scenario = scenario.with_mounting_error(0.03, 0.02).with_depth_size(320, 240);
    scenario.rig.depth_camera.rate_hz = 15.0;
    let path = folder.join("room.mcap");
    write_bag(&scenario, &path, &Default::default()).unwrap();
    (path, scenario.rig.lidar.rig_from_lidar)
}

fn found_in(parameters_file: &Path) -> [f64; 6] {
    let files = [parameters_file];
    let node: DetectionParameters =
        parameters::load("/robot/detection", &files, &[] as &[Assignment]).unwrap();
    node.config.pipeline.rig.rig_from_lidar
}

#[test]
fn a_bag_becomes_a_parameter_file_that_detection_loads() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = Scenario::crossing(SceneName::F, CrossingObject::Person, PathName::A, 3);
    let (bag, truth) = bag(folder.path(), scenario);
    let out = folder.path().join("extrinsics.yaml");
    let outcome = run(&args(&bag, &["-o", out.to_str().unwrap()])).unwrap();
    assert_eq!(outcome, Outcome::Complete);
    let found = found_in(&out);
    let off = |index: usize| (found[index] - truth[index]).abs();
    assert!(off(0) < 0.01 && off(1) < 0.01, "{found:?} {truth:?}");
    assert!(off(3) < 0.2_f64.to_radians(), "{found:?} {truth:?}");
    // Held: z, pitch and roll are the start's.
    assert!((found[2] + 0.05).abs() < 2e-3, "{found:?}");
    let text = std::fs::read_to_string(&out).unwrap();
    assert!(text.contains("z, roll and pitch are not observable from this bag"), "{text}");
    // The second time there is nothing to correct.
    let start = out.to_str().unwrap();
    let again = folder.path().join("again.yaml");
    run(&args(&bag, &["--params-file", start, "-o", again.to_str().unwrap(), "--json"])).unwrap();
    let found_again = found_in(&again);
    for (once, twice) in found.iter().zip(found_again) {
        assert!((once - twice).abs() < 1e-3, "{found:?} {found_again:?}");
    }
}

#[test]
fn a_platform_that_moves_is_calibrated_with_the_order_of_its_beams() {
    let folder = tempfile::tempdir().unwrap();
    let scenario =
        Scenario::empty(SceneName::F, 4).with_platform(Platform::Sway).with_duration_s(8.0);
    let (bag, truth) = bag(folder.path(), scenario);
    let order = folder.path().join("order.yaml");
    std::fs::write(&order, "/**/detection: {ros__parameters: {beam_order: last_to_first}}\n")
        .unwrap();
    let out = folder.path().join("out.yaml");
    let order = order.to_str().unwrap();
    run(&args(&bag, &["-o", out.to_str().unwrap(), "--params-file", order])).unwrap();
    let found = found_in(&out);
    assert!((found[0] - truth[0]).abs() < 0.01, "{found:?} {truth:?}");
    assert!((found[3] - truth[3]).abs() < 0.2_f64.to_radians(), "{found:?} {truth:?}");
}

#[test]
fn a_camera_file_replaces_the_calibration_of_the_bag() {
    let folder = tempfile::tempdir().unwrap();
    let (bag, _) = bag(folder.path(), Scenario::empty(SceneName::B, 2).with_duration_s(3.0));
    let file = folder.path().join("camera.yaml");
    let annex_2 = include_str!("../../../calibration/cameras/rec_hv_annex_2.yaml");
    std::fs::write(&file, annex_2).unwrap();
    let failure = run(&args(&bag, &["--camera-file", file.to_str().unwrap()])).unwrap_err();
    let text = failure.to_string();
    assert!(text.contains("320 x 240") && text.contains("640 x 480"), "{text}");
    std::fs::write(&file, annex_2.replace("plumb_bob", "fisheye")).unwrap();
    let failure = run(&args(&bag, &["--camera-file", file.to_str().unwrap()])).unwrap_err();
    assert!(failure.to_string().contains("fisheye"), "{failure}");
}

#[test]
fn a_bag_that_cannot_be_calibrated_is_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let missing = run(&args(&folder.path().join("none.mcap"), &[])).unwrap_err();
    assert!(missing.to_string().contains("none.mcap"), "{missing}");
    let (bag, _) = bag(folder.path(), Scenario::empty(SceneName::A, 2).with_duration_s(2.0));
    // A scanner that is thought to look backwards.
    let backwards = folder.path().join("backwards.yaml");
    let section =
        "/**: {ros__parameters: {rig_from_lidar: [0.0, 0.0, -0.05, 3.14159, 0.0, 0.0]}}\n";
    std::fs::write(&backwards, section).unwrap();
    let failure = run(&args(&bag, &["--params-file", backwards.to_str().unwrap()])).unwrap_err();
    assert!(failure.to_string().contains("yaw of pi"), "{failure}");
}

/// Regression: a calibration started from the parameters' mounts where these say that the mounts are those of tf.
#[test]
fn a_calibration_starts_from_the_mounts_of_tf_where_parameters_say_so() {
    use nalgebra::{Isometry3, Vector3};

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("robot.mcap");
    let base_from_camera =
        Isometry3::new(Vector3::new(0.2, 0.0, 0.8), Vector3::new(-1.2, 1.2, -1.2));
    let base_from_laser = Isometry3::new(Vector3::new(-0.3, 0.1, 0.4), Vector3::z() * 3.1);
    tf_bag::write(&path, &[("camera", base_from_camera), ("laser", base_from_laser)]);

    let bag = Bag::open(&path).unwrap();
    let mut topics = TopicArgs::default();
    topics.pose = Some("tf".to_owned());
    let inputs =
        Inputs::choose(&topics, &bag.info().unwrap(), &DetectionParameters::default()).unwrap();
    let start = |extrinsics: ExtrinsicsSource| {
        let rig_frame_id = "base_link".to_owned();
        let rig = RigConfig { extrinsics, rig_frame_id, ..RigConfig::default() };
        StartingMounts::of(&bag, &inputs, &rig).unwrap().mounts
    };
    let off_m = |one: &Isometry3<f64>, other: &Isometry3<f64>| {
        (one.inverse() * other).translation.vector.norm() + one.rotation.angle_to(&other.rotation)
    };
    assert_eq!(start(ExtrinsicsSource::Parameters), RigMounts::default());
    let by_tf = start(ExtrinsicsSource::TfFromRig);
    assert!(off_m(&by_tf.rig_from_camera, &base_from_camera) < 1e-9);
    assert!(off_m(&by_tf.rig_from_lidar, &base_from_laser) < 1e-9);
    let of_camera = start(ExtrinsicsSource::Tf);
    assert_eq!(of_camera.rig_from_camera, RigMounts::default().rig_from_camera);
    let camera_from_lidar = base_from_camera.inverse() * base_from_laser;
    let found = of_camera.rig_from_camera.inverse() * of_camera.rig_from_lidar;
    assert!(off_m(&found, &camera_from_lidar) < 1e-9);
}

/// Regression: the calibration of a robot whose head turns meanwhile took one transform for all of its cycles: it "did not settle", or wrote a
/// mount between both.
#[test]
fn a_calibration_over_which_a_joint_turns_is_refused_with_that_reason() {
    let folder = tempfile::tempdir().unwrap();
    let [bag, parameters] = joint_bag::write(folder.path(), [joint_bag::TURN_RAD, 0.0]);
    let failure =
        run(&args(&bag, &["--params-file", parameters.to_str().unwrap()])).unwrap_err().to_string();
    assert!(failure.contains("a joint moves the scanner relative to the camera"), "{failure}");
    let [bag, parameters] = joint_bag::write(folder.path(), [0.0; 2]);
    let still = run(&args(&bag, &["--params-file", parameters.to_str().unwrap()]));
    assert_eq!(still.unwrap(), Outcome::Complete);
}
