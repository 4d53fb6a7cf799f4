//! What must be shown before a thing in free space counts as moving, on a platform that moves itself.
//!
//! From a still platform the evidence of free space is exact to the noise of ranges. From a moving one it is not:
//! poses are off, the scanner tilts, and a chair's leg that was missed from there is met from here. Such errors
//! have other background near by, and they stay where they are. So a thing counts at once only where the space
//! around it is empty; amid clutter it counts once it has been seen to travel; and one that has not travelled within
//! some seconds is background.

#[cfg(test)]
mod tests;

use std::ops::Range;

use super::journey::{Journey, Place};
use super::turn::Turn;

/// Background so near to a thing may be its own, missed before: the width of a chair.
pub(super) const CLUTTER_M: f64 = 0.5;
/// A thing of fewer returns is too little to go by before it has travelled: one range that is off.
const LEAST_RETURNS: usize = 2;
/// What stands in empty space has so long to travel.
const LONGEST_DOUBT_MS: u32 = 2_000;
/// It has travelled when it is so far from where it was: more than the middle of a thing that is seen anew from
/// each side shifts.
const TRAVELLED_M: f64 = 0.3;
/// The way is looked at over so long: a slow walker goes [`TRAVELLED_M`] meanwhile.
const LONGEST_LOOK_MS: u32 = 1_000;
/// Its middle jumps by so much without motion, as more or less of it is seen.
const JUMP_M: f64 = 0.25;
/// A thing that was not seen for so long is forgotten.
const FORGOTTEN_MS: u32 = 1_000;

/// What a thing in free space counts as.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Proof {
    /// It has travelled: it moves, and goes on to when it is lost from sight.
    Travelled,
    /// Nothing speaks against it: it moves as long as it is seen.
    InEmptySpace,
    /// It is most likely background.
    None,
}

/// The things of the last scans.
#[derive(Clone, Debug, Default)]
pub(super) struct Proofs {
    things: Vec<Thing>,
}

/// A thing, and what it has shown.
#[derive(Clone, Debug)]
struct Thing {
    journey: Journey,
    born_ms: u32,
    has_travelled: bool,
}

impl Proofs {
    pub(super) fn clear(&mut self) {
        self.things.clear();
    }

    /// What each of the runs of a turn has shown; `is_in_clutter` says whether background is near it.
    pub(super) fn of(
        &mut self,
        turn: &Turn,
        runs: &[Range<usize>],
        is_in_clutter: impl Fn(&Range<usize>) -> bool,
        now_ms: u32,
    ) -> Vec<Proof> {
        self.things.retain(|thing| now_ms.saturating_sub(thing.seen_ms()) <= FORGOTTEN_MS);
        let mut is_taken = vec![false; self.things.len()];
        let mut proofs = Vec::with_capacity(runs.len());
        for run in runs {
            let Some(place) = Place::of(turn, run, now_ms) else {
                proofs.push(Proof::None);
                continue;
            };
            let nearest = self.nearest(&place, &is_taken);
            let thing = match nearest {
                Some(index) => {
                    is_taken[index] = true;
                    &mut self.things[index]
                }
                None => {
                    is_taken.push(true);
                    self.things.push(Thing::new(now_ms));
                    let last = self.things.len() - 1;
                    &mut self.things[last]
                }
            };
            thing.arrive(place);
            let has_stood_too_long = now_ms.saturating_sub(thing.born_ms) > LONGEST_DOUBT_MS;
            proofs.push(if thing.has_travelled {
                Proof::Travelled
            } else if has_stood_too_long || is_too_narrow(turn, run, &place) || is_in_clutter(run) {
                Proof::None
            } else {
                Proof::InEmptySpace
            });
        }
        proofs
    }

    /// The thing that may have come to a place, the nearest of them.
    fn nearest(&self, place: &Place, is_taken: &[bool]) -> Option<usize> {
        self.things
            .iter()
            .enumerate()
            .filter(|(index, _)| is_taken.get(*index) == Some(&false))
            .filter_map(|(index, thing)| Some((index, thing.journey.step_m(place, JUMP_M)?)))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(index, _)| index)
    }
}

/// Whether a thing is too narrow to go by before it has travelled.
///
/// What takes less than the error of a bearing may have been passed at its side by every ray that was taken to show
/// its place free. However fine the steps of a scanner are, its poses turn all of its bearings together, so that
/// several returns are no better than one.
fn is_too_narrow(turn: &Turn, run: &Range<usize>, place: &Place) -> bool {
    let bearing_errors_rad = turn.beams[run.clone()].iter().map(|beam| beam.bearing_error_rad);
    let error_rad = bearing_errors_rad.fold(0.0, f64::max);
    place.returns < LEAST_RETURNS || place.returns as f64 * turn.step_rad < error_rad
}

impl Thing {
    fn new(now_ms: u32) -> Self {
        Self { journey: Journey::default(), born_ms: now_ms, has_travelled: false }
    }

    fn seen_ms(&self) -> u32 {
        self.journey.seen_ms().unwrap_or(self.born_ms)
    }

    fn arrive(&mut self, place: Place) {
        self.journey.arrive(place, LONGEST_LOOK_MS);
        self.has_travelled |= self.journey.travels(TRAVELLED_M) && self.journey.is_gradual();
    }
}
