use geometry::Stamp;
use nalgebra::Isometry3;
use proptest::prelude::*;

use super::super::testing::{pose, walk};
use super::pairs::stretches;
use super::*;

/// A drive along x at ten poses a second.
fn along(x_m: &[f64]) -> Vec<MatchedPose> {
    matched(x_m.iter().map(|&x_m| Isometry3::translation(x_m, 0.0, 0.0)))
}

/// Poses whose estimate is the reference.
fn matched(poses: impl IntoIterator<Item = Isometry3<f64>>) -> Vec<MatchedPose> {
    let pair = |(index, pose): (usize, Isometry3<f64>)| {
        let stamp = Stamp::from_nanos(index as i64 * 100_000_000);
        MatchedPose::new(Some(stamp), index as f64 * 0.1, pose, pose)
    };
    poses.into_iter().enumerate().map(pair).collect()
}

fn config(pairs: Pairs, tolerance: f64) -> RelativeConfig {
    RelativeConfig { pairs, tolerance, ..RelativeConfig::default() }
}

fn delta(value: f64, unit: DeltaUnit) -> Delta {
    Delta { value, unit }
}

/// The steps of a path; the expected stretches are those of evo 1.38.1.
const STEPS_M: [f64; 15] =
    [0.3, 0.5, 0.2, 0.9, 0.4, 0.05, 0.6, 1.3, 0.31, 0.47, 0.23, 0.71, 0.12, 0.5, 0.8];

fn sums(steps: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let rest = steps.iter().map(|step| {
        sum += step;
        sum
    });
    std::iter::once(0.0).chain(rest).collect()
}

#[test]
fn stretches_of_metres_end_as_evo_ends_them() {
    let poses = along(&sums(&STEPS_M));
    let metres = |value, pairs, tolerance| {
        stretches(&poses, delta(value, DeltaUnit::Metres), &config(pairs, tolerance)).unwrap()
    };
    assert_eq!(metres(1.0, Pairs::Consecutive, 0.1), [(0, 3), (3, 5), (5, 8), (8, 11), (11, 14)]);
    assert_eq!(
        metres(0.5, Pairs::Consecutive, 0.1),
        [(0, 2), (2, 4), (4, 7), (7, 8), (8, 10), (10, 12), (12, 14), (14, 15)]
    );
    // Stretches that evo leaves out or includes by rounding are exactly at the tolerance; slightly less is unambiguous.
    assert_eq!(metres(1.0, Pairs::All, 0.099), [(0, 3), (4, 7), (8, 11), (10, 12)]);
    let wider = [(0, 3), (2, 4), (3, 4), (4, 7), (8, 11), (10, 12), (11, 13), (14, 15)];
    assert_eq!(metres(1.0, Pairs::All, 0.299), wider);
}

#[test]
fn stretches_of_degrees_end_as_evo_ends_them() {
    let steps_deg = [3.0, 5.0, 2.0, 9.0, 4.0, 0.5, 6.0, 13.0, 3.1, 4.7, -2.3, -7.1, 1.2, 5.0, 8.0];
    let poses = matched(
        sums(&steps_deg)
            .into_iter()
            .map(|turn_deg: f64| pose([0.0; 3], [0.0, 0.0, turn_deg.to_radians()])),
    );
    let degrees = |pairs, tolerance| {
        stretches(&poses, delta(10.0, DeltaUnit::Degrees), &config(pairs, tolerance)).unwrap()
    };
    let expected = [(0, 3), (3, 5), (5, 8), (8, 11), (11, 14)];
    // The sum of the first three is 10 but for rounding.
    let found =
        stretches(&poses, delta(9.999, DeltaUnit::Degrees), &config(Pairs::Consecutive, 0.1));
    assert_eq!(found.unwrap(), expected);
    assert_eq!(degrees(Pairs::All, 0.0999), [(0, 3), (4, 7), (9, 15), (10, 12)]);
    let wider = [
        (0, 2),
        (0, 3),
        (2, 4),
        (3, 4),
        (4, 7),
        (7, 12),
        (7, 13),
        (8, 10),
        (8, 15),
        (9, 15),
        (10, 12),
        (10, 13),
        (11, 12),
        (11, 15),
        (14, 15),
    ];
    // (1, 3) is exactly at the tolerance.
    assert_eq!(degrees(Pairs::All, 0.2999), wider);
}

#[test]
fn stretches_of_frames_are_counted() {
    let poses = along(&sums(&STEPS_M));
    let frames =
        |pairs| stretches(&poses, delta(6.0, DeltaUnit::Frames), &config(pairs, 0.1)).unwrap();
    assert_eq!(frames(Pairs::Consecutive), [(0, 6), (6, 12)]);
    assert_eq!(frames(Pairs::All).len(), 10);
    assert_eq!(frames(Pairs::All)[9], (9, 15));
}

#[test]
fn stretches_of_seconds_pass_over_gaps() {
    let mut poses = along(&[0.0; 40]);
    // There are no poses from 1.5 s to 2.5 s.
    poses.retain(|pose| !(1.45..2.45).contains(&pose.at));
    let seconds =
        |pairs| stretches(&poses, delta(1.0, DeltaUnit::Seconds), &config(pairs, 0.05)).unwrap();
    let times_s = |stretches: Vec<(usize, usize)>| -> Vec<(f64, f64)> {
        stretches.into_iter().map(|(from, to)| (poses[from].at, poses[to].at)).collect()
    };
    let near = |found: Vec<(f64, f64)>, expected: &[(f64, f64)]| {
        assert_eq!(found.len(), expected.len(), "{found:?}");
        for ((from, to), (wanted_from, wanted_to)) in found.iter().zip(expected) {
            assert!((from - wanted_from).abs() + (to - wanted_to).abs() < 1e-9, "{found:?}");
        }
    };
    near(times_s(seconds(Pairs::Consecutive)), &[(0.0, 1.0), (2.5, 3.5)]);
    assert_eq!(seconds(Pairs::All).len(), 5 + 5);
    for pose in &mut poses {
        pose.stamp = None;
    }
    let none = stretches(&poses, delta(1.0, DeltaUnit::Seconds), &config(Pairs::All, 0.05));
    assert_eq!(none.unwrap(), []);
}

#[test]
fn a_drift_of_one_in_a_hundred_is_a_centimetre_a_metre() {
    let mut poses = along(&sums(&[0.1; 100]));
    for pose in &mut poses {
        pose.estimate.translation.vector *= 1.01;
    }
    // Half of a step, so that no stretch of nine steps counts as one of ten.
    let scores = scores(&poses, &config(Pairs::All, 0.05)).unwrap();
    for score in scores {
        let errors_m = score.translation_m.unwrap();
        assert_eq!(score.count, 91, "{score:?}");
        assert!((errors_m.rmse - 0.01).abs() < 1e-9 && errors_m.std < 1e-9, "{errors_m:?}");
        assert!(score.rotation_deg.unwrap().max < 1e-6);
    }
}

#[test]
fn the_error_does_not_depend_on_where_the_frames_lie() {
    let (one, other) =
        (pose([4.0, 5.0, 6.0], [0.1, 0.2, 0.3]), pose([-9.0, 0.0, 2.0], [1.0, 0.0, 0.4]));
    for (index, pose) in walk(30).iter().enumerate() {
        let pair = MatchedPose::new(None, index as f64, one * pose, other * pose);
        let first = MatchedPose::new(None, 0.0, one, other);
        let error = relative_error(&first, &pair);
        assert!(error.translation.vector.norm() < 1e-12 && error.rotation.angle() < 1e-12);
    }
}

proptest! {
    #[test]
    fn all_pairs_of_metres_are_those_of_a_search_over_all(
        steps_m in proptest::collection::vec(prop_oneof![Just(0.0), 0.0..0.5_f64], 1..60),
        tolerance in 0.01..0.5_f64,
    ) {
        let path_m = sums(&steps_m);
        let found = stretches(&along(&path_m), delta(1.0, DeltaUnit::Metres), &config(Pairs::All, tolerance));
        let off_m = |from: usize, to: usize| (path_m[to] - (path_m[from] + 1.0)).abs();
        let plain: Vec<(usize, usize)> = (0..path_m.len())
            .filter_map(|from| {
                let to = (from + 1..path_m.len())
                    .min_by(|one, other| off_m(from, *one).total_cmp(&off_m(from, *other)))?;
                (off_m(from, to) <= tolerance).then_some((from, to))
            })
            .collect();
        prop_assert_eq!(found.unwrap(), plain);
    }
}
