//! What stands apart and travels: the motion of an object whose ways have never been seen free.
//!
//! Free space tells nothing of one who stood before the scanner from the first scan on and walks away from
//! it: every place that it reaches was hidden behind it. But it is a narrow thing with nothing near it to
//! both sides, and it goes from place to place. Such things are followed over the scans, and one that
//! has come some way is moving.
//!
//! Background that is merely uncovered does not travel: it is new where it is, and then it stays.

use std::collections::VecDeque;
use std::ops::Range;

use nalgebra::{Point2, distance};

use super::free_space::Verdict;
use super::journey::{Journey, Place};
use super::turn::Turn;

/// Returns next to each other belong to one thing when they are no farther apart than this: a stride.
const STRIDE_M: f64 = 0.4;
/// A wider thing is furniture, or a part of the room: two persons side by side are narrower.
const WIDEST_M: f64 = 1.0;
/// Beams without a return that a thing may go over: black trousers.
const MOST_EMPTY_BEAMS: usize = 3;
/// A thing is seen past at a side where it has so much without a return beside it.
const SEEN_PAST_M: f64 = 0.1;
/// The middle of what is seen of a thing jumps by so much without motion: half a body.
const JUMP_M: f64 = 0.2;
/// A thing has travelled when it is so far from where it was: more than the middle of a standing person sways.
const TRAVELLED_M: f64 = 0.25;
/// A thing that is so far from where it was is under way: a slow walker's step between two scans, and more than the
/// middle of one who stands moves from one scan to the next.
const UNDER_WAY_M: f64 = 0.1;
/// Looked back no farther than this: in that time a slow walker goes [`TRAVELLED_M`].
const LONGEST_LOOK_MS: u32 = 800;
/// And no less: what moves so far at once is another thing that came into sight.
const SHORTEST_LOOK_MS: u32 = 350;
/// One who has travelled may rest for so long between two steps.
const REST_MS: u32 = 1_000;
/// A platform that has not gone farther stands: its poses waver by so much.
const STANDS_M: f64 = 0.05;

/// What things that stand apart do.
#[derive(Clone, Debug, Default)]
pub(super) struct Travel {
    /// The beams of those that travel, run by run.
    pub(super) travelling: Vec<Range<usize>>,
    /// The beams of those that are somewhere else than they were, and may travel.
    pub(super) under_way: Vec<Range<usize>>,
}

/// The things that stood apart in the last scans.
#[derive(Clone, Debug, Default)]
pub(super) struct Travellers {
    things: Vec<Thing>,
}

/// A thing and where it was.
#[derive(Clone, Debug, Default)]
struct Thing {
    journey: Journey,
    /// How it looked at each place of the journey.
    outlines: VecDeque<Outline>,
    /// When it was last seen to have travelled.
    travelled_ms: Option<u32>,
}

/// What is seen of a thing in one turn.
#[derive(Clone, Copy, Debug)]
struct Outline {
    /// What is in front of it hides a part at one side: how much, changes as the platform moves.
    is_half_hidden: bool,
    /// Its ends to the right and to the left; `None` at a side where something hides a part of it that may go.
    edges_m: [Option<Point2<f64>>; 2],
}

/// A thing that stands apart in one turn.
#[derive(Clone, Debug)]
struct Apart {
    beams: Range<usize>,
    outline: Outline,
}

/// What is beside a thing, at one side.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Beside {
    /// What is farther away, or nothing.
    Open,
    /// Background that is nearer, and may hide a part of it.
    Background,
    /// Something else that is nearer: what it hides changes as it goes.
    Other,
}

impl Travellers {
    pub(super) fn clear(&mut self) {
        self.things.clear();
    }

    /// Follows the things of the turn, one verdict a beam.
    pub(super) fn follow(
        &mut self,
        turn: &Turn,
        verdicts: &[Option<Verdict>],
        now_ms: u32,
    ) -> Travel {
        let apart = things_apart(turn, verdicts);
        let mut before = std::mem::take(&mut self.things);
        let mut travel = Travel::default();
        for (thing, beams) in matched(&mut before, turn, &apart, now_ms) {
            if thing.travelled_ms.is_some_and(|at_ms| now_ms.saturating_sub(at_ms) <= REST_MS) {
                travel.travelling.push(beams);
            } else if thing.goes_itself() && thing.journey.leads_away(UNDER_WAY_M) {
                travel.under_way.push(beams);
            }
            self.things.push(thing);
        }
        travel
    }
}

/// Each thing that stands apart, with its past where it has one. The nearest pairs are matched first, so that a
/// thing that came into sight beside a traveller does not take over its journey. Things that have become one have
/// the longest past of them: the legs of a walker part and meet with every step. One that stands comes to a past that is
/// not its own by this, too, when another beside it vanishes; but by then it was seen where it is, and is background.
fn matched(
    before: &mut Vec<Thing>,
    turn: &Turn,
    apart: &[Apart],
    now_ms: u32,
) -> Vec<(Thing, Range<usize>)> {
    let seen: Vec<(Place, &Apart)> =
        apart.iter().filter_map(|one| Some((Place::of(turn, &one.beams, now_ms)?, one))).collect();
    let mut pairs = Vec::new();
    for (new, (place, _)) in seen.iter().enumerate() {
        for (old, thing) in before.iter().enumerate() {
            if let Some(apart_m) = thing.journey.step_m(place, JUMP_M) {
                pairs.push((apart_m, new, old));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    let mut past: Vec<Option<usize>> = vec![None; seen.len()];
    let mut is_taken = vec![false; before.len()];
    for (_, new, old) in pairs {
        if past[new].is_none() && !is_taken[old] {
            past[new] = Some(old);
            is_taken[old] = true;
        }
    }
    for old in (0..before.len()).filter(|old| !is_taken[*old]) {
        let lasts_ms = |old: usize| before[old].journey.lasts_ms();
        if let Some(new) = gone_into(&before[old], turn, &seen)
            && past[new].is_none_or(|known| lasts_ms(known) < lasts_ms(old))
        {
            past[new] = Some(old);
        }
    }
    let mut before: Vec<Option<Thing>> = before.drain(..).map(Some).collect();
    let thing_of = |((place, one), old): (&(Place, &Apart), &Option<usize>)| {
        let known = old.and_then(|old| before.get_mut(old)?.take());
        let mut thing = known.unwrap_or_default();
        thing.arrive(*place, one);
        (thing, one.beams.clone())
    };
    seen.iter().zip(&past).map(thing_of).collect()
}

/// Which of the things has its middle nearest, of those that reach within a stride of where the thing was.
fn gone_into(thing: &Thing, turn: &Turn, seen: &[(Place, &Apart)]) -> Option<usize> {
    let was = thing.journey.last()?;
    let reaches = |one: &Apart| {
        let mut met = turn.beams[one.beams.clone()].iter().filter_map(|beam| beam.met);
        met.any(|met| distance(&met.in_map_m, &was.in_map_m) <= STRIDE_M)
    };
    let near = seen.iter().enumerate().filter_map(|(new, (place, one))| {
        let step_m = thing.journey.step_m(place, JUMP_M).filter(|_| reaches(one))?;
        Some((step_m, new))
    });
    near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, new)| new)
}

impl Thing {
    fn arrive(&mut self, place: Place, one: &Apart) {
        self.journey.arrive(place, LONGEST_LOOK_MS);
        self.outlines.push_back(one.outline);
        while self.outlines.len() > self.journey.len() {
            self.outlines.pop_front();
        }
        if self.has_travelled() {
            self.travelled_ms = self.journey.seen_ms();
        }
    }

    /// Whether it has come some way over the places that are remembered.
    fn has_travelled(&self) -> bool {
        self.journey.lasts_ms() >= SHORTEST_LOOK_MS
            && self.goes_itself()
            && self.journey.travels(TRAVELLED_M)
            && self.edges_have_travelled()
    }

    /// Whether it is not the platform's motion that shows another part of it in each turn.
    fn goes_itself(&self) -> bool {
        let platform_stands = self.journey.platform_m() <= STANDS_M;
        let was_half_hidden = || self.outlines.iter().any(|outline| outline.is_half_hidden);
        platform_stands || (!was_half_hidden() && self.journey.is_gradual())
    }

    /// Whether its ends have come as far as its middle must, each that was seen at first and is now; one of them was.
    /// The middle of what something else uncovers, going by, moves as well; the end that is seen stays.
    fn edges_have_travelled(&self) -> bool {
        if !self.outlines.iter().any(|outline| outline.edges_m.contains(&None)) {
            return true;
        }
        let Some((first, last)) = self.outlines.front().zip(self.outlines.back()) else {
            return false;
        };
        let ends_m = first.edges_m.iter().zip(&last.edges_m);
        let ways_m = ends_m.filter_map(|(from, to)| Some(distance(&(*from)?, &(*to)?)));
        ways_m.reduce(f64::min).is_some_and(|way_m| way_m >= TRAVELLED_M)
    }
}

/// The narrow things that have nothing near them: the room goes on behind them at both sides, or at one side and
/// something hides a part of them at the other.
fn things_apart(turn: &Turn, verdicts: &[Option<Verdict>]) -> Vec<Apart> {
    let runs = runs_of_returns(turn);
    let look = Look { turn, verdicts };
    let apart = |index: usize| {
        let beams = runs.get(index)?;
        // At the ends of the scan nothing is known of what stands beside.
        if !look.is_narrow(beams) || beams.start == 0 || beams.end == turn.beams.len() {
            return None;
        }
        let right = index.checked_sub(1).and_then(|before| runs.get(before)).map(|run| run.end - 1);
        let left = runs.get(index + 1).map(|next| next.start);
        let beside = [look.beside(beams.start, right), look.beside(beams.end - 1, left)];
        if !beside.contains(&Beside::Open) {
            return None;
        }
        let edge_m = |beam: usize, beside: Beside| {
            let place_m = turn.beams.get(beam)?.met?.in_map_m;
            (beside != Beside::Other).then_some(place_m)
        };
        let edges_m = [edge_m(beams.start, beside[0]), edge_m(beams.end - 1, beside[1])];
        let is_half_hidden = beside != [Beside::Open; 2];
        Some(Apart { beams: beams.clone(), outline: Outline { is_half_hidden, edges_m } })
    };
    (0..runs.len()).filter_map(apart).collect()
}

/// The runs of beams whose returns follow one another within a stride.
fn runs_of_returns(turn: &Turn) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for (beam, met) in turn.beams.iter().enumerate().filter_map(|(at, b)| Some((at, b.met?))) {
        let goes_on = runs.last().and_then(|run| {
            let last = turn.beams.get(run.end - 1)?.met?;
            let is_near = distance(&last.in_map_m, &met.in_map_m) <= STRIDE_M;
            Some(is_near && beam - run.end <= MOST_EMPTY_BEAMS)
        });
        match runs.last_mut() {
            Some(run) if goes_on == Some(true) => run.end = beam + 1,
            _ => runs.push(beam..beam + 1),
        }
    }
    runs
}

struct Look<'a> {
    turn: &'a Turn,
    verdicts: &'a [Option<Verdict>],
}

impl Look<'_> {
    fn is_narrow(&self, beams: &Range<usize>) -> bool {
        let place = |beam: usize| self.turn.beams.get(beam)?.met.map(|met| met.in_map_m);
        let ends = place(beams.start).zip(place(beams.end - 1));
        ends.is_some_and(|(right, left)| distance(&right, &left) <= WIDEST_M)
    }

    /// What is beside the beam at an edge of a thing, whose next return is that of beam `other`.
    fn beside(&self, edge: usize, other: Option<usize>) -> Beside {
        let range_m = |beam: usize| self.turn.beams.get(beam)?.met.map(|met| met.range_m);
        let Some((other, other_m)) = other.and_then(|other| Some((other, range_m(other)?))) else {
            return Beside::Open;
        };
        let Some(own_m) = range_m(edge) else { return Beside::Other };
        let empty_beams = edge.abs_diff(other) - 1;
        let empty_m = empty_beams as f64 * self.turn.step_rad * f64::from(own_m);
        if own_m < other_m || empty_m >= SEEN_PAST_M {
            Beside::Open
        } else if self.verdicts.get(other) == Some(&Some(Verdict::Background)) {
            Beside::Background
        } else {
            Beside::Other
        }
    }
}

#[cfg(test)]
mod tests;
