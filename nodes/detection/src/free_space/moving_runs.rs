//! Runs of moving beams: which of them are an object.

use std::ops::Range;

use super::deskewed_scan::{DeskewedScan, LARGEST_STEP_M, Return};
use super::evidence::ReturnClass;

/// The probability that all moving beams of a run are background must be below this.
const MOST_CHANCE_OF_BACKGROUND: f64 = 0.01;
/// Beams without a return, and returns without evidence, split an object only if they are wider than this:
/// about a body's narrow side.
const WIDEST_BRIDGE_M: f64 = 0.15;
/// Beams of one object, by their places in the scan.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct MovingRun {
    /// From its first beam to the one after its last.
    pub(super) beams: Range<usize>,
}

/// The runs among the beams `within` of a scan, one class a beam (`None` for a beam without a return).
///
/// A run begins and ends with moving beams. It goes over beams without a return or without evidence while
/// they are no wider than a body's narrow side, and over any single beam, if the object's surface continues
/// after them at about the same range. Then:
/// - it is dropped unless the probability that all its moving beams are background, the product of their static
///   rates, is small: one beam needs evidence of some fifty cycles, two beams of five each, three beams only the minimum
///   for free space;
/// - it is dropped if the widest object with so few beams is narrower than the smallest object: it needs four beams of one
///   degree at 1 m, and one at 3 m;
/// - it is widened over beams without evidence on which its surface continues: the side of the object that is
///   too near to the background; and over beams without a return, which may have hit it.
pub(super) fn moving_runs(
    scan: &DeskewedScan,
    classes: &[Option<ReturnClass>],
    within: Range<usize>,
    smallest_object_m: f64,
) -> Vec<MovingRun> {
    let view = ClassifiedScan { scan, classes, within };
    let mut runs: Vec<MovingRun> = Vec::new();
    for beam in view.within.clone() {
        if view.moving(beam).is_none() {
            continue;
        }
        match runs.last_mut() {
            Some(run) if view.is_bridged(run.beams.end - 1, beam) => run.beams.end = beam + 1,
            _ => runs.push(MovingRun { beams: beam..beam + 1 }),
        }
    }
    runs.retain(|run| view.is_object(&run.beams, smallest_object_m));
    let mut floor = view.within.start;
    for position in 0..runs.len() {
        let ceiling = runs.get(position + 1).map_or(view.within.end, |next| next.beams.start);
        let widened = view.widened(&runs[position].beams, floor..ceiling);
        floor = widened.end;
        runs[position].beams = widened;
    }
    runs
}

struct ClassifiedScan<'a> {
    scan: &'a DeskewedScan,
    classes: &'a [Option<ReturnClass>],
    within: Range<usize>,
}

impl ClassifiedScan<'_> {
    fn hit(&self, beam: usize) -> Option<&Return> {
        self.scan.beams.get(beam)?.hit.as_ref()
    }

    fn range_m(&self, beam: usize) -> Option<f64> {
        self.hit(beam).map(|hit| f64::from(hit.range_m))
    }

    /// The static rate of a moving beam. A single beam between a nearer and a farther surface has none: it
    /// may have hit the edge of both, so that its range is a mean of the two.
    fn moving(&self, beam: usize) -> Option<f64> {
        let Some(ReturnClass::InFreeSpace { background_rate }) = self.classes[beam] else {
            return None;
        };
        let hit = self.hit(beam)?;
        let step_m = |offset| {
            let neighbour = self.hit(self.scan.neighbour(beam, offset)?)?;
            let step_m = f64::from(neighbour.range_m) - f64::from(hit.range_m);
            (!self.scan.is_one_surface(hit, neighbour)).then_some(step_m)
        };
        match (step_m(-1), step_m(1)) {
            (Some(right_m), Some(left_m)) if right_m * left_m < 0.0 => None,
            _ => Some(background_rate),
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
        let is_undecided = |beam: usize| match self.classes[beam] {
            None | Some(ReturnClass::Ambiguous | ReturnClass::Unknown) => true,
            // A beam on the object that is neither a single mixed one nor background; a moving one that was left out.
            Some(ReturnClass::InFreeSpace { .. }) => true,
            Some(ReturnClass::Background) => false,
        } && self.range_m(beam).is_none_or(|range_m| range_m <= near_m + LARGEST_STEP_M);
        between.len() <= 1
            || (between.len() as f64 * self.scan.step_rad * near_m <= WIDEST_BRIDGE_M
                && between.clone().all(is_undecided))
    }

    fn is_object(&self, beams: &Range<usize>, smallest_object_m: f64) -> bool {
        let (mut chance, mut range_sum_m, mut moving) = (1.0, 0.0, 0.0);
        for beam in beams.clone() {
            if let (Some(background_rate), Some(range_m)) = (self.moving(beam), self.range_m(beam))
            {
                chance *= background_rate;
                range_sum_m += range_m;
                moving += 1.0;
            }
        }
        let widest_m = (beams.len() + 1) as f64 * self.scan.step_rad * range_sum_m / moving;
        chance <= MOST_CHANCE_OF_BACKGROUND && widest_m >= smallest_object_m
    }

    /// The run, widened within `limits` by the parts of its surface without evidence.
    fn widened(&self, beams: &Range<usize>, limits: Range<usize>) -> Range<usize> {
        let goes_on = |from: usize, to: usize| {
            let Some(from_m) = self.range_m(from) else { return false };
            let taken_m = from.abs_diff(to) as f64 * self.scan.step_rad * from_m;
            let Some(to_m) = self.range_m(to) else { return taken_m <= WIDEST_BRIDGE_M };
            let largest_step_m = match self.classes[to] {
                // A beam on the object's side at a grazing angle looks like one between two surfaces.
                Some(ReturnClass::InFreeSpace { .. }) => LARGEST_STEP_M,
                Some(ReturnClass::Ambiguous | ReturnClass::Unknown) => WIDEST_BRIDGE_M,
                Some(ReturnClass::Background) | None => return false,
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
