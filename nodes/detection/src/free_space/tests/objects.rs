use std::f64::consts::FRAC_PI_4;

use geometry::{DynamicZone, PipelineConfig, ZoneSource};

use super::super::testing::{PERIOD_S, Wall, cuboid, room};
use super::world::{World, seen_from};
use crate::DetectionConfig;

const WIDTH_M: f64 = 0.4;

fn with_objects(centers: &[[f64; 2]]) -> Vec<Wall> {
    let mut walls = room();
    for center in centers {
        walls.extend(cuboid(*center, [WIDTH_M, WIDTH_M]));
    }
    walls
}

/// The bearings of a box's outermost corners, and the distance of its middle.
fn extent(center: [f64; 2]) -> (f64, f64, f64) {
    let half_m = 0.5 * WIDTH_M;
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
        .map(|[x, y]| [center[0] + x * half_m, center[1] + y * half_m]);
    let bearings = corners.map(|corner| seen_from(&nalgebra::Isometry3::identity(), corner).0);
    let least = bearings.into_iter().fold(f64::INFINITY, f64::min);
    let most = bearings.into_iter().fold(f64::NEG_INFINITY, f64::max);
    (least, most, seen_from(&nalgebra::Isometry3::identity(), center).1)
}

fn covers(zone: &DynamicZone, center: [f64; 2]) -> bool {
    let (right, left, distance_m) = extent(center);
    let span = zone.returns.unwrap();
    // The zone ends at the aperture of 90 degrees.
    zone.azimuth_min_rad <= right.max(-FRAC_PI_4)
        && zone.azimuth_max_rad >= left.min(FRAC_PI_4)
        && f64::from(span.nearest_m) < distance_m
        && f64::from(span.farthest_m) > distance_m - 0.4
        && f64::from(span.farthest_m) < distance_m + 0.4
}

#[test]
fn an_object_that_crosses_is_in_a_zone_in_every_cycle() {
    for speed in [0.98, 1.4] {
        for depth_m in [1.5, 2.5, 3.5] {
            for seed in 1..6 {
                let mut world = World::new(seed);
                world.look(&room(), 20);
                let reach_m = 0.75 * depth_m;
                let cycles = (2.0 * reach_m / (speed * PERIOD_S)) as u32;
                for cycle in 0..cycles {
                    let y = -reach_m + f64::from(cycle) * speed * PERIOD_S;
                    let zones = world.step_static(&with_objects(&[[depth_m, y]]));
                    assert!(
                        zones.len() == 1 && covers(&zones[0], [depth_m, y]),
                        "{speed} m/s at {depth_m} m, y {y}, seed {seed}: {zones:?}"
                    );
                    assert_eq!(zones[0].source, ZoneSource::Measured);
                }
                // It leaves: the background that it uncovers is no object.
                world.look(&room(), 20);
            }
        }
    }
}

#[test]
fn an_object_that_approaches_and_recedes_is_in_a_zone_in_every_cycle() {
    for seed in 1..4 {
        let mut world = World::new(seed);
        world.look(&room(), 20);
        for cycle in 0..40 {
            let gone_m = f64::from(cycle) * 1.4 * PERIOD_S;
            // A bow: from 2 m out to 4 m and back, from right to left.
            let x = 2.0 + 2.0 * (gone_m / 8.0 * std::f64::consts::PI).sin();
            let y = -1.2 + 0.3 * gone_m;
            let zones = world.step_static(&with_objects(&[[x, y]]));
            assert!(
                zones.len() == 1 && covers(&zones[0], [x, y]),
                "at {x} {y}, seed {seed}: {zones:?}"
            );
        }
    }
}

#[test]
fn several_objects_have_a_zone_each_and_crossing_ones_are_never_lost() {
    for seed in 1..6 {
        let mut world = World::new(seed);
        world.look(&room(), 30);
        for cycle in 0..28 {
            let gone_m = f64::from(cycle) * 1.0 * PERIOD_S;
            // Two move towards each other at two depths, the third one sways in front of them.
            let sway_m = 0.1 * (f64::from(cycle) * 0.7).sin();
            let centers = [[2.0, -1.2 + gone_m * 0.6], [3.6, 1.8 - gone_m], [1.4, 0.9 + sway_m]];
            let zones = world.step_static(&with_objects(&centers));
            let bearings = centers.map(extent);
            for (index, center) in centers.iter().enumerate() {
                let is_apart = bearings.iter().enumerate().all(|(other, bearing)| {
                    other == index
                        || bearing.0 > bearings[index].1 + 0.1
                        || bearing.1 < bearings[index].0 - 0.1
                });
                if is_apart {
                    let own = zones.iter().filter(|zone| covers(zone, *center)).count();
                    assert_eq!(own, 1, "{center:?} in cycle {cycle}, seed {seed}: {zones:?}");
                }
            }
            assert!(zones.is_sorted_by(|a, b| a.azimuth_min_rad <= b.azimuth_min_rad));
            // One may be hidden: its zone is held, or has ended.
            assert!((2..=3).contains(&zones.len()), "{zones:?}");
        }
    }
}

#[test]
fn an_object_that_stops_stays_until_it_is_background() {
    let pipeline = PipelineConfig { max_stop_s: 12.0, ..PipelineConfig::default() };
    let config = DetectionConfig { pipeline, ..DetectionConfig::default() };
    let mut world = World::with(config, 3);
    world.look(&room(), 20);
    let stands_at = [2.5, 0.2];
    for cycle in 0..8 {
        world.step_static(&with_objects(&[[2.5, -1.4 + 0.2 * f64::from(cycle)]]));
    }
    let cycles_of = |seconds: f64| (seconds / PERIOD_S) as u32;
    for cycle in 0..cycles_of(10.0) {
        let zones = world.step_static(&with_objects(&[stands_at]));
        assert!(zones.len() == 1 && covers(&zones[0], stands_at), "cycle {cycle}: {zones:?}");
    }
    for _ in 0..cycles_of(6.0) {
        world.step_static(&with_objects(&[stands_at]));
    }
    world.look(&with_objects(&[stands_at]), 50);
    // It moves on: its old place is not a zone, and it has one as soon as it is in observed free space.
    for cycle in 0..6 {
        let center = [2.5, 0.8 + 0.2 * f64::from(cycle)];
        let zones = world.step_static(&with_objects(&[center]));
        assert!(zones.len() == 1 && covers(&zones[0], center), "cycle {cycle}: {zones:?}");
    }
}

#[test]
fn an_object_present_from_the_start_is_background_and_leaves_no_zone() {
    for seed in 1..4 {
        let mut world = World::new(seed);
        world.look(&with_objects(&[[2.5, 0.0]]), 60);
        world.look(&room(), 100);
        // Its place becomes free space with time.
        let zones = (0..300).map(|_| world.step_static(&room())).last();
        assert_eq!(zones, Some(vec![]));
        let zones = world.step_static(&with_objects(&[[2.5, 0.0]]));
        assert!(zones.len() == 1 && covers(&zones[0], [2.5, 0.0]), "{zones:?}");
    }
}

#[test]
fn scans_without_returns_hold_the_zone_and_observed_free_space_ends_it() {
    let mut world = World::new(1);
    world.look(&room(), 20);
    let there = with_objects(&[[2.5, 0.0]]);
    assert_eq!(world.step_static(&there).len(), 1);
    let seeing = world.scanner;
    for cycles in 1..=7 {
        world.scanner.dropouts = 1.0;
        let zones = world.step_static(&there);
        assert_eq!(zones.len(), 1);
        assert_eq!(zones[0].source, ZoneSource::Held { cycles });
        assert!(covers(&zones[0], [2.5, 0.0]));
    }
    assert_eq!(world.step_static(&there), []);
    world.scanner = seeing;
    assert_eq!(world.step_static(&there)[0].source, ZoneSource::Measured);
    assert_eq!(world.step_static(&room()), []);
}

/// A black surface behind the path gives no returns: no free space is observed in front of it.
#[test]
fn an_object_is_tracked_in_front_of_a_surface_without_returns() {
    for seed in 1..6 {
        let mut world = World::new(seed);
        let mut step = |walls: &[Wall]| {
            let pose = nalgebra::Isometry3::identity();
            let mut scan = world.scanner.scan(walls, &pose, world.cycle, &mut world.dice);
            for range_m in &mut scan.ranges_m[172..182] {
                if *range_m > 4.0 {
                    *range_m = f32::INFINITY;
                }
            }
            world.step_with(&scan, &pose).cycle.zones
        };
        for _ in 0..20 {
            assert_eq!(step(&room()), []);
        }
        for cycle in 0..16 {
            let center = [2.5, -1.4 + 0.2 * f64::from(cycle)];
            let zones = step(&with_objects(&[center]));
            let (right, left, _) = extent(center);
            // Without evidence of its own a beam at the border may be missing.
            let is_followed = |zone: &DynamicZone| {
                zone.azimuth_min_rad <= right.max(-FRAC_PI_4) + 0.03
                    && zone.azimuth_max_rad >= left - 0.03
                    && zone.source == ZoneSource::Measured
            };
            assert!(
                zones.len() == 1 && is_followed(&zones[0]),
                "{center:?}, seed {seed}: {zones:?}"
            );
        }
        assert_eq!(step(&room()), []);
    }
}

#[test]
fn a_jump_of_the_pose_and_forgetting_start_the_evidence_anew() {
    let there = with_objects(&[[2.5, 0.0]]);
    let origin = nalgebra::Isometry3::identity();
    let elsewhere = nalgebra::Isometry3::translation(3.0, 0.0, 0.0);
    let mut world = World::new(1);
    world.look(&room(), 20);
    assert_eq!(world.step(&there, &origin, &elsewhere).cycle.zones, []);
    assert_eq!(world.step(&there, &origin, &elsewhere).cycle.zones, []);
    let mut world = World::new(1);
    world.look(&room(), 20);
    world.detector.forget();
    world.look(&there, 20);
}
