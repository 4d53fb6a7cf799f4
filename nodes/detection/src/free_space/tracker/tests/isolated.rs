//! Isolated objects in unknown space.

use super::*;

/// In which scans of 7 Hz an isolated segment of this world travels.
fn travelling(scans: usize, walls_at: impl Fn(f64) -> Vec<Wall>) -> Vec<bool> {
    let mut tracker = Tracker::default();
    (0..scans)
        .map(|index| {
            let time_s = index as f64 * PERIOD_S;
            let scan = scan_in(&walls_at(time_s), [0.0, 0.0], index as u64);
            tracker.update(&scan, &nothing_known(&scan), &[], stamp_ms(index), false);
            tracker.travelling().next().is_some()
        })
        .collect()
}

/// Regression: a person who walked away from the scanner from the first scan on was not found.
#[test]
fn a_person_who_walks_away_from_the_first_scan_on_travels() {
    let found = travelling(20, |time_s| with_person([1.0 + 1.2 * time_s, 0.4]));
    assert!(!found[..LEAST_SIGHTINGS - 1].contains(&true), "{found:?}");
    assert!(found[LEAST_SIGHTINGS..].iter().all(|found| *found), "{found:?}");
}

#[test]
fn a_person_who_stands_and_sways_does_not_travel() {
    let found = travelling(40, |time_s| {
        with_person([2.0 + 0.05 * (3.0 * time_s).sin(), 0.4 + 0.05 * (4.0 * time_s).cos()])
    });
    assert_eq!(found, [false; 40]);
}

#[test]
fn a_rest_between_two_steps_is_part_of_the_motion_and_a_long_one_ends_it() {
    let at_m = |time_s: f64| if time_s < 2.0 { 1.0 + 1.2 * time_s } else { 3.4 };
    let found = travelling(40, |time_s| with_person([at_m(time_s), 0.4]));
    let at = |time_s: f64| found[(time_s / PERIOD_S) as usize];
    assert!(at(2.5) && !at(4.5), "{found:?}");
}

#[test]
fn a_chair_that_is_uncovered_does_not_travel() {
    let found = travelling(40, |time_s| {
        // A wide screen passes in front of a chair.
        let mut walls = room();
        walls.extend(cuboid([4.0, 0.2], [0.4, 0.4]));
        walls.extend(cuboid([2.0, -3.0 + 1.0 * time_s], [0.3, 1.4]));
        walls
    });
    assert_eq!(found, [false; 40]);
}

/// In unknown space another object may have become visible meanwhile.
#[test]
fn an_empty_scan_ends_every_history_outside_of_free_space() {
    let mut tracker = Tracker::default();
    let seen = scan_in(&with_person([2.0, 0.4]), [0.0, 0.0], 0);
    tracker.update(&seen, &nothing_known(&seen), &[], 1, false);
    assert!(!tracker.objects.is_empty());
    let empty = scan_in(&[], [0.0, 0.0], 1);
    tracker.update(&empty, &nothing_known(&empty), &[], 150, false);
    assert!(tracker.objects.is_empty());
}

/// Regression: of three persons who walked away together only the last was found.
#[test]
fn a_partly_hidden_person_who_walks_away_travels_by_the_visible_end() {
    let mut tracker = Tracker::default();
    let found: Vec<bool> = (0..10)
        .map(|index| {
            let time_s = index as f64 * PERIOD_S;
            let hidden_one_m = [1.6 + 1.2 * time_s, 0.55];
            let mut walls = with_person(hidden_one_m);
            walls.extend(cuboid([1.0 + 1.2 * time_s, 0.1], [0.3, 0.4]));
            let scan = scan_in(&walls, [0.0, 0.0], index as u64);
            tracker.update(&scan, &nothing_known(&scan), &[], stamp_ms(index), false);
            let on_it = beams_on(&scan, hidden_one_m);
            tracker.travelling().any(|beams| beams.contains(&(on_it.end - 1)))
        })
        .collect();
    assert!(found[LEAST_SIGHTINGS + 1..].iter().all(|found| *found), "{found:?}");
}

/// Regression: with every step that split the legs of a person who walked away, the history began again.
#[test]
fn legs_that_split_and_merge_keep_their_history() {
    const STRIDE: u32 = 6;
    let found = travelling(12, |time_s| {
        let scan = (time_s / PERIOD_S).round() as u32;
        // In the stride one leg is ahead; in the next scan the other has swung after it.
        let swung_m = if scan > STRIDE { 0.2 } else { 0.0 };
        let ahead_m = if scan == STRIDE { 0.45 } else { 0.1 };
        let behind_m = 1.2 + 1.2 * time_s + swung_m;
        let mut walls = room();
        walls.extend(cuboid([behind_m, 0.5], [0.12, 0.16]));
        walls.extend(cuboid([behind_m + ahead_m, 0.3], [0.12, 0.16]));
        walls
    });
    assert!(found[LEAST_SIGHTINGS..].iter().all(|found| *found), "{found:?}");
}
