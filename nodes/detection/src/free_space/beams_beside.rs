//! The beams that hit what moves, and are in no run that was found: in held zones, at feet, and at edges.

use geometry::{DynamicZone, ZoneSource};

use super::deskewed_scan::{DeskewedScan, Return};
use super::evidence::ReturnClass;

/// A walker's feet are no farther apart: half of a long stride.
const STEP_M: f64 = 0.75;
/// The width of a leg in trousers.
const LEG_M: f64 = 0.2;

/// Adds them to the beams of the runs.
pub(super) fn add_beams_beside(
    beams: &mut Vec<usize>,
    scan: &DeskewedScan,
    classes: &[Option<ReturnClass>],
    zones: &[DynamicZone],
) {
    beams.extend(beams_in_held_zones(scan, classes, zones));
    // Feet first: what is beside a foot is of the same person, too.
    beams.extend(feet_beside(scan, classes, beams));
    beams.extend(edges_beside(scan, classes, beams));
}

/// The beams that end where a zone is held, and not at background: the object was not found in this scan, and is there.
fn beams_in_held_zones(
    scan: &DeskewedScan,
    classes: &[Option<ReturnClass>],
    zones: &[DynamicZone],
) -> Vec<usize> {
    let held = |zone: &&DynamicZone| zone.source != ZoneSource::Measured;
    let spans: Vec<_> = zones.iter().filter(held).filter_map(|z| Some((z, z.returns?))).collect();
    let is_held = |hit: &Return| {
        let (distance_m, point) = (hit.distance_m(), hit.in_rig_m.cast::<f32>());
        spans.iter().any(|(zone, span)| {
            let span_m =
                f64::from(span.nearest_m) - hit.error_m..=f64::from(span.farthest_m) + hit.error_m;
            span_m.contains(&distance_m) && zone.contains(&point)
        })
    };
    let beams = scan.beams.iter().zip(classes).enumerate();
    beams
        .filter(|(_, (beam, class))| {
            *class != &Some(ReturnClass::Background) && beam.hit.as_ref().is_some_and(is_held)
        })
        .map(|(place, _)| place)
        .collect()
}

/// The beams in observed free space that end within a step of a return that moves: a foot that is too narrow to be an object by
/// itself.
fn feet_beside(
    scan: &DeskewedScan,
    classes: &[Option<ReturnClass>],
    moving: &[usize],
) -> Vec<usize> {
    let is_free = |class: &ReturnClass| matches!(class, ReturnClass::InFreeSpace { .. });
    beams_beside(scan, classes, moving, STEP_M, is_free)
}

/// The beams that end within a leg's width of a return that moves, wherever background is not known.
fn edges_beside(
    scan: &DeskewedScan,
    classes: &[Option<ReturnClass>],
    moving: &[usize],
) -> Vec<usize> {
    let is_undecided =
        |class: &ReturnClass| matches!(class, ReturnClass::Unknown | ReturnClass::Ambiguous);
    beams_beside(scan, classes, moving, LEG_M, is_undecided)
}

/// The beams of these classes that end within `within_m` of a return that moves.
fn beams_beside(
    scan: &DeskewedScan,
    classes: &[Option<ReturnClass>],
    moving: &[usize],
    within_m: f64,
    is_of_class: impl Fn(&ReturnClass) -> bool,
) -> Vec<usize> {
    let place_m = |beam: usize| scan.beams[beam].hit.map(|hit| hit.in_map_m);
    let moving_m: Vec<_> = moving.iter().filter_map(|beam| place_m(*beam)).collect();
    let is_beside = |beam: &usize| {
        classes[*beam].as_ref().is_some_and(&is_of_class)
            && place_m(*beam).is_some_and(|own_m| {
                moving_m.iter().any(|other_m| (own_m - other_m).norm() <= within_m)
            })
    };
    (0..classes.len()).filter(is_beside).collect()
}
