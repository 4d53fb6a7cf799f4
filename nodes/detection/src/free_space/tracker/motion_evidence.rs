//! The evidence that an object moves, from its history.

use std::ops::Range;

use nalgebra::{Point2, distance};

use super::super::deskewed_scan::DeskewedScan;
use super::object::TrackedObject;
use super::sighting::{History, Side, Sighting, Space};

/// An object has travelled if its displacement exceeds the errors of both positions by so much: more than the
/// centroid of a standing person sways, and less than a slow walker moves in a second.
pub(crate) const TRAVELLED_M: f64 = 0.2;
/// The least number of sightings to infer motion: with three of them an object that became visible beside another
/// could be taken for it.
pub(crate) const LEAST_SIGHTINGS: usize = 4;
/// ... over at least this time: a displacement at once is another object that became visible.
const SHORTEST_MS: u32 = 350;
/// The path from sighting to sighting may be longer than the displacement by this factor: an object that sways returns.
const MOST_DETOUR: f64 = 1.5;
/// A displacement counts only above this share of the platform's motion past the object: from another side another part
/// of a static object is visible.
const SHARE_OF_PASSING: f64 = 0.5;
/// A step may exceed that of a uniform motion by this share of the displacement: a person's leg moves and rests in turn,
/// and there may be only four sightings.
const MOST_AHEAD: f64 = 0.25;
/// In free space an object that does not travel counts as moving for so long, on a platform that moves.
pub(crate) const LONGEST_DOUBT_MS: u32 = 2_000;
/// An object with fewer returns does not count before it has travelled: it may be one wrong range.
const LEAST_RETURNS: usize = 2;

/// The evidence that an object in free space moves, on a moving platform.
///
/// On a static platform the evidence of free space is exact to the noise of ranges. On a moving one it is not: poses
/// have errors, the scanner tilts, and a chair's leg is missed from one position and hit from another. Such false detections
/// have other background near them, and they do not move.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum MotionEvidence {
    /// It has travelled: it moves, and keeps its zone when it is not visible.
    Travelled,
    /// The space around it is empty, and it has not been at rest for long: it counts as moving while it is visible.
    InEmptySpace,
    /// It is most likely background.
    Insufficient,
}

/// The evidence of an object with a run of beams; `is_in_clutter` says whether background is near them.
pub(crate) fn motion_evidence(
    object: &TrackedObject,
    scan: &DeskewedScan,
    run: &Range<usize>,
    is_in_clutter: impl FnOnce() -> bool,
) -> MotionEvidence {
    if object.has_travelled() {
        MotionEvidence::Travelled
    } else if object.in_free_space_ms() > LONGEST_DOUBT_MS
        || is_too_narrow(scan, run)
        || is_in_clutter()
    {
        MotionEvidence::Insufficient
    } else {
        MotionEvidence::InEmptySpace
    }
}

/// Whether a run is too narrow to count before it has travelled.
///
/// If an object is narrower than the error of a bearing, every ray that seemed to show its place free may have passed
/// beside it. However fine the steps of a scanner are, an error of the pose turns all bearings together, so that
/// several returns are no better than one.
fn is_too_narrow(scan: &DeskewedScan, run: &Range<usize>) -> bool {
    let beams = scan.beams.get(run.clone()).unwrap_or_default();
    let returns = beams.iter().filter(|beam| beam.hit.is_some()).count();
    let error_rad = beams.iter().map(|beam| beam.bearing_error_rad).fold(0.0, f64::max);
    returns < LEAST_RETURNS || returns as f64 * scan.step_rad < error_rad
}

/// Whether the object has travelled over the last second. An object whose returns are all background has not.
pub(crate) fn travels(history: &History, platform_moves: bool) -> bool {
    history.len() >= LEAST_SIGHTINGS
        && history.duration_ms() >= SHORTEST_MS
        && history.last().space != Space::Background
        && excess_m(history) >= TRAVELLED_M
        && history.path_m() <= MOST_DETOUR * history.displacement_m()
        && is_own_motion(history, platform_moves)
        && visible_ends_travel(history)
}

/// Whether the object was displaced by more than the errors, and may travel.
pub(crate) fn is_under_way(history: &History, platform_moves: bool) -> bool {
    excess_m(history) > 0.0 && is_own_motion(history, platform_moves)
}

/// The displacement of the object beyond the errors and the effect of the platform's motion.
fn excess_m(history: &History) -> f64 {
    let errors_m = history.first().error_m.hypot(history.last().error_m);
    history.displacement_m() - errors_m - SHARE_OF_PASSING * passing_m(history)
}

/// The motion of the platform across its line of sight to the object. With motion along it, the same side stays visible:
/// a person who is followed by the robot is displaced as much as the robot.
fn passing_m(history: &History) -> f64 {
    let line_m = history.last().centroid_m - history.last().platform_m;
    let across_m2 = history.platform_displacement_m().perp(&line_m).abs();
    if line_m.norm() > 0.0 { across_m2 / line_m.norm() } else { 0.0 }
}

/// Whether the displacement is the object's own, and not due to other parts of a static object that become visible from the
/// moving platform: it is gradual, and no part of the object is hidden if there is no other evidence of motion.
fn is_own_motion(history: &History, platform_moves: bool) -> bool {
    let is_doubtful = |seen: &Sighting| seen.space != Space::Free && seen.is_partly_hidden();
    !platform_moves || (is_gradual(history) && !history.iter().any(is_doubtful))
}

/// Whether the displacement is gradual. A displacement in one step is another object, or another part of it, that became
/// visible.
fn is_gradual(history: &History) -> bool {
    let displacement_m = history.displacement_m();
    let duration_ms = f64::from(history.duration_ms().max(1));
    history.steps().all(|(from, to)| {
        let time_share = f64::from(to.now_ms.saturating_sub(from.now_ms)) / duration_ms;
        let step_m = distance(&from.centroid_m, &to.centroid_m);
        step_m <= (time_share + MOST_AHEAD) * displacement_m
    })
}

/// Whether each end of the object that was visible at first and is now has moved as far as required of the centroid; at
/// least one was. The centroid of a static object that another one uncovers moves as well; its visible end does not. In
/// free space no static object is uncovered.
fn visible_ends_travel(history: &History) -> bool {
    let is_doubtful =
        |seen: &Sighting| seen.space != Space::Free && seen.sides.contains(&Side::BehindOther);
    if !history.iter().any(is_doubtful) {
        return true;
    }
    let end_m = |seen: &Sighting, side: usize| -> Option<Point2<f64>> {
        (seen.sides[side] != Side::BehindOther).then_some(seen.ends_m[side])
    };
    let displacement_m =
        |side: usize| Some(distance(&end_m(history.first(), side)?, &end_m(history.last(), side)?));
    let least_m = [0, 1].into_iter().filter_map(displacement_m).reduce(f64::min);
    least_m.is_some_and(|least_m| least_m >= TRAVELLED_M)
}

#[cfg(test)]
mod tests;
