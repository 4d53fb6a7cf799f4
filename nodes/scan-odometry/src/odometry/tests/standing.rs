//! A static platform.

use super::*;
use crate::MatchOutcome;
use crate::testing::{Post, Random, Scanner, World, follow, legs};

/// Crosses the room in 6 s, again and again.
fn along(time_s: f64) -> Vec<Post> {
    legs(-3.0 + time_s % 6.0, 1.0, time_s)
}

fn across(time_s: f64) -> Vec<Post> {
    legs(1.8, 2.4 - 0.7 * (time_s % 6.5), time_s)
}

/// Two people close enough to hide a third of the view, as wide as a trunk.
fn close(time_s: f64) -> Vec<Post> {
    let to_and_fro = 0.9 * (0.8 * time_s).sin();
    let at = |x: f64, y: f64| (nalgebra::Point2::new(0.5 + x, -0.3 + y), 0.3);
    vec![at(0.7, to_and_fro), at(-to_and_fro, 0.75)]
}

#[test]
fn does_not_drift() {
    let found = follow(&Scanner::default(), &World::furnished(), &standing, 300, 1);
    assert_within("standing", worst(&found), (0.005, 0.1));
    let late = found[0].pose.odom_from_lidar;
    assert_eq!(late, Isometry2::identity());
    assert!(found[1..].iter().all(|one| one.pose.quality.outcome == MatchOutcome::Matched));
    assert_within("the same, drift", drift(&found), (0.0003, 0.01));
}

/// What the mean of the last 100 scans differs by from that of 100 earlier ones.
fn drift(found: &[Found]) -> (f64, f64) {
    let mean = |part: &[Found]| {
        let sum: Vector2<f64> = part.iter().map(|one| one.error().translation.vector).sum();
        let turns: f64 = part.iter().map(|one| one.error().rotation.angle()).sum();
        Isometry2::new(sum / part.len() as f64, turns / part.len() as f64)
    };
    shift_and_turn(&mean(&found[50..150]).inv_mul(&mean(&found[200..])))
}

#[test]
fn does_not_drift_while_people_walk_through() {
    let world = World::furnished().with_walker(along).with_walker(across);
    let found = follow(&Scanner::default(), &world, &standing, 300, 1);
    assert_within("standing, two people", worst(&found), (0.005, 0.1));
}

#[test]
fn does_not_drift_while_people_hide_a_third_of_the_room() {
    let (scanner, empty) = (Scanner::default(), World::furnished());
    let crowded = empty.clone().with_walker(close);
    let ranges =
        |world: &World, scan| scanner.scan(world, &standing, scan, &mut Random::new(1)).ranges_m;
    let hidden_share = |scan| {
        let pairs = ranges(&empty, scan).into_iter().zip(ranges(&crowded, scan));
        pairs.filter(|(free, seen)| free - seen > 0.2).count() as f64 / 768.0
    };
    let shares: Vec<f64> = (0..300).map(hidden_share).collect();
    let (mean, most) =
        (shares.iter().sum::<f64>() / 300.0, shares.iter().copied().fold(0.0, f64::max));
    println!("hidden: {mean:.2} on average, {most:.2} at most");
    assert!(mean > 0.25 && most > 0.3, "{mean} {most}");
    let found = follow(&scanner, &crowded, &standing, 300, 1);
    // They hide a third of the first scan too, which all others are measured against.
    assert_within("standing, a third hidden", worst(&found), (0.015, 0.2));
    assert_within("the same, drift", drift(&found), (0.002, 0.05));
}

#[test]
fn the_same_scan_again_is_the_same_place() {
    for beams in [180, 360, 1440] {
        let scanner = Scanner::full_turn(beams);
        let mut odometry = scanner.odometry();
        let mut scan = scanner.scan(&World::furnished(), &standing, 0, &mut Random::new(1));
        for _ in 0..5 {
            let pose = odometry.step(&scan);
            scan.stamp = scan.stamp.plus_seconds(0.1);
            assert_within(
                &format!("{beams} beams"),
                shift_and_turn(&pose.odom_from_lidar),
                (0.002, 0.03),
            );
        }
    }
}
