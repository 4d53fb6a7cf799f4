//! The segments of a scan that may be objects: those in observed free space, and isolated ones.
//!
//! An isolated segment is narrow, and at least at one of its sides the next return is farther away. It may be an object
//! although the space around it is unknown: a person who was in front of the scanner from the first scan on and walks
//! away reaches places that were hidden behind the person.

use std::ops::Range;

use nalgebra::{Point2, Vector2, distance};

use super::super::deskewed_scan::{DeskewedScan, LARGEST_STEP_M};
use super::super::evidence::ReturnClass;
use super::sighting::{Side, Sighting, Space};

/// A wider segment is furniture, or a part of the room: two persons side by side are narrower.
const WIDEST_M: f64 = 1.0;
/// The most beams without a return within one surface: black trousers.
const MOST_EMPTY_BEAMS: usize = 3;
/// The end of a segment is visible if a gap of this width without returns is beside it.
const SEEN_PAST_M: f64 = 0.1;

/// A segment of a scan that may be an object.
#[derive(Clone, Debug)]
pub(crate) struct Segment {
    /// From its first beam to the one after its last.
    pub(crate) beams: Range<usize>,
    /// Whether it is isolated from its surroundings.
    pub(crate) is_isolated: bool,
    /// Its sighting.
    pub(crate) sighting: Sighting,
}

/// The segments of a scan, with the class of each beam and the runs of those in free space, by their first beams. An
/// isolated segment and the runs that it overlaps are one.
pub(crate) fn segments(
    scan: &DeskewedScan,
    classes: &[Option<ReturnClass>],
    runs: &[Range<usize>],
    now_ms: u32,
) -> Vec<Segment> {
    let view = View { scan, classes, now_ms };
    let isolated = view.surfaces().into_iter().filter(|beams| view.is_isolated(beams));
    let isolated = isolated.map(|beams| (beams, true, false));
    let in_free_space = runs.iter().map(|beams| (beams.clone(), false, true));
    let mut parts: Vec<(Range<usize>, bool, bool)> = isolated.chain(in_free_space).collect();
    parts.sort_by_key(|(beams, ..)| (beams.start, beams.end));
    let mut joined: Vec<(Range<usize>, bool, bool)> = Vec::with_capacity(parts.len());
    for part in parts {
        match joined.last_mut() {
            Some(last) if part.0.start < last.0.end => {
                last.0.end = last.0.end.max(part.0.end);
                last.1 |= part.1;
                last.2 |= part.2;
            }
            _ => joined.push(part),
        }
    }
    let segment = |(beams, is_isolated, is_in_free_space): (Range<usize>, bool, bool)| {
        let sighting = view.sighting(&beams, is_in_free_space)?;
        Some(Segment { beams, is_isolated, sighting })
    };
    joined.into_iter().filter_map(segment).collect()
}

struct View<'a> {
    scan: &'a DeskewedScan,
    classes: &'a [Option<ReturnClass>],
    now_ms: u32,
}

impl View<'_> {
    fn in_map_m(&self, beam: usize) -> Option<Point2<f64>> {
        self.scan.beams.get(beam)?.hit.map(|hit| hit.in_map_m)
    }

    /// The runs of beams whose returns follow one another without a larger step than the surface of one object has, over
    /// few beams without a return.
    fn surfaces(&self) -> Vec<Range<usize>> {
        let mut runs: Vec<Range<usize>> = Vec::new();
        for beam in 0..self.scan.beams.len() {
            let Some(in_map_m) = self.in_map_m(beam) else { continue };
            let goes_on = |run: &Range<usize>| {
                let is_near = |last_m| distance(&last_m, &in_map_m) <= LARGEST_STEP_M;
                self.in_map_m(run.end - 1).is_some_and(is_near)
                    && beam - run.end <= MOST_EMPTY_BEAMS
            };
            match runs.last_mut() {
                Some(run) if goes_on(run) => run.end = beam + 1,
                _ => runs.push(beam..beam + 1),
            }
        }
        runs
    }

    /// The width of the gap without returns between the returns of two beams, at the range of the first.
    fn empty_m(&self, beam: usize, other: usize) -> f64 {
        let empty = beam.abs_diff(other).saturating_sub(1) as f64;
        let range_m = self.scan.beams.get(beam).and_then(|beam| beam.hit).map(|hit| hit.range_m);
        empty * self.scan.step_rad * range_m.map_or(0.0, f64::from)
    }

    fn is_isolated(&self, beams: &Range<usize>) -> bool {
        let ends_m = self.in_map_m(beams.start).zip(self.in_map_m(beams.end - 1));
        let is_narrow = ends_m.is_some_and(|(right, left)| distance(&right, &left) <= WIDEST_M);
        // At the ends of the scan the space beside it is unknown.
        let is_inside = beams.start > 0 && beams.end < self.scan.beams.len();
        is_narrow && is_inside && self.sides(beams.start, beams.end - 1).contains(&Side::Open)
    }

    /// What is beside the outermost returns of a segment.
    fn sides(&self, first: usize, last: usize) -> [Side; 2] {
        let has_return = |beam: &usize| self.in_map_m(*beam).is_some();
        let right = (0..first).rev().find(has_return);
        let left = (last + 1..self.scan.beams.len()).find(has_return);
        [self.side(first, right), self.side(last, left)]
    }

    /// What is beside the return of beam `edge`, where the next return is that of beam `other`.
    fn side(&self, edge: usize, other: Option<usize>) -> Side {
        let range_m = |beam: usize| self.scan.beams.get(beam)?.hit.map(|hit| hit.range_m);
        let Some(other) = other else { return Side::Open };
        if range_m(edge) < range_m(other) || self.empty_m(edge, other) >= SEEN_PAST_M {
            Side::Open
        } else if self.classes.get(other) == Some(&Some(ReturnClass::Background)) {
            Side::BehindBackground
        } else {
            Side::BehindOther
        }
    }

    /// The sighting of a segment; `None` if it has no return.
    fn sighting(&self, beams: &Range<usize>, is_in_free_space: bool) -> Option<Sighting> {
        let has_return = |beam: &usize| self.in_map_m(*beam).is_some();
        let first = beams.clone().find(has_return)?;
        let last = beams.clone().rev().find(has_return)?;
        let (mut sum_m, mut returns, mut error_m) = (Vector2::zeros(), 0_usize, 0.0_f64);
        for (_, hit) in self.scan.returns_of_object(beams.clone()) {
            sum_m += hit.in_map_m.coords;
            error_m = error_m.max(hit.error_m);
            returns += 1;
        }
        let mut classes = self.classes.get(beams.clone())?.iter().flatten();
        let is_free = |class: &ReturnClass| matches!(class, ReturnClass::InFreeSpace { .. });
        let space = if is_in_free_space {
            Space::Free
        } else if classes.clone().any(is_free) {
            Space::PartlyFree
        } else if classes.all(|class| *class == ReturnClass::Background) {
            Space::Background
        } else {
            Space::Unknown
        };
        Some(Sighting {
            now_ms: self.now_ms,
            centroid_m: Point2::from(sum_m / returns as f64),
            ends_m: [self.in_map_m(first)?, self.in_map_m(last)?],
            sides: self.sides(first, last),
            platform_m: self.scan.beams.first()?.origin_m,
            error_m,
            returns,
            space,
        })
    }
}

#[cfg(test)]
mod tests;
