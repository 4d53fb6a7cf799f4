//! Drives whose truth is known, with an odometry that drifts.

#[cfg(feature = "ros")]
mod searching;

use std::sync::LazyLock;

use nalgebra::{UnitQuaternion, Vector3};

use super::*;
use crate::testing::{Random, Rectangle, apart, seen, threads};

const POINTS: usize = 5000;
/// What is farther away is not seen.
const SIGHT_M: f64 = 45.0;
const STEP_M: f64 = 2.0;

/// Ground, house fronts with recesses and cars along a straight piece of road; with houses that are all alike where
/// `period_m` is given.
fn road(
    from_m: [f64; 2],
    to_m: [f64; 2],
    period_m: Option<f64>,
    random: &mut Random,
) -> Vec<Rectangle> {
    let from = Vector3::new(from_m[0], from_m[1], -1.7);
    let whole = Vector3::new(to_m[0], to_m[1], -1.7) - from;
    let (length_m, along) = (whole.norm(), whole.normalize());
    let left = Vector3::z().cross(&along);
    let up = 6.0 * Vector3::z();
    let mut scene = Vec::new();
    let mut at_m = 0.0;
    while at_m < length_m {
        let piece_m = 10.0_f64.min(length_m - at_m);
        let corner_m = from + at_m * along - 8.0 * left;
        scene.push(Rectangle { corner_m, sides_m: [piece_m * along, 16.0 * left] });
        at_m += 10.0;
    }
    for side in [-1.0, 1.0] {
        let mut at_m = 0.0;
        while at_m < length_m {
            let front_m =
                period_m.unwrap_or_else(|| random.between(4.0, 11.0)).min(length_m - at_m);
            let deep_m = if period_m.is_some() { 8.0 } else { random.between(6.5, 9.5) };
            let corner_m = from + at_m * along + side * deep_m * left;
            scene.push(Rectangle { corner_m, sides_m: [front_m * along, up] });
            scene.push(Rectangle { corner_m, sides_m: [2.0 * side * left, up] });
            let car_m = corner_m - 3.0 * side * left + 0.2 * front_m * along;
            if period_m.is_some() || random.between(0.0, 1.0) < 0.5 {
                scene.push(Rectangle {
                    corner_m: car_m,
                    sides_m: [0.5 * front_m * along, 1.5 * Vector3::z()],
                });
            }
            at_m += front_m;
        }
    }
    scene
}

/// A place each two metres along straight lines, facing along.
fn way(corners_m: &[[f64; 2]]) -> Vec<Isometry3<f64>> {
    let mut poses = Vec::new();
    for pair in corners_m.windows(2) {
        let (from, to) =
            (Vector3::new(pair[0][0], pair[0][1], 0.0), Vector3::new(pair[1][0], pair[1][1], 0.0));
        let along = to - from;
        let turn = Vector3::z() * along.y.atan2(along.x);
        let steps = (along.norm() / STEP_M).round() as usize;
        poses.extend(
            (0..steps)
                .map(|step| Isometry3::new(from + step as f64 * STEP_M * along.normalize(), turn)),
        );
    }
    poses
}

/// The truth with what an odometry adds at each step: it goes too far, turns and climbs.
fn drifted(truth: &[Isometry3<f64>]) -> Vec<Isometry3<f64>> {
    let drift = Isometry3::from_parts(
        Vector3::new(0.015, 0.0, 0.006).into(),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, 0.0003)),
    );
    let mut poses = vec![truth[0]];
    for pair in truth.windows(2) {
        poses.push(poses[poses.len() - 1] * pair[0].inv_mul(&pair[1]) * drift);
    }
    poses
}

struct Drive {
    truth: Vec<Isometry3<f64>>,
    odometry: Vec<Isometry3<f64>>,
    scans: Vec<Vec<Point3<f32>>>,
}

impl Drive {
    fn new(scene: &[Rectangle], truth: Vec<Isometry3<f64>>) -> Self {
        let mut random = Random::new(9);
        let scan = |pose: &Isometry3<f64>| {
            let in_sight = |face: &&Rectangle| {
                let middle_m = face.corner_m + 0.5 * (face.sides_m[0] + face.sides_m[1]);
                (middle_m - pose.translation.vector).norm() < SIGHT_M
            };
            let faces: Vec<Rectangle> = scene.iter().filter(in_sight).copied().collect();
            seen(&faces, pose, POINTS, 0.02, &mut random)
        };
        let scans = truth.iter().map(scan).collect();
        Self { odometry: drifted(&truth), truth, scans }
    }

    /// Round a block, and thirty metres on.
    fn round_a_block() -> Self {
        let corners = [[0.0, 0.0], [80.0, 0.0], [80.0, 60.0], [0.0, 60.0]];
        let mut random = Random::new(4);
        let sides =
            (0..4).flat_map(|side| road(corners[side], corners[(side + 1) % 4], None, &mut random));
        let scene: Vec<Rectangle> = sides.collect();
        let truth =
            way(&[[20.0, 0.0], [80.0, 0.0], [80.0, 60.0], [0.0, 60.0], [0.0, 0.0], [50.0, 0.0]]);
        Self::new(&scene, truth)
    }

    fn stamp(number: usize) -> Stamp {
        Stamp::default().plus_seconds(number as f64)
    }

    fn driven(&self, config: LoopClosingConfig, count: usize) -> (LoopCloser, Vec<LoopOutcome>) {
        let mut closer = LoopCloser::new(config, Arc::new(threads(count))).unwrap();
        let outcomes = self
            .odometry
            .iter()
            .zip(&self.scans)
            .enumerate()
            .map(|(number, (pose, scan))| closer.take(Self::stamp(number), pose, scan));
        let outcomes = outcomes.collect();
        (closer, outcomes)
    }
}

/// Driven once for all tests.
static ROUND_A_BLOCK: LazyLock<(Drive, LoopCloser, Vec<LoopOutcome>)> = LazyLock::new(|| {
    let drive = Drive::round_a_block();
    let (closer, outcomes) = drive.driven(LoopClosingConfig::default(), 2);
    (drive, closer, outcomes)
});

fn closed(outcomes: &[LoopOutcome]) -> Vec<ClosedLoop> {
    let of = |outcome: &LoopOutcome| match outcome {
        LoopOutcome::Closed(closed) => Some(*closed),
        _ => None,
    };
    outcomes.iter().filter_map(of).collect()
}

#[test]
fn a_drive_round_a_block_comes_back_to_where_it_began() {
    let (drive, closer, outcomes) = &*ROUND_A_BLOCK;
    let loops = closed(outcomes);
    assert!(!loops.is_empty(), "{outcomes:?}");
    let last = drive.truth.len() - 1;
    assert!(loops[0].gap_m > 1.5 && loops[0].travelled_m > 250.0, "{loops:?}");
    assert_eq!(closer.known().closed, loops.len());
    // The poses between are better known by half at least, and best at both ends.
    let mean = |poses: &mut dyn Iterator<Item = Isometry3<f64>>| {
        let off = poses.zip(&drive.truth).map(|(pose, truth)| apart(&pose, truth).0);
        off.sum::<f64>() / drive.truth.len() as f64
    };
    let before_m = mean(&mut drive.odometry.iter().copied());
    let after_m =
        mean(&mut closer.known().keyframes.iter().map(|keyframe| keyframe.map_from_vehicle));
    assert!(after_m < 0.5 * before_m, "{before_m} {after_m}");
    // The odometry is left as it is, and the map says where its frame is; since the last loop it has drifted on.
    let (off_m, _) =
        apart(&(closer.known().map_from_odom * drive.odometry[last]), &drive.truth[last]);
    assert!(off_m < 0.5, "{off_m}");
}

#[test]
fn poses_between_keyframes_go_along_with_both() {
    let (drive, closer, _) = &*ROUND_A_BLOCK;
    let known = closer.known();
    let keyframes = &known.keyframes;
    for number in [10, 60, 120] {
        let motion = drive.truth[number].inv_mul(&drive.truth[number + 1]);
        let half = Isometry3::identity().lerp_slerp(&motion, 0.5);
        let stamp = Drive::stamp(number).plus_seconds(0.5);
        let there = known.map_from_vehicle(stamp, &(drive.odometry[number] * half));
        let (off_m, _) = apart(&there, &(drive.truth[number] * half));
        let beside = keyframes[number].map_from_vehicle;
        let (beside_m, _) = apart(&beside, &drive.truth[number]);
        assert!((off_m - beside_m).abs() < 0.05, "{number}: {off_m} {beside_m}");
    }
    // At the keyframes they are these; before the first and after the last one they go along with it.
    for keyframe in keyframes {
        let there = known.map_from_vehicle(keyframe.stamp, &keyframe.odom_from_vehicle);
        assert!(apart(&there, &keyframe.map_from_vehicle).0 < 1e-9);
    }
    let later = known.map_from_vehicle(Drive::stamp(9999), &drive.odometry[0]);
    assert!(apart(&later, &(known.map_from_odom * drive.odometry[0])).0 < 1e-9);
}

#[test]
fn a_street_whose_houses_are_all_alike_is_no_loop() {
    let scene = road([0.0, 0.0], [170.0, 0.0], Some(10.0), &mut Random::new(1));
    let drive = Drive::new(&scene, way(&[[30.0, 0.0], [140.0, 0.0]]));
    let (closer, outcomes) = drive.driven(LoopClosingConfig::default(), 2);
    assert!(outcomes.iter().all(|outcome| *outcome == LoopOutcome::NewPlace), "{outcomes:?}");
    assert_eq!(closer.known().map_from_odom, Isometry3::identity());
    // The drift decides: if the odometry may be anywhere, appearance alone is misleading or ambiguous.
    let blind = LoopClosingConfig { drift_m_per_km: 1000.0, ..LoopClosingConfig::default() };
    let mut closer = LoopCloser::new(blind, Arc::new(threads(2))).unwrap();
    let mut outcomes = drive
        .odometry
        .iter()
        .zip(&drive.scans)
        .enumerate()
        .map(|(number, (pose, scan))| closer.take(Drive::stamp(number), pose, scan));
    assert!(outcomes.any(|outcome| outcome != LoopOutcome::NewPlace));
}

#[test]
fn a_loop_along_houses_that_are_all_alike_is_closed_at_the_right_ones_or_not_at_all() {
    let mut scene = road([0.0, 0.0], [110.0, 0.0], Some(10.0), &mut Random::new(1));
    scene.extend(road([110.0, 0.0], [110.0, 30.0], None, &mut Random::new(2)));
    // There, round, and back along the other side of the same street.
    let drive = Drive::new(&scene, way(&[[10.0, -1.5], [100.0, -1.5], [100.0, 1.5], [40.0, 1.5]]));
    let (closer, outcomes) = drive.driven(LoopClosingConfig::default(), 2);
    // Beside the street all is clear; along it most is not.
    let ambiguous = |outcome: &&LoopOutcome| {
        matches!(outcome, LoopOutcome::Refused(NotALoop::Ambiguous { .. }))
    };
    assert!(outcomes.iter().filter(ambiguous).count() > 5, "{outcomes:?}");
    for (keyframe, truth) in closer.known().keyframes.iter().zip(&drive.truth) {
        // The next house is ten metres on.
        let (off_m, _) = apart(&keyframe.map_from_vehicle, truth);
        assert!(off_m < 4.0, "{off_m}");
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let (drive, two, outcomes) = &*ROUND_A_BLOCK;
    let (three, same) = drive.driven(LoopClosingConfig::default(), 3);
    assert_eq!(*outcomes, same);
    assert_eq!(two.known(), three.known());
}

#[test]
fn what_is_forgotten_is_no_loop_and_the_memory_is_bounded() {
    let (drive, ..) = &*ROUND_A_BLOCK;
    let config = LoopClosingConfig { max_keyframes: 40, ..LoopClosingConfig::default() };
    let (closer, outcomes) = drive.driven(config, 2);
    let keyframes = closer.known().keyframes;
    assert_eq!(keyframes.len(), 40);
    assert!(closed(&outcomes).is_empty());
    assert_eq!(keyframes[0].stamp, Drive::stamp(drive.truth.len() - 40));
}

#[test]
fn bad_scans_and_poses_harm_nothing() {
    let mut closer = LoopCloser::new(LoopClosingConfig::default(), Arc::new(threads(1))).unwrap();
    let nowhere = Isometry3::translation(f64::NAN, 0.0, 0.0);
    let stamp = Stamp::default();
    assert_eq!(closer.take(stamp, &nowhere, &[]), LoopOutcome::TooNear);
    let bad = [Point3::new(f32::NAN, 0.0, 0.0), Point3::new(f32::INFINITY, 1e30, 0.0)];
    for number in 0..200 {
        // Round and round on a circle of 10 m, with nothing to see.
        let angle = 0.3 * f64::from(number);
        let at = Isometry3::translation(10.0 * angle.cos(), 10.0 * angle.sin(), 0.0);
        let outcome = closer.take(stamp.plus_seconds(f64::from(number)), &at, &bad);
        assert_eq!(outcome, LoopOutcome::NewPlace);
    }
    assert_eq!(closer.known().map_from_odom, Isometry3::identity());
    closer.forget();
    assert_eq!(closer.known(), KnownLoops::default());
    let alone = Isometry3::translation(1.0, 2.0, 3.0);
    assert_eq!(closer.known().map_from_vehicle(stamp, &alone), alone);
}
