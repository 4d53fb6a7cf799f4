//! Scans that show nothing, or something else.

use geometry::Scan;

use super::*;
use crate::testing::{Random, Scanner, World};
use crate::{MatchOutcome, Refusal, ScanOdometry, ScanPose};

struct Run {
    scanner: Scanner,
    odometry: ScanOdometry,
    random: Random,
}

impl Run {
    fn new() -> Self {
        let scanner = Scanner::default();
        Self { odometry: scanner.odometry(), scanner, random: Random::new(1) }
    }

    fn scan(&mut self, world: &World, scan: usize) -> Scan {
        self.scanner.scan(world, &circling, scan, &mut self.random)
    }

    fn step(&mut self, world: &World, scan: usize) -> ScanPose {
        let scan = self.scan(world, scan);
        self.odometry.step(&scan)
    }

    fn error(&self, pose: &ScanPose, scan: usize) -> (f64, f64) {
        let start = circling(self.scanner.middle_s(0));
        let truth = start.inv_mul(&circling(self.scanner.middle_s(scan)));
        shift_and_turn(&truth.inv_mul(&pose.odom_from_lidar))
    }
}

#[test]
fn a_blind_moment_keeps_the_velocity() {
    let mut run = Run::new();
    let room = World::furnished();
    for scan in 0..20 {
        run.step(&room, scan);
    }
    let seen = run.step(&room, 20);
    for scan in 21..26 {
        let pose = run.step(&World::default(), scan);
        let expected = Refusal::FewReturns { returns: 0, needed: 20 };
        assert_eq!(pose.quality.outcome, MatchOutcome::Held(expected));
        assert!(!pose.is_measured());
        assert!(pose.covariance.m11 > seen.covariance.m11);
        assert_within("blind", run.error(&pose, scan), (0.05, 3.0));
    }
    let pose = run.step(&room, 26);
    assert_eq!(pose.quality.outcome, MatchOutcome::Matched);
    assert_within("seeing again", run.error(&pose, 26), (0.02, 0.2));
}

#[test]
fn after_a_second_of_blindness_it_stands_until_it_sees_something_new() {
    let mut run = Run::new();
    let room = World::furnished();
    for scan in 0..20 {
        run.step(&room, scan);
    }
    let blind: Vec<ScanPose> = (20..50).map(|scan| run.step(&World::default(), scan)).collect();
    assert_eq!(blind[29].odom_from_lidar, blind[15].odom_from_lidar);
    assert!(blind[29].covariance.m11.sqrt() > 0.5);
    // Another room: the map begins anew at the predicted pose.
    let other = World::default().with_box([-1.5, -2.5], [7.0, 1.5]);
    let begun = run.step(&other, 50);
    assert!(matches!(begun.quality.outcome, MatchOutcome::BegunAnew(_)), "{:?}", begun.quality);
    let after: Vec<ScanPose> = (51..60).map(|scan| run.step(&other, scan)).collect();
    assert!(after.iter().all(|pose| pose.quality.outcome == MatchOutcome::Matched));
    let moved = begun.odom_from_lidar.inv_mul(&after[8].odom_from_lidar);
    let truth = circling(run.scanner.middle_s(50)).inv_mul(&circling(run.scanner.middle_s(59)));
    assert_within("in the other room", shift_and_turn(&truth.inv_mul(&moved)), (0.03, 0.5));
}

/// Regression: when the map began anew, the first scan of all was kept. The scan after next was then matched against a map of that,
/// in vain, and its lines were looked for in it: an index out of bounds.
#[test]
fn what_the_first_scan_alone_showed_is_no_part_of_a_map_that_begins_anew() {
    let mut run = Run::new();
    let crate_around = World::default().with_box([-0.6, -1.6], [0.62, -0.4]);
    run.step(&crate_around, 0);
    let room = World::furnished();
    let outcomes: Vec<_> = (1..30).map(|scan| run.step(&room, scan).quality.outcome).collect();
    assert!(outcomes.iter().any(|outcome| matches!(outcome, MatchOutcome::BegunAnew(_))));
    assert_eq!(outcomes.last(), Some(&MatchOutcome::Matched));
    let lines = run.odometry.map.lines().len();
    assert!(lines > 20, "{lines} lines");
}

#[test]
fn a_knock_is_found_by_search() {
    let (scanner, room) = (Scanner::default(), World::furnished());
    let mut random = Random::new(1);
    let mut odometry = scanner.odometry();
    let knocked = |time_s: f64| {
        if time_s < 1.0 { standing(0.0) } else { Isometry2::new(Vector2::new(0.75, -0.1), 0.7) }
    };
    let poses: Vec<ScanPose> = (0..20)
        .map(|scan| odometry.step(&scanner.scan(&room, &knocked, scan, &mut random)))
        .collect();
    let truth = standing(0.0).inv_mul(&knocked(2.0));
    let found = poses[19].odom_from_lidar;
    assert_within("knocked", shift_and_turn(&truth.inv_mul(&found)), (0.01, 0.2));
}

#[test]
fn a_first_scan_without_returns_is_not_the_start() {
    let mut run = Run::new();
    let pose = run.step(&World::default(), 0);
    assert!(matches!(pose.quality.outcome, MatchOutcome::Held(Refusal::FewReturns { .. })));
    assert_eq!(pose.odom_from_lidar, Isometry2::identity());
    let pose = run.step(&World::furnished(), 1);
    assert_eq!(pose.quality.outcome, MatchOutcome::Started);
    assert_eq!(pose.odom_from_lidar, Isometry2::identity());
    assert!(pose.quality.map_lines > 100);
}

#[test]
fn stamps_that_do_not_grow_are_refused_and_a_jump_of_the_clock_is_not() {
    let mut run = Run::new();
    let room = World::furnished();
    for scan in 0..10 {
        run.step(&room, scan);
    }
    let last = run.step(&room, 10);
    let mut again = run.scan(&room, 10);
    let pose = run.odometry.step(&again);
    assert_eq!(pose.quality.outcome, MatchOutcome::Held(Refusal::NotLater { by_s: 0.0 }));
    assert_eq!(pose.odom_from_lidar, last.odom_from_lidar);
    again.stamp = again.stamp.plus_seconds(-1000.0);
    let pose = run.odometry.step(&again);
    assert_eq!(pose.quality.outcome, MatchOutcome::Matched);
    assert_within(
        "after the jump",
        shift_and_turn(&last.odom_from_lidar.inv_mul(&pose.odom_from_lidar)),
        (0.03, 0.2),
    );
    run.odometry.forget();
    let pose = run.odometry.step(&again);
    assert_eq!(pose.quality.outcome, MatchOutcome::Started);
    assert_eq!(pose.odom_from_lidar, Isometry2::identity());
}
