//! Runs of moving beams: which of them are an object.

use std::ops::Range;

use super::free_space::Verdict;
use super::turn::{Return, Turn};

/// The chance that all moving beams of a run are background after all must be below this.
const MOST_CHANCE_OF_BACKGROUND: f64 = 0.01;
/// Beams that say nothing, and returns without evidence, part an object only where they take more than this:
/// about a body's narrow side.
const WIDEST_BRIDGE_M: f64 = 0.15;
/// The surface of one object does not step by more than this between two of its beams: a body with its
/// arms stretched out.
const LARGEST_STEP_M: f64 = 0.4;

/// Beams of one object, by their places in the turn.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct MovingRun {
    /// From its first beam to behind its last one.
    pub(super) beams: Range<usize>,
}

/// The runs among the beams `within` of a turn, one verdict a beam (`None` for a beam without a return).
///
/// A run begins and ends with moving beams. It goes over beams without a return or without evidence while
/// they take no more than a body's narrow side, and over any single beam, if the object's surface goes on
/// behind at about the range it had. Then:
/// - it is dropped unless the chance that all its moving beams are background, the product of their static
///   rates, is small: one beam needs the evidence of some fifty cycles, two of five each, three of what it takes to be
///   free at all;
/// - it is dropped if the widest thing that would take no more beams is thinner than an object may be: so
///   it takes four beams of one degree at 1 m, and one at 3 m;
/// - it is widened over beams without evidence on which its surface goes on: the side of the object that is
///   too near to the background to be sure; and over beams without a return, which may have met it.
pub(super) fn moving_runs(
    turn: &Turn,
    verdicts: &[Option<Verdict>],
    within: Range<usize>,
    smallest_object_m: f64,
) -> Vec<MovingRun> {
    let look = Look { turn, verdicts, within };
    let mut runs: Vec<MovingRun> = Vec::new();
    for beam in look.within.clone() {
        if look.moving(beam).is_none() {
            continue;
        }
        match runs.last_mut() {
            Some(run) if look.is_bridged(run.beams.end - 1, beam) => run.beams.end = beam + 1,
            _ => runs.push(MovingRun { beams: beam..beam + 1 }),
        }
    }
    runs.retain(|run| look.is_object(&run.beams, smallest_object_m));
    let mut floor = look.within.start;
    for position in 0..runs.len() {
        let ceiling = runs.get(position + 1).map_or(look.within.end, |next| next.beams.start);
        let widened = look.widened(&runs[position].beams, floor..ceiling);
        floor = widened.end;
        runs[position].beams = widened;
    }
    runs
}

struct Look<'a> {
    turn: &'a Turn,
    verdicts: &'a [Option<Verdict>],
    within: Range<usize>,
}

impl Look<'_> {
    fn met(&self, beam: usize) -> Option<&Return> {
        self.turn.beams.get(beam)?.met.as_ref()
    }

    fn range_m(&self, beam: usize) -> Option<f64> {
        self.met(beam).map(|met| f64::from(met.range_m))
    }

    /// The static rate of a moving beam. A lone beam between a nearer and a farther surface is none: it
    /// may have met the edge of the one and then the other, and averages the two.
    fn moving(&self, beam: usize) -> Option<f64> {
        let Some(Verdict::Moving { static_rate }) = self.verdicts[beam] else { return None };
        let met = self.met(beam)?;
        let step_m = |offset| {
            let neighbour = self.met(self.turn.neighbour(beam, offset)?)?;
            let step_m = f64::from(neighbour.range_m) - f64::from(met.range_m);
            (!self.turn.is_one_surface(met, neighbour)).then_some(step_m)
        };
        match (step_m(-1), step_m(1)) {
            (Some(right_m), Some(left_m)) if right_m * left_m < 0.0 => None,
            _ => Some(static_rate),
        }
    }

    /// Whether the object goes on from beam `from` to beam `to`, both moving.
    fn is_bridged(&self, from: usize, to: usize) -> bool {
        let (Some(from_m), Some(to_m)) = (self.range_m(from), self.range_m(to)) else {
            return false;
        };
        let between = from + 1..to;
        if (from_m - to_m).abs() > LARGEST_STEP_M {
            return false;
        }
        let near_m = from_m.min(to_m);
        let says_nothing = |beam: usize| match self.verdicts[beam] {
            None | Some(Verdict::Unsure | Verdict::Unseen) => true,
            // A beam on the object that is no lone mixed one, or background; a moving one that was left out.
            Some(Verdict::Moving { .. }) => true,
            Some(Verdict::Background) => false,
        } && self.range_m(beam).is_none_or(|range_m| range_m <= near_m + LARGEST_STEP_M);
        between.len() <= 1
            || (between.len() as f64 * self.turn.step_rad * near_m <= WIDEST_BRIDGE_M
                && between.clone().all(says_nothing))
    }

    fn is_object(&self, beams: &Range<usize>, smallest_object_m: f64) -> bool {
        let (mut chance, mut range_sum_m, mut moving) = (1.0, 0.0, 0.0);
        for beam in beams.clone() {
            if let (Some(static_rate), Some(range_m)) = (self.moving(beam), self.range_m(beam)) {
                chance *= static_rate;
                range_sum_m += range_m;
                moving += 1.0;
            }
        }
        let widest_m = (beams.len() + 1) as f64 * self.turn.step_rad * range_sum_m / moving;
        chance <= MOST_CHANCE_OF_BACKGROUND && widest_m >= smallest_object_m
    }

    /// The run and what of its surface beside it, between the places `limits`, has no evidence.
    fn widened(&self, beams: &Range<usize>, limits: Range<usize>) -> Range<usize> {
        let goes_on = |from: usize, to: usize| {
            let Some(from_m) = self.range_m(from) else { return false };
            let taken_m = from.abs_diff(to) as f64 * self.turn.step_rad * from_m;
            let Some(to_m) = self.range_m(to) else { return taken_m <= WIDEST_BRIDGE_M };
            let largest_step_m = match self.verdicts[to] {
                // A beam on the object's side, seen grazingly, looks like one between two surfaces.
                Some(Verdict::Moving { .. }) => LARGEST_STEP_M,
                Some(Verdict::Unsure | Verdict::Unseen) => WIDEST_BRIDGE_M,
                Some(Verdict::Background) | None => return false,
            };
            taken_m <= WIDEST_BRIDGE_M && (from_m - to_m).abs() <= largest_step_m
        };
        let (first, last) = (beams.start, beams.end - 1);
        let mut widened = beams.clone();
        while widened.start > limits.start && goes_on(first, widened.start - 1) {
            widened.start -= 1;
        }
        while widened.end < limits.end && goes_on(last, widened.end) {
            widened.end += 1;
        }
        widened
    }
}

#[cfg(test)]
mod tests;
