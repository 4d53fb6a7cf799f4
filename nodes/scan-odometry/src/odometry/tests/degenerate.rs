//! Scenes whose walls do not determine the pose.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::*;
use crate::testing::{Post, Random, Scanner, World, follow};
use crate::{DegenerateDirection, MatchOutcome, ScanOdometry, ScanOdometryConfig};
use geometry::BeamOrder;

/// Along the corridor, at 0.5 m/s, the scanner turned by 0.3 rad.
fn driving(time_s: f64) -> Isometry2<f64> {
    Isometry2::new(Vector2::new(0.5 * time_s, 0.2), 0.3)
}

fn assert_along(found: &Found, azimuth_rad: f64) {
    let degenerate = &found.pose.quality.degenerate;
    let [DegenerateDirection::Along { azimuth_rad: at }] = degenerate[..] else {
        panic!("{degenerate:?}")
    };
    let off = (at - azimuth_rad).sin().abs();
    assert!(off < 0.1, "{degenerate:?} instead of {azimuth_rad}");
}

#[test]
fn the_axis_of_a_corridor_is_said_and_keeps_the_prediction() {
    // The ends are out of reach. For the first 2 m a cupboard determines the position along the corridor.
    let corridor = World::default().with_box([-50.0, -1.0], [50.0, 1.0]);
    let with_cupboard = corridor.clone().with_box([-2.0, -1.0], [-1.0, -0.5]);
    let scanner = Scanner { reach_m: 3.5, ..Scanner::full_turn(720) };
    let found = follow(&scanner, &with_cupboard, &driving, 150, 1);
    assert!(found[2..40].iter().all(|one| one.pose.quality.degenerate.is_empty()));
    // Observable directions stay right, and the others are extrapolated with the velocity: 5 m without any measurement.
    for one in &found[60..] {
        assert_along(one, -0.3);
        let off = driving(0.0).rotation * one.error().translation.vector;
        assert!(off.y.abs() < 0.01 && one.error().rotation.angle().abs() < 0.005, "{off}");
        assert!(off.x.abs() < 0.05 * 5.0, "{off}");
        let said_m = one.pose.covariance.m11.max(one.pose.covariance.m22).sqrt();
        assert!(said_m > off.x.abs() && said_m > 0.1, "{said_m} {off}");
        assert!(one.pose.step_covariance.m11.sqrt() < 0.2, "{}", one.pose.step_covariance);
    }
    println!("after 5 m without any measurement: {}", found[149].error());
    // Nothing ever determines the position along the corridor.
    let found = follow(&scanner, &corridor, &driving, 20, 1);
    for one in &found[1..] {
        assert_eq!(one.pose.quality.outcome, MatchOutcome::Matched);
        assert_along(one, -0.3);
    }
}

#[test]
fn a_corridor_with_its_end_in_view_is_not_degenerate() {
    let corridor = World::default().with_box([-20.0, -1.0], [9.0, 1.0]);
    let found = follow(&Scanner::default(), &corridor, &driving, 100, 1);
    assert!(found.iter().all(|one| one.pose.quality.degenerate.is_empty()));
    assert_within("towards the end", worst(&found), (0.02, 0.1));
}

#[test]
fn one_wall_determines_its_normal() {
    let wall = World { walls: vec![[[-50.0, 2.0].into(), [50.0, 2.0].into()]], ..World::default() };
    let scanner =
        Scanner { reach_m: 5.0, order: BeamOrder::FirstToLast, ..Scanner::full_turn(720) };
    let found = follow(&scanner, &wall, &driving, 20, 1);
    for one in &found[1..] {
        assert_along(one, -0.3);
    }
}

#[test]
fn the_middle_of_a_round_room_does_not_determine_rotation() {
    // A polygon of 64 sides: corners of less than 6 degrees.
    let corner = |index: usize| {
        let angle_rad = TAU * index as f64 / 64.0;
        nalgebra::Point2::new(3.0 * angle_rad.cos(), 3.0 * angle_rad.sin())
    };
    let world = World {
        walls: (0..64).map(|side| [corner(side), corner(side + 1)]).collect(),
        ..World::default()
    };
    let still = |_: f64| Isometry2::identity();
    let found = follow(&Scanner::full_turn(720), &world, &still, 20, 1);
    for one in &found[1..] {
        assert_eq!(one.pose.quality.degenerate, [DegenerateDirection::Turn]);
        assert!(one.error().translation.vector.norm() < 0.005);
    }
}

/// The platform's own posts, 0.3 m beside the scanner, go along with it.
fn own_posts(time_s: f64) -> Vec<Post> {
    [FRAC_PI_2, -FRAC_PI_2, 2.2]
        .map(|azimuth_rad| {
            let pose = driving(time_s);
            let place = Vector2::new(0.3 * azimuth_rad.cos(), 0.3 * azimuth_rad.sin());
            (nalgebra::Point2::from(pose.translation.vector + pose.rotation * place), 0.06)
        })
        .to_vec()
}

#[test]
fn the_platforms_own_body_does_not_hold_it() {
    // A cupboard every 4 m determines the position along the corridor, by fewer returns than the body has.
    let mut world = World::default().with_box([-50.0, -1.5], [50.0, 1.5]).with_walker(own_posts);
    for cupboard in -5..10 {
        let x = 4.0 * f64::from(cupboard);
        world = world.with_box([x, 1.0], [x + 0.6, 1.5]);
    }
    let scanner = Scanner::full_turn(720);
    let travelled_m = |body_radius_m: f64| {
        let config = ScanOdometryConfig {
            beam_order: scanner.order,
            body_radius_m,
            ..ScanOdometryConfig::default()
        };
        let mut odometry = ScanOdometry::new(config).unwrap();
        let mut random = Random::new(1);
        let poses =
            (0..200).map(|scan| odometry.step(&scanner.scan(&world, &driving, scan, &mut random)));
        poses.last().unwrap().odom_from_lidar.translation.vector.norm()
    };
    let (with_body, without) = (travelled_m(0.0), travelled_m(0.4));
    println!("{without} m, with the body {with_body} m, of 9.95 m");
    assert!((without - 0.5 * 19.9).abs() < 0.3, "{without}");
    assert!(with_body < 5.0, "the case is too easy: {with_body}");
}
