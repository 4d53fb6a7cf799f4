use geometry::Stamp;

use super::super::alignment::Alignment;
use super::super::relative::DeltaUnit;
use super::super::segments::SegmentLengths;
use super::super::testing::{pose, raw, stamped, walk};
use super::*;

#[test]
fn an_estimate_in_another_frame_is_as_good_as_its_shape() {
    let truth = walk(200);
    let elsewhere = pose([5.0, -3.0, 1.0], [0.4, 0.1, -2.0]);
    let estimate: Vec<_> = truth.iter().map(|pose| elsewhere * pose).collect();
    let scored =
        score_trajectory(&stamped(&estimate), &stamped(&truth), &TrajectoryScoreConfig::default())
            .unwrap();
    let score = &scored.score;
    assert!(score.absolute.translation_m.max < 1e-12, "{score:?}");
    assert!(score.absolute.rotation_deg.unwrap().max < 1e-9);
    assert!((score.coverage.share - 1.0).abs() < 1e-12);
    assert_eq!((score.association.matched, score.association.estimate_left_out), (200, 0));
    for relative in &score.relative {
        assert!(relative.count > 50 && relative.translation_m.unwrap().max < 1e-11);
    }
    let unaligned = TrajectoryScoreConfig { alignment: Alignment::None, ..Default::default() };
    let scored = score_trajectory(&stamped(&estimate), &stamped(&truth), &unaligned).unwrap();
    assert!(scored.score.absolute.translation_m.rmse > 1.0);
    assert!(scored.score.relative[0].translation_m.unwrap().max < 1e-11);
}

/// Regression: the poses of a camera's optical axes against those of the robot that carries it had no ATE and a large RPE.
#[test]
fn a_camera_against_its_robot_has_no_relative_error() {
    let truth = walk(200);
    let score = |estimate: &[Isometry3<f64>], alignment| {
        let config = TrajectoryScoreConfig { alignment, ..Default::default() };
        score_trajectory(&stamped(estimate), &stamped(&truth), &config).unwrap().score
    };
    let robot_from_camera = pose([0.0; 3], [-1.2092, 1.2092, -1.2092]);
    let camera: Vec<_> = truth.iter().map(|pose| pose * robot_from_camera).collect();
    let of_camera = score(&camera, Alignment::Se3);
    assert!((of_camera.body_turn_deg.unwrap() - 120.0).abs() < 0.01, "{of_camera:?}");
    for relative in &of_camera.relative {
        assert!(relative.translation_m.unwrap().max < 1e-9, "{relative:?}");
        assert!(relative.rotation_deg.unwrap().max < 1e-6, "{relative:?}");
    }
    assert!(of_camera.segments.translation_percent.is_none_or(|percent| percent < 1e-9));
    // Of one body nothing is taken out, and a frame that is turned is no body that is.
    assert_eq!(score(&truth, Alignment::Se3).body_turn_deg, None);
    let level: Vec<_> = (0..200)
        .map(|index| pose([0.02 * f64::from(index), 0.0, 0.0], [0.0, 0.0, 0.05 * f64::from(index)]))
        .collect();
    let turned: Vec<_> = level.iter().map(|at| pose([0.0; 3], [0.0, 0.0, 1.0]) * at).collect();
    let config = TrajectoryScoreConfig { alignment: Alignment::None, ..Default::default() };
    let scored = score_trajectory(&stamped(&turned), &stamped(&level), &config).unwrap();
    assert_eq!(scored.score.body_turn_deg, None);
    assert!(scored.score.relative[0].translation_m.unwrap().max < 1e-9);
}

#[test]
fn one_camera_needs_its_scale() {
    let truth = walk(200);
    let mut estimate = truth.clone();
    for pose in &mut estimate {
        pose.translation.vector *= 0.4;
    }
    let score = |alignment| {
        let config = TrajectoryScoreConfig { alignment, ..Default::default() };
        score_trajectory(&stamped(&estimate), &stamped(&truth), &config).unwrap().score
    };
    let sim3 = score(Alignment::Sim3);
    assert!((sim3.alignment.scale - 2.5).abs() < 1e-12);
    assert!(sim3.absolute.translation_m.max < 1e-12);
    assert!(sim3.relative[1].translation_m.unwrap().max < 1e-11);
    assert!(score(Alignment::Se3).absolute.translation_m.rmse > 0.5);
}

#[test]
fn a_lost_tracker_has_small_errors_and_little_coverage() {
    let truth = walk(200);
    let score = score_trajectory(
        &stamped(&truth[..40]),
        &stamped(&truth),
        &TrajectoryScoreConfig::default(),
    )
    .unwrap()
    .score;
    assert!(score.absolute.translation_m.max < 1e-12);
    assert!((score.coverage.share - 39.0 / 199.0).abs() < 1e-9, "{:?}", score.coverage);
    assert_eq!(score.coverage.gap_count, 1);
}

#[test]
fn what_cannot_be_scored_says_why() {
    let config = TrajectoryScoreConfig::default();
    let truth = stamped(&walk(50));
    let score = |estimate: &Trajectory| {
        score_trajectory(estimate, &truth, &config).unwrap_err().to_string()
    };
    let nothing = Trajectory::stamped([]);
    assert!(score(&nothing).contains("the estimate has no poses"), "{}", score(&nothing));
    let frames = Trajectory::numbered(walk(50).iter().map(raw));
    assert!(score(&frames).contains("the reference has stamps"), "{}", score(&frames));
    let late = Trajectory::stamped(
        walk(5)
            .iter()
            .enumerate()
            .map(|(index, pose)| (Stamp::from_nanos(index as i64), raw(pose))),
    );
    let error = score(&late);
    assert!(error.contains("only 0 of 5 poses") && error.contains("from 100.000 s"), "{error}");
    let two = score(&stamped(&walk(2)));
    assert!(two.contains("only 2 of 2"), "{two}");
    let still = stamped(&[Isometry3::identity(); 50]);
    let sim3 = TrajectoryScoreConfig { alignment: Alignment::Sim3, ..config.clone() };
    let error = score_trajectory(&still, &truth, &sim3).unwrap_err();
    assert!(error.to_string().contains("does not move"), "{error}");
}

#[test]
fn numbers_of_no_use_are_named() {
    let refused = |change: fn(&mut TrajectoryScoreConfig)| {
        let mut config = TrajectoryScoreConfig::default();
        change(&mut config);
        config.validate().unwrap_err().to_string()
    };
    let delta = |value, unit| relative::Delta { value, unit };
    assert_eq!(
        refused(|config| config.max_gap_s = -1.0),
        "parameter max_gap_s must be 0 or more, not -1"
    );
    assert!(refused(|config| config.association.offset_s = f64::NAN).contains("offset_s"));
    assert!(refused(|config| config.segments.step_poses = 0).contains("step_poses"));
    let mut config = TrajectoryScoreConfig::default();
    config.relative.deltas = vec![delta(1.5, DeltaUnit::Frames)];
    assert!(config.validate().unwrap_err().to_string().contains("whole number"));
    config.relative.deltas = vec![delta(0.0, DeltaUnit::Metres)];
    assert!(config.validate().is_err());
    config.relative.deltas = vec![delta(1.5, DeltaUnit::Metres)];
    config.segments.lengths = SegmentLengths::Metres(vec![3.0, 0.0]);
    assert!(config.validate().unwrap_err().to_string().contains("segment length"));
}
