//! Objects in free space, on a moving platform.

use super::*;

/// The evidence in each scan of a person at `place_m(time_s)` in free space, from a platform at `platform_m(time_s)`.
fn shown(
    scans: usize,
    is_in_clutter: bool,
    platform_m: impl Fn(f64) -> [f64; 2],
    place_m: impl Fn(f64) -> [f64; 2],
) -> Vec<MotionEvidence> {
    let mut tracker = Tracker::default();
    let evidence = |index: usize| {
        let time_s = index as f64 * PERIOD_S;
        let place_m = place_m(time_s);
        let scan = scan_in(&with_person(place_m), platform_m(time_s), index as u64);
        evidence_in(&mut tracker, &scan, &beams_on(&scan, place_m), is_in_clutter, stamp_ms(index))
    };
    (0..scans).map(evidence).collect()
}

/// The evidence of the run of a scan, the only one in free space.
fn evidence_in(
    tracker: &mut Tracker,
    scan: &DeskewedScan,
    run: &Range<usize>,
    is_in_clutter: bool,
    now_ms: u32,
) -> MotionEvidence {
    let classes: Vec<Option<ReturnClass>> =
        scan.beams.iter().map(|beam| beam.hit.map(|_| ReturnClass::Background)).collect();
    tracker.update(scan, &classes, std::slice::from_ref(run), now_ms, true);
    let object = tracker.object(tracker.object_of(run).unwrap()).unwrap();
    motion_evidence(object, scan, run, || is_in_clutter)
}

fn at_origin(_: f64) -> [f64; 2] {
    [0.0, 0.0]
}

#[test]
fn in_empty_space_it_counts_at_once_and_becomes_background_without_travel() {
    let evidence = shown(30, false, at_origin, |_| [2.0, 0.4]);
    let doubt_scans = (f64::from(LONGEST_DOUBT_MS) * 1e-3 / PERIOD_S) as usize;
    assert_eq!(evidence[..=doubt_scans], vec![MotionEvidence::InEmptySpace; doubt_scans + 1]);
    let later = &evidence[doubt_scans + 1..];
    assert!(later.iter().all(|evidence| *evidence == MotionEvidence::Insufficient), "{later:?}");
}

#[test]
fn in_clutter_it_counts_once_it_has_travelled_and_then_also_at_rest() {
    let walk = |time_s: f64| [1.5 + 1.2 * time_s.min(1.5), 0.4];
    let evidence = shown(40, true, at_origin, walk);
    let before = &evidence[..LEAST_SIGHTINGS - 1];
    assert_eq!(before, [MotionEvidence::Insufficient; LEAST_SIGHTINGS - 1]);
    let after = &evidence[LEAST_SIGHTINGS..];
    assert!(after.iter().all(|evidence| *evidence == MotionEvidence::Travelled), "{after:?}");
}

/// Regression: chairs that a robot passed had zones for a minute.
#[test]
fn a_static_object_does_not_travel_when_the_platform_passes() {
    let by = |time_s: f64| [0.8 * time_s - 1.0, -1.2];
    let evidence = shown(30, true, by, |_| [2.0, 0.4]);
    assert_eq!(evidence, [MotionEvidence::Insufficient; 30]);
}

#[test]
fn a_swaying_object_does_not_travel() {
    let evidence = shown(40, true, at_origin, |time_s| [2.0 + 0.12 * (9.0 * time_s).sin(), 0.4]);
    assert_eq!(evidence, [MotionEvidence::Insufficient; 40]);
}

/// Regression: a nodding scanner hit different parts of a ramp, and the leap from the first part to the second was taken for
/// motion.
#[test]
fn a_single_leap_is_not_travel() {
    let leap = |time_s: f64| [if time_s < 1.5 { 2.0 } else { 2.5 }, 0.4];
    let evidence = shown(30, true, at_origin, leap);
    assert_eq!(evidence, [MotionEvidence::Insufficient; 30]);
}

#[test]
fn one_return_is_insufficient_and_an_object_that_was_hidden_for_long_is_a_new_one() {
    let place_m = [2.0, 0.4];
    let scan = scan_in(&with_person(place_m), [0.0, 0.0], 1);
    let run = beams_on(&scan, place_m);
    let object = |tracker: &Tracker| tracker.object_of(&run).unwrap();
    let mut tracker = Tracker::default();
    assert_eq!(evidence_in(&mut tracker, &scan, &run, false, 1), MotionEvidence::InEmptySpace);
    let one = run.start..run.start + 1;
    let known = tracker.object(object(&tracker)).unwrap();
    assert_eq!(motion_evidence(known, &scan, &one, || false), MotionEvidence::Insufficient);

    let empty = scan_in(&room(), [0.0, 0.0], 2);
    let lost_ms = 2 + MEMORY_MS;
    tracker.update(&empty, &nothing_known(&empty), &[], lost_ms, true);
    let later_ms = LONGEST_DOUBT_MS + 2;
    assert_eq!(
        evidence_in(&mut tracker, &scan, &run, false, later_ms),
        MotionEvidence::InEmptySpace,
        "a new one"
    );
    let all_along: Vec<MotionEvidence> = (0..4)
        .map(|scans| evidence_in(&mut tracker, &scan, &run, false, later_ms + 1 + scans * 900))
        .collect();
    assert_eq!(all_along[3], MotionEvidence::Insufficient, "{all_along:?}");
}

/// Regression: a robot with a scanner of a third of a degree had a zone at every newly hit chair leg or edge with two
/// returns.
#[test]
fn an_object_narrower_than_the_error_of_bearings_must_travel() {
    let place_m = [2.0, 0.4];
    let mut scan = scan_in(&with_person(place_m), [0.0, 0.0], 1);
    let first = beams_on(&scan, place_m).start;
    let shown_by = |scan: &DeskewedScan, returns: usize| {
        let run = first..first + returns;
        evidence_in(&mut Tracker::default(), scan, &run, false, 1)
    };
    assert_eq!(shown_by(&scan, 2), MotionEvidence::InEmptySpace, "exact bearings");
    for beam in &mut scan.beams {
        beam.bearing_error_rad = 2.5 * scan.step_rad;
    }
    assert_eq!(shown_by(&scan, 2), MotionEvidence::Insufficient);
    assert_eq!(shown_by(&scan, 3), MotionEvidence::InEmptySpace);
}
