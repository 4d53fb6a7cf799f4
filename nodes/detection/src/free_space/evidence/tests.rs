use nalgebra::{Isometry3, Vector3};

use super::super::testing::{StaticPlatform, static_scan};
use super::*;

fn evidence() -> EvidenceGrid {
    EvidenceGrid::new(&FreeSpaceConfig::default(), 60.0)
}

/// Adds `cycles` scans with these ranges, from time `from_ms` on.
fn see(evidence: &mut EvidenceGrid, ranges_m: &[f32], from_ms: u32, cycles: u32) {
    let scan = static_scan(&StaticPlatform::default(), ranges_m);
    for cycle in 0..cycles {
        evidence.center_on(&scan.beams[0].origin_m);
        evidence.integrate(&scan, &[ReturnLabel::Background; 360], from_ms + cycle * 100);
    }
}

fn class(evidence: &EvidenceGrid, beam: usize, range_m: f32, now_ms: u32) -> ReturnClass {
    let mut ranges_m = vec![f32::INFINITY; 360];
    ranges_m[beam] = range_m;
    let scan = static_scan(&StaticPlatform::default(), &ranges_m);
    evidence.classify(&scan.beams[beam].hit.unwrap(), now_ms)
}

#[test]
fn returns_in_observed_free_space_are_moving_and_those_on_the_wall_are_not() {
    let mut evidence = evidence();
    let wall_m = vec![4.0_f32; 360];
    see(&mut evidence, &wall_m, 1, 2);
    // Two cycles are too few.
    assert_eq!(class(&evidence, 180, 2.0, 300), ReturnClass::Unknown);
    see(&mut evidence, &wall_m, 201, 10);
    for beam in 0..360 {
        for range_m in [0.3, 1.0, 2.0, 3.0, 3.6] {
            let class = class(&evidence, beam, range_m, 1300);
            assert!(
                matches!(class, ReturnClass::InFreeSpace { background_rate } if background_rate < 0.1),
                "{beam} {range_m}"
            );
        }
        assert_eq!(class(&evidence, beam, 4.0, 1300), ReturnClass::Background, "{beam}");
        for range_m in [3.9, 4.1] {
            let class = class(&evidence, beam, range_m, 1300);
            assert!(!matches!(class, ReturnClass::InFreeSpace { .. }), "{beam} {range_m}");
        }
        // Behind the wall nothing was observed.
        assert_eq!(class(&evidence, beam, 5.0, 1300), ReturnClass::Unknown);
    }
}

#[test]
fn a_beam_without_a_return_is_no_observation() {
    let mut evidence = evidence();
    let mut ranges_m = vec![4.0_f32; 360];
    ranges_m[170..190].fill(f32::INFINITY);
    see(&mut evidence, &ranges_m, 1, 20);
    assert_eq!(class(&evidence, 180, 2.0, 2100), ReturnClass::Unknown);
    assert!(matches!(class(&evidence, 150, 2.0, 2100), ReturnClass::InFreeSpace { .. }));
}

#[test]
fn space_closely_beside_an_object_is_not_certainly_free() {
    let mut evidence = evidence();
    let mut ranges_m = vec![4.0_f32; 360];
    ranges_m[175..185].fill(2.0);
    see(&mut evidence, &ranges_m, 1, 20);
    // The clear range of the first beam past the object ends before the object's depth.
    assert_eq!(class(&evidence, 185, 2.6, 2100), ReturnClass::Unknown);
    assert!(matches!(class(&evidence, 188, 2.6, 2100), ReturnClass::InFreeSpace { .. }));
}

#[test]
fn evidence_leaves_with_the_window_and_with_time() {
    let mut evidence = evidence();
    see(&mut evidence, &[4.0; 360], 1, 20);
    assert_eq!(class(&evidence, 180, 2.0, 130_000), ReturnClass::Unknown);
    evidence.center_on(&Point2::new(30.0, 0.0));
    evidence.center_on(&Point2::new(0.3, -0.2));
    assert_eq!(class(&evidence, 180, 2.0, 2100), ReturnClass::Unknown);
}

#[test]
fn behind_an_object_the_wall_is_known_where_it_was_seen() {
    let mut evidence = evidence();
    let mut ranges_m = vec![4.0_f32; 360];
    ranges_m[8..13].fill(f32::INFINITY);
    see(&mut evidence, &ranges_m, 1, 20);
    let object = static_scan(&StaticPlatform::default(), &[2.0; 360]);
    let behind_m = |beam: usize| {
        let beam = &object.beams[beam];
        evidence.background_behind_m(beam, &beam.hit.unwrap(), 2100)
    };
    for beam in (0..360).filter(|beam| beam % 10 == 5) {
        let behind_m = behind_m(beam).unwrap();
        assert!((behind_m - 4.0).abs() <= 0.1, "{beam}: {behind_m}");
    }
    assert_eq!(behind_m(10), None);
    let wall = static_scan(&StaticPlatform::default(), &[4.0; 360]);
    let beyond = evidence.background_behind_m(&wall.beams[5], &wall.beams[5].hit.unwrap(), 2100);
    assert_eq!(beyond, None);
}

#[test]
fn background_is_new_for_so_long() {
    let mut evidence = evidence();
    see(&mut evidence, &[4.0; 360], 1, 5);
    let scan = static_scan(&StaticPlatform::default(), &[4.0; 360]);
    let is_new = |now_ms| evidence.is_new_background(&scan.beams[180].hit.unwrap(), 1000, now_ms);
    assert_eq!([600, 1001, 1002].map(is_new), [true, true, false]);
}

/// Regression: before a robot or a hand that pitches, beams that dip hit tables and chests where level ones had passed: zones on what
/// stands, and a wall of a room that was lost from the map.
#[test]
fn what_is_seen_at_another_height_is_not_in_observed_free_space() {
    let mut evidence = evidence();
    see(&mut evidence, &[4.0; 360], 1, 20);
    let pitched = |pitch_rad: f64, range_m: f32| {
        let StaticPlatform { map_from_rig } = StaticPlatform::default();
        let pitch = Isometry3::rotation(Vector3::y() * pitch_rad);
        static_scan(&StaticPlatform { map_from_rig: map_from_rig * pitch }, &[range_m; 360])
    };
    let class = |evidence: &EvidenceGrid, scan: &DeskewedScan, beam: usize| {
        evidence.classify(&scan.beams[beam].hit.unwrap(), 2100)
    };
    // Ahead, a beam that dips by 6 degrees is 21 cm lower at 2 m; to the side it is not.
    let dips = pitched(0.105, 2.0);
    assert_eq!(class(&evidence, &dips, 180), ReturnClass::Unknown);
    assert!(matches!(class(&evidence, &dips, 90), ReturnClass::InFreeSpace { .. }));
    let hardly_dips = pitched(0.03, 2.0);
    assert!(matches!(class(&evidence, &hardly_dips, 180), ReturnClass::InFreeSpace { .. }));
    // A robot that stays so learns the space at that height.
    for cycle in 0..10 {
        evidence.integrate(&dips, &[ReturnLabel::Background; 360], 2100 + cycle * 100);
    }
    let class = class(&evidence, &pitched(0.105, 1.5), 180);
    assert!(matches!(class, ReturnClass::InFreeSpace { .. }), "{class:?}");
}
