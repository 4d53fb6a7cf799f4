//! The tracker of objects in scans.
//!
//! | module | what |
//! |---|---|
//! | `segments` | segments of a scan that may be objects |
//! | `sighting` | an object in one scan, and its sightings over the last second |
//! | `association` | the assignment of segments to objects |
//! | `object` | an object with its history |
//! | `motion_evidence` | whether it has travelled, whether it may be travelling, the evidence that it moves |

mod association;
mod motion_evidence;
mod object;
mod segments;
mod sighting;

use std::ops::Range;

use nalgebra::Point2;

use super::deskewed_scan::DeskewedScan;
use super::evidence::ReturnClass;
use association::{associate, merged_into};
use segments::{Segment, segments};

pub(super) use association::MAX_SPEED_M_PER_S;
pub(super) use motion_evidence::{MotionEvidence, motion_evidence};
pub(super) use object::TrackedObject;
pub(super) use sighting::MEMORY_MS;
#[cfg(test)]
pub(super) use sighting::{Side, Sighting, Space};

/// The objects of the last scans.
#[derive(Clone, Debug, Default)]
pub(super) struct Tracker {
    /// Those visible in the last scan, one for each of its segments, and then those that are not visible.
    objects: Vec<TrackedObject>,
    segments: Vec<Segment>,
    /// The time of the last scan.
    scan_ms: Option<u32>,
}

impl Tracker {
    /// Forgets all objects.
    pub(super) fn clear(&mut self) {
        self.objects.clear();
        self.segments.clear();
        self.scan_ms = None;
    }

    /// Adds a scan, with the class of each beam and the runs of those in free space.
    pub(super) fn update(
        &mut self,
        scan: &DeskewedScan,
        classes: &[Option<ReturnClass>],
        runs: &[Range<usize>],
        now_ms: u32,
        platform_moves: bool,
    ) {
        let segments = segments(scan, classes, runs, now_ms);
        let given = associate(&self.objects, &segments);
        let mut shown: Vec<Option<TrackedObject>> = vec![None; segments.len()];
        let mut unassigned = Vec::new();
        for (object, segment) in std::mem::take(&mut self.objects).into_iter().zip(given) {
            match segment {
                Some(segment) => shown[segment] = Some(object),
                None => unassigned.push(object),
            }
        }
        let mut lost = Vec::new();
        for mut object in unassigned {
            if let Some(segment) = merged_into(&object, scan, &segments) {
                // Of objects that were merged the longest history is kept.
                let duration_ms = object.history().duration_ms();
                let is_shorter =
                    |known: &TrackedObject| known.history().duration_ms() < duration_ms;
                if shown[segment].as_ref().is_none_or(is_shorter) {
                    shown[segment] = Some(object);
                }
            } else if object.lose(now_ms) {
                lost.push(object);
            }
        }
        let see = |(segment, object): (&Segment, Option<TrackedObject>)| match object {
            Some(mut object) => {
                object.see(segment.sighting, platform_moves);
                object
            }
            None => TrackedObject::new(segment.sighting),
        };
        self.objects = segments.iter().zip(shown).map(see).chain(lost).collect();
        self.segments = segments;
        self.scan_ms = Some(now_ms);
    }

    /// The beams of the isolated segments whose objects travel.
    pub(super) fn travelling(&self) -> impl Iterator<Item = Range<usize>> {
        self.isolated().filter(|(_, object)| object.travels_now()).map(|(beams, _)| beams)
    }

    /// The beams of the isolated segments whose objects have been displaced, or travel.
    pub(super) fn under_way(&self) -> impl Iterator<Item = Range<usize>> {
        let goes = |(_, object): &(Range<usize>, &TrackedObject)| {
            object.travels_now() || object.is_under_way()
        };
        self.isolated().filter(goes).map(|(beams, _)| beams)
    }

    fn isolated(&self) -> impl Iterator<Item = (Range<usize>, &TrackedObject)> {
        let shown = self.segments.iter().zip(&self.objects);
        let isolated = shown.filter(|(segment, _)| segment.is_isolated);
        isolated.map(|(segment, object)| (segment.beams.clone(), object))
    }

    /// The object of a run of beams of the last scan: of several the one with the longest history.
    pub(super) fn object_of(&self, run: &Range<usize>) -> Option<usize> {
        let overlaps =
            |segment: &Segment| segment.beams.start < run.end && run.start < segment.beams.end;
        let shown = self.segments.iter().zip(&self.objects).enumerate();
        shown
            .filter(|(_, (segment, _))| overlaps(segment))
            .max_by_key(|(index, (_, object))| {
                (object.history().duration_ms(), std::cmp::Reverse(*index))
            })
            .map(|(index, _)| index)
    }

    /// An object by its index among [`Tracker::objects_mut`].
    pub(super) fn object(&self, index: usize) -> Option<&TrackedObject> {
        self.objects.get(index)
    }

    /// All objects, including those that are not visible in the last scan.
    pub(super) fn objects_mut(&mut self) -> &mut [TrackedObject] {
        &mut self.objects
    }

    /// The time since the last scan.
    pub(super) fn elapsed_s(&self, now_ms: u32) -> f64 {
        self.scan_ms.map_or(0.0, |then_ms| f64::from(now_ms.saturating_sub(then_ms)) * 1e-3)
    }

    /// The distance of a place from the front of the nearest object with a zone.
    pub(super) fn distance_to_zones_m(&self, in_map_m: &Point2<f64>) -> f64 {
        let zones = self.objects.iter().filter_map(|object| object.zone.as_ref());
        zones.map(|zone| zone.distance_m(in_map_m)).fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests;
