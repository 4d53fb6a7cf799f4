//! The search for loops: in the caller's thread, or in another.

use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use super::*;
use crate::shell::BackgroundSearch;

fn place(drive: &Drive, number: usize) -> Place {
    Place {
        stamp: Drive::stamp(number),
        odom_from_vehicle: drive.odometry[number],
        points_m: drive.scans[number].clone(),
    }
}

fn closer() -> LoopCloser {
    LoopCloser::new(LoopClosingConfig::default(), Arc::new(threads(1))).unwrap()
}

/// One that looks for nothing while the mutex is held.
fn held() -> (BackgroundSearch, Arc<Mutex<()>>) {
    let hold = Arc::new(Mutex::new(()));
    let of_thread = Arc::clone(&hold);
    let pause = move || drop(of_thread.lock().unwrap());
    (BackgroundSearch::with_pause(closer(), pause).unwrap(), hold)
}

fn wait_for(search: &BackgroundSearch) {
    let until = Instant::now() + Duration::from_secs(60);
    while !search.is_idle() {
        assert!(Instant::now() < until, "the search does not end");
        thread::yield_now();
    }
}

#[test]
fn a_thread_of_its_own_finds_the_same_loops() {
    let (drive, expected, outcomes) = &*ROUND_A_BLOCK;
    let mut background = BackgroundSearch::new(closer()).unwrap();
    let mut inline = InlineSearch::new(LoopClosingConfig::default(), Arc::new(threads(2))).unwrap();
    // The inline one is heard of at once, and does what the closer itself does.
    for (number, outcome) in outcomes.iter().enumerate().take(3) {
        assert!(inline.take(place(drive, number)));
        let answer = LoopAnswer { stamp: Drive::stamp(number), outcome: *outcome };
        assert_eq!(inline.answers(), [answer]);
        assert_eq!(inline.known().keyframes.len(), number + 1);
    }
    let mut answers = Vec::new();
    for number in 0..drive.truth.len() {
        let place = place(drive, number);
        assert!(background.wants(&place.odom_from_vehicle) && background.take(place));
        wait_for(&background);
        answers.extend(background.answers().into_iter().map(|answer| answer.outcome));
    }
    assert_eq!(answers, *outcomes);
    assert_eq!(*background.known(), expected.known());
}

#[test]
fn a_slow_search_blocks_nothing_and_places_in_between_are_kept() {
    let (drive, ..) = &*ROUND_A_BLOCK;
    let (mut search, hold) = held();
    // As long as it looks nothing is answered, and a bound is kept.
    let held = hold.lock().unwrap();
    let taken = (0..drive.truth.len()).take_while(|number| search.take(place(drive, *number)));
    let first = taken.count();
    assert!((20..=21).contains(&first), "{first}");
    assert!(search.answers().is_empty() && !search.is_idle());
    assert!(search.wants(&drive.odometry[first]));
    drop(held);
    wait_for(&search);
    assert!(search.answers().len() <= 2);
    assert_eq!(search.known().keyframes.len(), first);
    // Slow again where the vehicle is back: looked for is where it is when there is time again.
    let back = drive.truth.len() - 10;
    for number in first..drive.truth.len() {
        if number < back {
            assert!(search.take(place(drive, number)));
            wait_for(&search);
        } else {
            let held = hold.lock().unwrap();
            assert!(search.take(place(drive, number)));
            drop(held);
        }
    }
    wait_for(&search);
    search.answers();
    let known = search.known();
    assert_eq!(known.keyframes.len(), drive.truth.len());
    assert!(known.closed > 0);
    let last = drive.truth.len() - 1;
    let (off_m, _) = apart(&(known.map_from_odom * drive.odometry[last]), &drive.truth[last]);
    assert!(off_m < 0.5, "{off_m}");
}

#[test]
fn what_is_forgotten_while_it_is_looked_for_is_not_answered() {
    let (drive, ..) = &*ROUND_A_BLOCK;
    let (mut search, hold) = held();
    let held = hold.lock().unwrap();
    assert!(search.take(place(drive, 0)) && search.take(place(drive, 1)));
    search.forget();
    // The same place, of a new drive.
    assert!(search.wants(&drive.odometry[1]) && search.take(place(drive, 1)));
    drop(held);
    wait_for(&search);
    let answers = search.answers();
    assert_eq!(answers.len(), 1, "{answers:?}");
    assert_eq!(search.known().keyframes.len(), 1);
}

#[test]
fn a_search_that_is_no_longer_needed_is_aborted() {
    let (drive, _, outcomes) = &*ROUND_A_BLOCK;
    let looked = |outcome: &LoopOutcome| *outcome == LoopOutcome::Unconfirmed;
    let number = outcomes.iter().position(looked).unwrap();
    let mut closer = closer();
    for number in 0..=number {
        let Place { stamp, odom_from_vehicle, points_m } = place(drive, number);
        assert!(closer.keep(stamp, &odom_from_vehicle, &points_m));
    }
    let given_up = LoopOutcome::Refused(NotALoop::GivenUp);
    assert_eq!(closer.look(&|| true), given_up);
    // Nothing is left of it.
    assert_eq!(closer.look(&|| false), LoopOutcome::Unconfirmed);
}
