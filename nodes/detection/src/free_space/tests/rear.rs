use std::f64::consts::{PI, TAU};

use super::super::testing::{PERIOD_S, cuboid, room};
use super::world::{World, seen_from};
use crate::DetectionConfig;

/// Regression: with an aperture of a full turn what crossed the rear was a zone from -pi to pi.
#[test]
fn what_crosses_the_rear_has_a_zone_of_its_own_width() {
    let mut world =
        World::with(DetectionConfig { aperture_rad: TAU, ..DetectionConfig::default() }, 3);
    world.look(&room(), 20);
    let pose = nalgebra::Isometry3::identity();
    let (mut found, mut cycles, mut across) = (0, 0, 0);
    for cycle in 0..18_u32 {
        let person_m = [-1.2, 1.2 - f64::from(cycle) * PERIOD_S];
        let mut walls = room();
        walls.extend(cuboid(person_m, [0.3, 0.4]));
        let zones = world.step(&walls, &pose, &pose).cycle.zones;
        for zone in &zones {
            let width_rad = zone.azimuth_max_rad - zone.azimuth_min_rad;
            assert!((0.0..1.0).contains(&width_rad), "{person_m:?}: {zone:?}");
            assert!((-PI..=PI).contains(&zone.azimuth_min_rad), "{zone:?}");
        }
        let (azimuth_rad, _) = seen_from(&pose, person_m);
        cycles += 1;
        found += u32::from(zones.iter().any(|zone| zone.contains_azimuth(azimuth_rad)));
        across += u32::from(zones.iter().any(|zone| zone.azimuth_max_rad > PI));
    }
    assert!(
        found + 2 >= cycles && across > 2,
        "found in {found}, across the rear in {across} of {cycles}"
    );
}

/// Regression: the beams on either side of the rear of a person who stands across it were a zone each.
#[test]
fn who_is_across_the_rear_has_one_zone() {
    let mut world =
        World::with(DetectionConfig { aperture_rad: TAU, ..DetectionConfig::default() }, 3);
    world.look(&room(), 20);
    let mut found = 0;
    for cycle in 0..9_u32 {
        let person_m = [-1.5 + 0.6 * f64::from(cycle) * PERIOD_S, 0.0];
        let mut walls = room();
        walls.extend(cuboid(person_m, [0.3, 0.5]));
        let zones = world.step_static(&walls);
        assert!(zones.len() <= 1, "{person_m:?}: {zones:?}");
        found += u32::from(zones.iter().any(|zone| zone.azimuth_max_rad > PI));
    }
    assert!(found > 6, "{found}");
}
