use super::super::testing::{StaticPlatform, static_scan};
use super::super::tracker::{Side, Sighting, Space};
use super::*;

const BEAMS: usize = 360;
const OBJECT: Range<usize> = 178..184;

fn scan_with(object_m: f32) -> DeskewedScan {
    let mut ranges_m = vec![4.0_f32; BEAMS];
    ranges_m[OBJECT].fill(object_m);
    static_scan(&StaticPlatform::default(), &ranges_m)
}

/// A tracked object with any history.
fn object() -> TrackedObject {
    TrackedObject::new(Sighting {
        now_ms: 1,
        centroid_m: Point2::origin(),
        ends_m: [Point2::origin(); 2],
        sides: [Side::Open; 2],
        platform_m: Point2::origin(),
        error_m: 0.0,
        returns: 6,
        space: Space::Free,
    })
}

/// For how many cycles a zone is held that was measured for `measured_cycles`, when all later returns there are
/// `then_m` away and of `class`.
fn held_cycles(
    measured_cycles: u32,
    platform_moves: bool,
    (then_m, class): (f32, ReturnClass),
) -> usize {
    let zone_maker = ZoneMaker::new(&DetectionConfig::default());
    let mut objects = [object()];
    let mut zones = |scan: &DeskewedScan, runs: &[MovingBeams], class: ReturnClass| {
        let classes: Vec<_> = scan.beams.iter().map(|beam| beam.hit.map(|_| class)).collect();
        let view = CycleView { scan, classes: &classes, within: &(0..BEAMS), platform_moves };
        zone_maker.zones(&view, runs, &mut objects, &vec![None; BEAMS])
    };
    for _ in 0..measured_cycles {
        let runs = [MovingBeams { beams: OBJECT, object: Some(0), has_travelled: true }];
        let class = ReturnClass::InFreeSpace { background_rate: 0.1 };
        assert_eq!(zones(&scan_with(2.0), &runs, class).len(), 1);
    }
    (0..20).take_while(|_| zones(&scan_with(then_m), &[], class).len() == 1).count()
}

const NOTHING: (f32, ReturnClass) = (f32::INFINITY, ReturnClass::Unknown);

/// Regression: a moving robot hit a chair now and then, and had a zone for a second each time.
#[test]
fn on_a_moving_platform_a_zone_is_held_no_longer_than_it_was_measured() {
    let most = DetectionConfig::default().max_held_cycles;
    for measured_cycles in [1, 3, most, most + 5] {
        let held = held_cycles(measured_cycles, true, NOTHING);
        assert_eq!(held, measured_cycles.min(most) as usize, "measured in {measured_cycles}");
        assert_eq!(held_cycles(measured_cycles, false, NOTHING), most as usize);
    }
}

/// Regression: background kept the zone of an earlier object as long as it was visible.
#[test]
fn on_a_moving_platform_a_zone_ends_when_background_is_hit_at_its_place() {
    let held = |platform_moves, seen| held_cycles(4, platform_moves, seen);
    assert_eq!(held(true, (2.05, ReturnClass::Background)), 0);
    // A hidden object, or one without evidence, may still be there.
    assert_eq!(held(true, (1.0, ReturnClass::Background)), 4);
    assert_eq!(held(true, (2.05, ReturnClass::Ambiguous)), 4);
    // On a static platform the object may be a foot at rest beside the wall.
    assert_eq!(held(false, (2.05, ReturnClass::Background)), 7);
    assert_eq!(held(false, (4.0, ReturnClass::Background)), 0);
}

/// Two runs of beams of one object are two zones, and one zone while it is not visible.
#[test]
fn the_runs_of_one_object_are_held_as_one_zone() {
    let zone_maker = ZoneMaker::new(&DetectionConfig::default());
    let mut objects = [object()];
    let scan = scan_with(2.0);
    let classes = vec![None; BEAMS];
    let view =
        CycleView { scan: &scan, classes: &classes, within: &(0..BEAMS), platform_moves: false };
    let part = |beams| MovingBeams { beams, object: Some(0), has_travelled: true };
    let std_dev_m = vec![None; BEAMS];
    let runs = [part(178..180), part(182..184)];
    let measured = zone_maker.zones(&view, &runs, &mut objects, &std_dev_m);
    assert_eq!(measured.len(), 2);
    let held = zone_maker.zones(&view, &[], &mut objects, &std_dev_m);
    assert_eq!(held.len(), 1);
    assert!(held[0].azimuth_min_rad <= measured[0].azimuth_min_rad + 1e-6);
    assert!(held[0].azimuth_max_rad >= measured[1].azimuth_max_rad - 1e-6);
}

/// Regression: between the legs of a person before the robot a beam hit the end of the corridor 11 m away. All that the
/// camera saw behind the person was then within the ranges of the zone, and the walls were removed with the person.
#[test]
fn a_beam_between_the_legs_does_not_extend_the_ranges_of_the_zone() {
    let zone_maker = ZoneMaker::new(&DetectionConfig::default());
    let mut ranges_m = vec![11.0_f32; BEAMS];
    ranges_m[OBJECT].fill(1.4);
    ranges_m[OBJECT.start + 2] = 11.0;
    ranges_m[OBJECT.end - 1] = 1.5;
    let scan = static_scan(&StaticPlatform::default(), &ranges_m);
    let view = CycleView { scan: &scan, classes: &[], within: &(0..BEAMS), platform_moves: false };
    let runs = [MovingBeams { beams: OBJECT, object: Some(0), has_travelled: true }];
    let zones = zone_maker.zones(&view, &runs, &mut [object()], &vec![None; BEAMS]);
    assert_eq!(zones.len(), 1);
    let returns = zones[0].returns.unwrap();
    assert!((returns.nearest_m - 1.4).abs() < 1e-3, "{returns:?}");
    assert!((returns.farthest_m - 1.5).abs() < 1e-3, "{returns:?}");
}
