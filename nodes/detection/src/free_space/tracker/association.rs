//! The assignment of the segments of a scan to the objects of earlier scans.

use estimation::assignment::assign;
use nalgebra::distance;

use super::super::deskewed_scan::{DeskewedScan, LARGEST_STEP_M};
use super::object::TrackedObject;
use super::segments::Segment;
use super::sighting::{Sighting, Space};

/// The highest speed of an object indoors: a running person.
pub(crate) const MAX_SPEED_M_PER_S: f64 = 3.0;
/// The cost of an object without a segment. Pairs cost less: one at most.
const UNASSIGNED_COST: f64 = 2.0;

/// The segment of each object, so that the sum of the squared distances in units of their gates is least.
pub(crate) fn associate(objects: &[TrackedObject], segments: &[Segment]) -> Vec<Option<usize>> {
    assign(objects.len(), segments.len(), UNASSIGNED_COST, |object, segment| {
        let share = gate_share(&objects[object], &segments[segment].sighting);
        share.map_or(f64::INFINITY, |share| share * share)
    })
}

/// The segment that an object without one was merged into: the nearest one whose surface is no farther than a
/// step from where the object was. The legs of a walking person split and merge with every step.
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

/// The distance of a sighting from the last one of an object, as a share of the largest possible; `None` if it is larger,
/// or if the classes of the two exclude that they are the same object.
///
/// The centroid shifts by the errors of both sightings, by half of the change of the visible width, and by the object's
/// motion.
fn gate_share(object: &TrackedObject, seen: &Sighting) -> Option<f64> {
    let last = object.last();
    let is_possible = match last.space {
        // In unknown space another object may have become visible meanwhile.
        _ if object.is_lost() => matches!(seen.space, Space::Free | Space::PartlyFree),
        // A return in free space cannot be earlier background.
        Space::Free => seen.space != Space::Background,
        Space::PartlyFree | Space::Unknown | Space::Background => true,
    };
    let elapsed_s = f64::from(seen.now_ms.saturating_sub(last.now_ms)) * 1e-3;
    let shift_m = 0.5 * (seen.width_m() - last.width_m()).abs();
    let gate_m = last.error_m + seen.error_m + shift_m + MAX_SPEED_M_PER_S * elapsed_s;
    let share = distance(&last.centroid_m, &seen.centroid_m) / gate_m;
    (is_possible && share <= 1.0).then_some(share)
}
