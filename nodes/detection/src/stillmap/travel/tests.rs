use nalgebra::{Isometry3, Point2};

use super::super::journey::LEAST_PLACES;
use super::super::testing::{
    Dice, PERIOD_S, Scanner, StillPlatform, Wall, cuboid, room, still_turn,
};
use super::*;

fn turn_in(walls: &[Wall], seed: u64) -> Turn {
    let platform = StillPlatform { map_from_rig: Isometry3::identity() };
    let scan = Scanner::A1.scan(walls, &platform.map_from_rig, 0, &mut Dice::new(seed));
    still_turn(&platform, &scan.ranges_m)
}

fn nothing_known(turn: &Turn) -> Vec<Option<Verdict>> {
    turn.beams.iter().map(|beam| beam.met.map(|_| Verdict::Unseen)).collect()
}

/// What is found of things that are at these places in the scans of 7 Hz: in which scans something travels.
fn travelling(scans: usize, walls_at: impl Fn(f64) -> Vec<Wall>) -> Vec<bool> {
    let mut travellers = Travellers::default();
    (0..scans)
        .map(|scan| {
            let time_s = scan as f64 * PERIOD_S;
            let turn = turn_in(&walls_at(time_s), scan as u64);
            let verdicts = nothing_known(&turn);
            !travellers.follow(&turn, &verdicts, (time_s * 1e3) as u32 + 1).travelling.is_empty()
        })
        .collect()
}

/// The room with one more thing of the size of a person in it.
fn with_person(place_m: [f64; 2]) -> Vec<Wall> {
    let mut walls = room();
    walls.extend(cuboid(place_m, [0.3, 0.4]));
    walls
}

/// A thing whose ends both are at one place.
fn apart_at(place_m: Point2<f64>, is_half_hidden: bool) -> Apart {
    Apart { beams: 100..104, outline: Outline { is_half_hidden, edges_m: [Some(place_m); 2] } }
}

/// Regression: one who walked away from the scanner from the first scan on was found nowhere.
#[test]
fn who_walks_away_from_the_first_scan_on_travels() {
    let found = travelling(20, |time_s| with_person([1.0 + 1.2 * time_s, 0.4]));
    assert!(!found[..LEAST_PLACES - 1].contains(&true), "{found:?}");
    assert!(found[LEAST_PLACES..].iter().all(|found| *found), "{found:?}");
}

#[test]
fn who_stands_and_sways_does_not() {
    let found = travelling(40, |time_s| {
        with_person([2.0 + 0.05 * (3.0 * time_s).sin(), 0.4 + 0.05 * (4.0 * time_s).cos()])
    });
    assert_eq!(found, [false; 40]);
}

#[test]
fn a_rest_between_two_steps_is_part_of_the_journey_and_a_long_one_ends_it() {
    let at_m = |time_s: f64| if time_s < 2.0 { 1.0 + 1.2 * time_s } else { 3.4 };
    let found = travelling(40, |time_s| with_person([at_m(time_s), 0.4]));
    let at = |time_s: f64| found[(time_s / PERIOD_S) as usize];
    assert!(at(2.5) && !at(4.5), "{found:?}");
}

#[test]
fn a_chair_that_is_uncovered_does_not_travel() {
    let found = travelling(40, |time_s| {
        // A wide screen goes by in front of a chair.
        let mut walls = room();
        walls.extend(cuboid([4.0, 0.2], [0.4, 0.4]));
        walls.extend(cuboid([2.0, -3.0 + 1.0 * time_s], [0.3, 1.4]));
        walls
    });
    assert_eq!(found, [false; 40]);
}

#[test]
fn an_empty_turn_ends_every_journey() {
    let mut travellers = Travellers::default();
    let walls = with_person([2.0, 0.4]);
    let seen = turn_in(&walls, 0);
    travellers.follow(&seen, &nothing_known(&seen), 1);
    assert!(!travellers.things.is_empty());
    let empty = turn_in(&[], 1);
    travellers.follow(&empty, &nothing_known(&empty), 150);
    assert!(travellers.things.is_empty());
}

/// Regression: one who went away behind a door frame was found nowhere, since the frame is nearer.
#[test]
fn what_background_hides_at_one_side_is_followed_from_a_standing_platform_alone() {
    let person = 100..104_usize;
    let apart = |beside: &Verdict| {
        let mut ranges_m = [6.0; 360];
        ranges_m[person.clone()].fill(3.0);
        ranges_m[104..120].fill(1.0);
        let turn = still_turn(&StillPlatform::default(), &ranges_m);
        let verdicts: Vec<_> = turn.beams.iter().map(|_| Some(*beside)).collect();
        things_apart(&turn, &verdicts)
    };
    let is_person = |one: &Apart| one.beams == person && one.outline.is_half_hidden;
    assert!(apart(&Verdict::Background).iter().any(is_person));
    assert!(
        apart(&Verdict::Background).iter().any(|one| one
            .outline
            .edges_m
            .iter()
            .all(Option::is_some))
    );
    // What is no background may go, and then that end is not the person's own.
    let beside_another = apart(&Verdict::Unseen);
    let one = beside_another.iter().find(|one| one.beams == person).unwrap();
    assert!(
        one.outline.is_half_hidden
            && one.outline.edges_m[0].is_some()
            && one.outline.edges_m[1].is_none()
    );

    let journey = |platform_m: f64| {
        let mut thing = Thing::default();
        for step in 0..6_u32 {
            let share = f64::from(step) / 5.0;
            let place = Place {
                now_ms: 140 * step,
                in_map_m: Point2::new(2.0 + 0.8 * share, 0.0),
                platform_m: Point2::new(platform_m * share, 0.0),
                returns: 5,
            };
            thing.arrive(place, &apart_at(place.in_map_m, step == 2));
        }
        thing.travelled_ms.is_some()
    };
    assert!(journey(0.0) && !journey(0.2));
}

/// Regression: behind a robot that drove off, one part of a far wall after the other came into sight and travelled.
#[test]
fn from_a_platform_that_moves_what_leaps_once_does_not_travel() {
    let travels = |x_m: [f64; 6]| {
        let mut thing = Thing::default();
        for (step, x_m) in (0..6_u32).zip(x_m) {
            let place = Place {
                now_ms: 140 * step,
                in_map_m: Point2::new(x_m, 0.0),
                platform_m: Point2::new(0.04 * f64::from(step), 0.0),
                returns: 5,
            };
            thing.arrive(place, &apart_at(place.in_map_m, false));
        }
        thing.travelled_ms.is_some()
    };
    assert!(travels([2.0, 2.12, 2.24, 2.36, 2.48, 2.6]));
    assert!(!travels([2.0, 2.0, 2.0, 2.6, 2.6, 2.6]));
}

/// Regression: of three who walked away together only the last was found.
#[test]
fn who_walks_away_half_hidden_behind_another_travels_by_the_end_that_is_seen() {
    let mut travellers = Travellers::default();
    let found: Vec<bool> = (0..10_u32)
        .map(|scan| {
            let time_s = f64::from(scan) * PERIOD_S;
            let mut walls = with_person([1.6 + 1.2 * time_s, 0.55]);
            walls.extend(cuboid([1.0 + 1.2 * time_s, 0.1], [0.3, 0.4]));
            let turn = turn_in(&walls, u64::from(scan));
            let now_ms = (time_s * 1e3) as u32 + 1;
            let runs = travellers.follow(&turn, &nothing_known(&turn), now_ms).travelling;
            let is_hidden_one = |beams: &Range<usize>| {
                let place = Place::of(&turn, beams, 0);
                place.is_some_and(|place| place.in_map_m.y > 0.35)
            };
            runs.iter().any(is_hidden_one)
        })
        .collect();
    assert!(found[LEAST_PLACES + 1..].iter().all(|found| *found), "{found:?}");
}

/// Regression: with every step that parted the legs of one who walked away the journey began anew.
#[test]
fn legs_that_part_and_meet_again_go_on_with_their_journey() {
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
    assert!(found[LEAST_PLACES..].iter().all(|found| *found), "{found:?}");
}
