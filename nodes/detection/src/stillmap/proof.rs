//! What must be shown before a thing in free space counts as moving, on a platform that moves itself.
//!
//! From a still platform the evidence of free space is exact to the noise of ranges. From a moving one it is not:
//! poses are off, the scanner tilts, and a chair's leg that was missed from there is met from here. Such errors
//! have other background near by, and they stay where they are. So a thing counts at once only where the space
//! around it is empty; amid clutter it counts once it has been seen to travel; and one that has not travelled within
//! some seconds is background.

#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::ops::Range;

use nalgebra::{Point2, distance};

use super::turn::Turn;

/// Background so near to a thing may be its own, missed before: the width of a chair.
pub(super) const CLUTTER_M: f64 = 0.5;
/// A thing of fewer returns is too little to go by before it has travelled: one bearing that is off.
const LEAST_RETURNS: usize = 2;
/// What stands in empty space has so long to travel.
const LONGEST_DOUBT_MS: u32 = 2_000;
/// It has travelled when it is so far from where it was: more than the middle of a thing that is seen anew from
/// each side shifts ...
const TRAVELLED_M: f64 = 0.3;
/// ... and, besides, this share of the platform's own way: what is seen of a thing changes as the platform goes by.
const SHARE_OF_PLATFORM: f64 = 0.5;
/// The way is looked at over so long: a slow walker goes [`TRAVELLED_M`] meanwhile.
const LONGEST_LOOK_MS: u32 = 1_000;
/// Places that it takes, at least: with fewer, another thing that came into sight could pass for it.
const LEAST_PLACES: usize = 4;
/// The way from place to place may be longer than the journey by this factor: what merely sways goes back.
const MOST_DETOUR: f64 = 1.5;
/// Its middle jumps by so much without motion, as more or less of it is seen.
const JUMP_M: f64 = 0.25;
/// Faster than this nobody goes indoors: a run.
const FASTEST_M_PER_S: f64 = 3.0;
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
    /// The latest place last.
    places: VecDeque<Place>,
    born_ms: u32,
    has_travelled: bool,
}

#[derive(Clone, Copy, Debug)]
struct Place {
    now_ms: u32,
    in_map_m: Point2<f64>,
    platform_m: Point2<f64>,
    returns: usize,
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
            let Some(place) = place_of(turn, run, now_ms) else {
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
            } else if has_stood_too_long || place.returns < LEAST_RETURNS || is_in_clutter(run) {
                Proof::None
            } else {
                Proof::InEmptySpace
            });
        }
        proofs
    }

    /// The thing that may have come to a place, the nearest of them.
    fn nearest(&self, place: &Place, is_taken: &[bool]) -> Option<usize> {
        let apart_m = |thing: &Thing| {
            let last = thing.places.back()?;
            let elapsed_s = f64::from(place.now_ms.saturating_sub(last.now_ms)) * 1e-3;
            let apart_m = distance(&last.in_map_m, &place.in_map_m);
            (apart_m <= JUMP_M + FASTEST_M_PER_S * elapsed_s).then_some(apart_m)
        };
        self.things
            .iter()
            .enumerate()
            .filter(|(index, _)| is_taken.get(*index) == Some(&false))
            .filter_map(|(index, thing)| Some((index, apart_m(thing)?)))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(index, _)| index)
    }
}

impl Thing {
    fn new(now_ms: u32) -> Self {
        Self { places: VecDeque::new(), born_ms: now_ms, has_travelled: false }
    }

    fn seen_ms(&self) -> u32 {
        self.places.back().map_or(self.born_ms, |place| place.now_ms)
    }

    fn arrive(&mut self, place: Place) {
        self.places.push_back(place);
        let is_old = |old: &Place| place.now_ms.saturating_sub(old.now_ms) > LONGEST_LOOK_MS;
        while self.places.front().is_some_and(is_old) {
            self.places.pop_front();
        }
        self.has_travelled |= self.travels();
    }

    /// Whether it has come some way over the places that are remembered.
    fn travels(&self) -> bool {
        let (Some(first), Some(last)) = (self.places.front(), self.places.back()) else {
            return false;
        };
        let steps = self.places.iter().zip(self.places.iter().skip(1));
        let way_m: f64 = steps.map(|(from, to)| distance(&from.in_map_m, &to.in_map_m)).sum();
        let journey_m = distance(&first.in_map_m, &last.in_map_m);
        let platform_m = distance(&first.platform_m, &last.platform_m);
        self.places.len() >= LEAST_PLACES
            && journey_m >= TRAVELLED_M + SHARE_OF_PLATFORM * platform_m
            && way_m <= MOST_DETOUR * journey_m
    }
}

/// The middle of what a run shows.
fn place_of(turn: &Turn, run: &Range<usize>, now_ms: u32) -> Option<Place> {
    let beams = turn.beams.get(run.clone())?;
    let platform_m = beams.first()?.origin_m;
    let met: Vec<Point2<f64>> =
        beams.iter().filter_map(|beam| beam.met).map(|met| met.in_map_m).collect();
    let sum: nalgebra::Vector2<f64> = met.iter().map(|in_map_m| in_map_m.coords).sum();
    let returns = met.len();
    let in_map_m = Point2::from(sum / returns as f64);
    (returns > 0).then_some(Place { now_ms, in_map_m, platform_m, returns })
}
