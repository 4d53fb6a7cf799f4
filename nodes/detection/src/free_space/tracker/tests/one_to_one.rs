//! The assignment of segments to objects.

use proptest::prelude::*;

use super::*;

/// A scan of persons at these places, in free space, with the run of each.
fn persons(places_m: &[[f64; 2]], index: usize) -> (DeskewedScan, Vec<Range<usize>>) {
    let mut walls = room();
    for place_m in places_m {
        walls.extend(cuboid(*place_m, [0.3, 0.4]));
    }
    let scan = scan_in(&walls, [0.0, 0.0], index as u64);
    let mut runs: Vec<Range<usize>> =
        places_m.iter().map(|place_m| beams_on(&scan, *place_m)).collect();
    runs.retain(|run| !run.is_empty());
    runs.sort_by_key(|run| run.start);
    (scan, runs)
}

fn update(tracker: &mut Tracker, places_m: &[[f64; 2]], index: usize) -> DeskewedScan {
    let (scan, runs) = persons(places_m, index);
    tracker.update(&scan, &nothing_known(&scan), &runs, stamp_ms(index), false);
    scan
}

/// For how long the object at a place has been in free space.
fn known_ms(tracker: &Tracker, scan: &DeskewedScan, place_m: [f64; 2]) -> u32 {
    let object = tracker.object_of(&beams_on(scan, place_m)).unwrap();
    tracker.object(object).unwrap().in_free_space_ms()
}

/// Regression: the old zone of a person who had been hidden behind another was held beside the new one.
#[test]
fn two_persons_who_walk_towards_each_other_keep_their_histories() {
    let mut tracker = Tracker::default();
    for index in 0..16 {
        let gone_m = 1.0 * index as f64 * PERIOD_S;
        let places_m = [[2.0, -1.1 + gone_m], [3.2, 1.3 - gone_m]];
        let scan = update(&mut tracker, &places_m, index);
        let seen: Vec<[f64; 2]> =
            places_m.into_iter().filter(|place_m| !beams_on(&scan, *place_m).is_empty()).collect();
        for place_m in &seen {
            assert_eq!(known_ms(&tracker, &scan, *place_m), stamp_ms(index) - 1, "scan {index}");
        }
        assert!(seen.len() == 2 || tracker.objects.iter().any(|object| object.is_lost()));
        assert!((5..12).contains(&index) || seen.len() == 2, "they meet in the middle");
    }
}

#[test]
fn a_person_hidden_for_some_scans_keeps_the_history() {
    let mut tracker = Tracker::default();
    let other_m = [1.5, -1.0];
    for index in 0..5 {
        update(&mut tracker, &[[3.0, 0.2 * index as f64], other_m], index);
    }
    for index in 5..8 {
        update(&mut tracker, &[other_m], index);
    }
    let again_m = [3.0, 1.6];
    let scan = update(&mut tracker, &[again_m, other_m], 8);
    assert_eq!(known_ms(&tracker, &scan, again_m), stamp_ms(8) - 1);
    assert_eq!(known_ms(&tracker, &scan, other_m), stamp_ms(8) - 1);
}

/// Background is not associated with an object in free space.
#[test]
fn a_hidden_person_is_not_associated_with_the_chair_beside() {
    let mut tracker = Tracker::default();
    let (person_m, chair_m) = ([2.5, 0.0], [2.5, 0.8]);
    for index in 0..5 {
        let (scan, _) = persons(&[person_m], index);
        let run = beams_on(&scan, person_m);
        tracker.update(&scan, &nothing_known(&scan), &[run], stamp_ms(index), false);
    }
    let (scan, _) = persons(&[chair_m], 5);
    let background: Vec<Option<ReturnClass>> =
        scan.beams.iter().map(|beam| beam.hit.map(|_| ReturnClass::Background)).collect();
    tracker.update(&scan, &background, &[], stamp_ms(5), false);
    let chair = tracker.object_of(&beams_on(&scan, chair_m)).unwrap();
    assert_eq!(tracker.object(chair).unwrap().history().len(), 1);
    assert!(tracker.objects.iter().any(|object| object.is_lost()), "he may be found again");
}

proptest! {
    /// For any scans: the same result twice, one object for each segment, and no more objects than the scans of a second have.
    #[test]
    fn it_is_deterministic_and_bounded(
        scans in prop::collection::vec(prop::collection::vec(0.3f32..6.0, 60), 1..12),
    ) {
        let run = || {
            let mut tracker = Tracker::default();
            let mut counts = Vec::new();
            for (index, ranges_m) in scans.iter().enumerate() {
                let scan = static_scan(&StaticPlatform::default(), ranges_m);
                let runs: Vec<Range<usize>> = (0..60).step_by(7).map(|at| at..at + 3).collect();
                tracker.update(&scan, &nothing_known(&scan), &runs, stamp_ms(index), true);
                let travelling: Vec<Range<usize>> = tracker.travelling().collect();
                counts.push((tracker.segments.len(), tracker.objects.len(), travelling));
            }
            counts
        };
        let counts = run();
        prop_assert_eq!(&counts, &run());
        for (segments, objects, _) in counts {
            prop_assert!(segments <= objects && objects <= 60 * 8);
        }
    }
}
