use nalgebra::{Isometry3, Point2, distance};

use super::super::journey::LEAST_PLACES;
use super::super::testing::{Dice, PERIOD_S, Scanner, StillPlatform, cuboid, room, still_turn};
use super::*;

/// A box of the size of a person, and the beams that meet it, from a platform at `platform_m`.
fn seen(platform_m: [f64; 2], place_m: [f64; 2], seed: u64) -> (Turn, Vec<Range<usize>>) {
    let mut walls = room();
    walls.extend(cuboid(place_m, [0.3, 0.4]));
    let pose = Isometry3::translation(platform_m[0], platform_m[1], 0.0);
    let scan =
        Scanner { dropouts: 0.0, ..Scanner::A1 }.scan(&walls, &pose, 0, &mut Dice::new(seed));
    let turn = still_turn(&StillPlatform { map_from_rig: pose }, &scan.ranges_m);
    let is_on_it = |beam: &usize| {
        let met = turn.beams[*beam].met;
        met.is_some_and(|met| distance(&met.in_map_m, &Point2::from(place_m)) < 0.4)
    };
    let beams: Vec<usize> = (0..turn.beams.len()).filter(is_on_it).collect();
    let run = beams[0]..beams[beams.len() - 1] + 1;
    (turn, vec![run])
}

/// What a thing that is at `place_m(time_s)` has shown in each scan, from a platform at `platform_m(time_s)`.
fn shown(
    scans: u32,
    is_in_clutter: bool,
    platform_m: impl Fn(f64) -> [f64; 2],
    place_m: impl Fn(f64) -> [f64; 2],
) -> Vec<Proof> {
    let mut proofs = Proofs::default();
    (0..scans)
        .map(|scan| {
            let time_s = f64::from(scan) * PERIOD_S;
            let (turn, runs) = seen(platform_m(time_s), place_m(time_s), u64::from(scan));
            proofs.of(&turn, &runs, |_| is_in_clutter, (time_s * 1e3) as u32 + 1)[0]
        })
        .collect()
}

fn at_origin(_: f64) -> [f64; 2] {
    [0.0, 0.0]
}

#[test]
fn in_empty_space_it_counts_at_once_and_as_background_when_it_has_not_travelled() {
    let proofs = shown(30, false, at_origin, |_| [2.0, 0.4]);
    let doubt_scans = (f64::from(LONGEST_DOUBT_MS) * 1e-3 / PERIOD_S) as usize;
    assert_eq!(proofs[..=doubt_scans], vec![Proof::InEmptySpace; doubt_scans + 1]);
    assert!(proofs[doubt_scans + 1..].iter().all(|proof| *proof == Proof::None), "{proofs:?}");
}

#[test]
fn amid_clutter_it_counts_once_it_has_travelled_and_then_also_when_it_rests() {
    let walk = |time_s: f64| [1.5 + 1.2 * time_s.min(1.5), 0.4];
    let proofs = shown(40, true, at_origin, walk);
    assert_eq!(proofs[..LEAST_PLACES - 1], [Proof::None; LEAST_PLACES - 1]);
    assert!(proofs[LEAST_PLACES..].iter().all(|proof| *proof == Proof::Travelled), "{proofs:?}");
}

/// Regression: chairs that a robot passed had zones for a minute.
#[test]
fn what_stands_does_not_travel_since_the_platform_goes_by() {
    let by = |time_s: f64| [0.8 * time_s - 1.0, -1.2];
    let proofs = shown(30, true, by, |_| [2.0, 0.4]);
    assert_eq!(proofs, [Proof::None; 30]);
}

#[test]
fn what_sways_does_not_travel() {
    let proofs = shown(40, true, at_origin, |time_s| [2.0 + 0.12 * (9.0 * time_s).sin(), 0.4]);
    assert_eq!(proofs, [Proof::None; 40]);
}

#[test]
fn one_return_is_too_little_and_one_that_was_lost_for_long_is_another() {
    let (turn, runs) = seen([0.0, 0.0], [2.0, 0.4], 1);
    let one: Vec<Range<usize>> = runs.iter().map(|run| run.start..run.start + 1).collect();
    assert_eq!(Proofs::default().of(&turn, &one, |_| false, 1), [Proof::None]);

    let mut proofs = Proofs::default();
    assert_eq!(proofs.of(&turn, &runs, |_| false, 1), [Proof::InEmptySpace]);
    let later_ms = LONGEST_DOUBT_MS + 2;
    assert_eq!(proofs.of(&turn, &runs, |_| false, later_ms), [Proof::InEmptySpace], "a new one");
    let seen_all_along: Vec<Proof> = (0..4)
        .map(|scan| proofs.of(&turn, &runs, |_| false, later_ms + 1 + scan * 900)[0])
        .collect();
    assert_eq!(seen_all_along[3], Proof::None, "{seen_all_along:?}");
}

/// Regression: a robot with a scanner of a third of a degree had a zone at every chair's leg and edge that it met anew,
/// two returns of it.
#[test]
fn what_is_narrower_than_bearings_are_off_must_travel() {
    let (mut turn, runs) = seen([0.0, 0.0], [2.0, 0.4], 1);
    let shown_by = |turn: &Turn, returns: usize| {
        let run = runs[0].start..runs[0].start + returns;
        Proofs::default().of(turn, &[run], |_| false, 1)[0]
    };
    assert_eq!(shown_by(&turn, 2), Proof::InEmptySpace, "exact bearings");
    for beam in &mut turn.beams {
        beam.bearing_error_rad = 2.5 * turn.step_rad;
    }
    assert_eq!(shown_by(&turn, 2), Proof::None);
    assert_eq!(shown_by(&turn, 3), Proof::InEmptySpace);
}

/// Regression: of a ramp that a nodding scanner met, another part in each look, the way from the first to the second was
/// taken for a journey.
#[test]
fn what_leaps_once_does_not_travel() {
    let leap = |time_s: f64| [if time_s < 1.5 { 2.0 } else { 2.5 }, 0.4];
    let proofs = shown(30, true, at_origin, leap);
    assert_eq!(proofs, [Proof::None; 30]);
}
