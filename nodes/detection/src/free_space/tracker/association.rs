//! Which of the objects seen before is which of the segments seen now.

use estimation::assignment::assign;
use nalgebra::distance;

use super::super::deskewed_scan::{DeskewedScan, LARGEST_STEP_M};
use super::object::TrackedObject;
use super::segments::Segment;
use super::sighting::{Sighting, Space};

/// Faster than this nobody goes indoors: a run.
pub(crate) const MAX_SPEED_M_PER_S: f64 = 3.0;
/// What leaving an object without a segment costs. Pairs cost less: a half at most for an object of the last scan, another
/// half for one that was lost before.
const UNASSIGNED_COST: f64 = 1.0;

/// For each object the segment that shows it, so that the sum of the squared distances in units of their gates is least.
/// One that was seen in the last scan goes before one that was lost.
pub(crate) fn associate(objects: &[TrackedObject], segments: &[Segment]) -> Vec<Option<usize>> {
    assign(objects.len(), segments.len(), UNASSIGNED_COST, |object, segment| {
        let object = &objects[object];
        let share = gate_share(object, &segments[segment].sighting);
        let lost = if object.is_lost() { 1.0 } else { 0.0 };
        share.map_or(f64::INFINITY, |share| 0.5 * (share * share + lost))
    })
}

/// The segment into which an object has gone that no segment shows: the nearest whose surface is no farther than a
/// step from where the object was. The legs of a walker part and join with every step.
pub(crate) fn merged_into(
    object: &TrackedObject,
    scan: &DeskewedScan,
    segments: &[Segment],
) -> Option<usize> {
    let was_m = object.last().centroid_m;
    let reaches = |segment: &Segment| {
        let beams = scan.beams.get(segment.beams.clone()).unwrap_or_default();
        let mut hits = beams.iter().filter_map(|beam| beam.hit);
        hits.any(|hit| distance(&hit.in_map_m, &was_m) <= LARGEST_STEP_M)
    };
    let near = segments.iter().enumerate().filter_map(|(index, segment)| {
        gate_share(object, &segment.sighting).filter(|_| reaches(segment))?;
        Some((distance(&was_m, &segment.sighting.centroid_m), index))
    });
    near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, index)| index)
}

/// The distance of what is seen from where an object was, as a share of the largest that one object can have; `None`
/// beyond, and where one cannot be the other by what is known of the space.
///
/// The centroid shifts by the errors of both sightings, by half of what is seen more or less of the object, and by its
/// motion.
fn gate_share(object: &TrackedObject, seen: &Sighting) -> Option<f64> {
    let last = object.last();
    let is_possible = match last.space {
        // In a place that is not known anything may have come into sight meanwhile.
        _ if object.is_lost() => matches!(seen.space, Space::Free | Space::PartlyFree),
        // Background was there before what is in free space.
        Space::Free => seen.space != Space::Background,
        Space::PartlyFree | Space::Unknown | Space::Background => true,
    };
    let elapsed_s = f64::from(seen.now_ms.saturating_sub(last.now_ms)) * 1e-3;
    let shift_m = 0.5 * (seen.width_m() - last.width_m()).abs();
    let gate_m = last.error_m + seen.error_m + shift_m + MAX_SPEED_M_PER_S * elapsed_s;
    let share = distance(&last.centroid_m, &seen.centroid_m) / gate_m;
    (is_possible && share <= 1.0).then_some(share)
}
