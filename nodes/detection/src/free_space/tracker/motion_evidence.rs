//! What the history of an object says of its motion.

use std::ops::Range;

use nalgebra::{Point2, distance};

use super::super::deskewed_scan::DeskewedScan;
use super::object::TrackedObject;
use super::sighting::{History, Side, Sighting, Space};

/// An object has travelled when it is farther from where it was than the errors of both places, by so much: more than the
/// centroid of a standing person sways, and less than a slow walker goes in a second.
pub(crate) const TRAVELLED_M: f64 = 0.2;
/// Sightings that motion is concluded from, at least: with three of them an object that came into sight beside another
/// could pass for it.
pub(crate) const LEAST_SIGHTINGS: usize = 4;
/// ... which last for so long: what moves so far at once is another object that came into sight.
const SHORTEST_MS: u32 = 350;
/// The path from sighting to sighting may be longer than the displacement by this factor: what merely sways goes back.
const MOST_DETOUR: f64 = 1.5;
/// A displacement counts only above this share of what the platform goes past the object: from another side another part
/// of a static object is seen.
const SHARE_OF_PASSING: f64 = 0.5;
/// A step may be ahead of an even pace by this share of the displacement: of two steps one may be a stride and the other
/// a rest, and more so of the four sightings that there are at least.
const MOST_AHEAD: f64 = 0.25;
/// In free space an object that does not travel counts as moving for so long, on a platform that moves.
pub(crate) const LONGEST_DOUBT_MS: u32 = 2_000;
/// An object of fewer returns is too little to go by before it has travelled: one range that is off.
const LEAST_RETURNS: usize = 2;

/// How sure it is that what is in free space moves, on a platform that moves itself.
///
/// From a static platform the evidence of free space is exact to the noise of ranges. From a moving one it is not: poses
/// are off, the scanner tilts, and a chair's leg that was missed from there is hit from here. Such errors have other
/// background near by, and they stay where they are.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum MotionEvidence {
    /// It has travelled: it moves, and goes on to when it is lost from sight.
    Travelled,
    /// The space around it is empty, and it has not stood for long: it moves as long as it is seen.
    InEmptySpace,
    /// It is most likely background.
    Insufficient,
}

/// What an object shows by the beams of a run; `is_in_clutter` says whether background is near them.
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

/// Whether a run is too narrow to go by before it has travelled.
///
/// What takes less than the error of a bearing may have been passed at its side by every ray that was taken to show
/// its place free. However fine the steps of a scanner are, its poses turn all of its bearings together, so that
/// several returns are no better than one.
fn is_too_narrow(scan: &DeskewedScan, run: &Range<usize>) -> bool {
    let beams = scan.beams.get(run.clone()).unwrap_or_default();
    let returns = beams.iter().filter(|beam| beam.hit.is_some()).count();
    let error_rad = beams.iter().map(|beam| beam.bearing_error_rad).fold(0.0, f64::max);
    returns < LEAST_RETURNS || returns as f64 * scan.step_rad < error_rad
}

/// Whether the object has travelled over the last second. What is background by all of its returns has not.
pub(crate) fn travels(history: &History, platform_moves: bool) -> bool {
    history.len() >= LEAST_SIGHTINGS
        && history.duration_ms() >= SHORTEST_MS
        && history.last().space != Space::Background
        && excess_m(history) >= TRAVELLED_M
        && history.path_m() <= MOST_DETOUR * history.displacement_m()
        && is_own_motion(history, platform_moves)
        && visible_ends_travel(history)
}

/// Whether the object is elsewhere than it was, for all that is known of the errors, and may travel.
pub(crate) fn is_under_way(history: &History, platform_moves: bool) -> bool {
    excess_m(history) > 0.0 && is_own_motion(history, platform_moves)
}

/// How much farther the object is from where it was than errors and the platform's motion explain.
fn excess_m(history: &History) -> f64 {
    let errors_m = history.first().error_m.hypot(history.last().error_m);
    history.displacement_m() - errors_m - SHARE_OF_PASSING * passing_m(history)
}

/// How far the platform has gone across its line of sight to the object. Along it, it sees the same side all the time:
/// who walks ahead of a robot that follows him is displaced as much as the robot is.
fn passing_m(history: &History) -> f64 {
    let line_m = history.last().centroid_m - history.last().platform_m;
    let across_m2 = history.platform_displacement_m().perp(&line_m).abs();
    if line_m.norm() > 0.0 { across_m2 / line_m.norm() } else { 0.0 }
}

/// Whether it is not the motion of the platform that shows another part of a static object in each scan: the object goes
/// step by step, and nothing hides a part of it where only its displacement tells that it moves.
fn is_own_motion(history: &History, platform_moves: bool) -> bool {
    let is_doubtful = |seen: &Sighting| seen.space != Space::Free && seen.is_partly_hidden();
    !platform_moves || (is_gradual(history) && !history.iter().any(is_doubtful))
}

/// Whether the displacement was made step by step. In one leap nobody comes so far: that is another object, or another
/// part of it, that came into sight.
fn is_gradual(history: &History) -> bool {
    let displacement_m = history.displacement_m();
    let duration_ms = f64::from(history.duration_ms().max(1));
    history.steps().all(|(from, to)| {
        let time_share = f64::from(to.now_ms.saturating_sub(from.now_ms)) / duration_ms;
        let step_m = distance(&from.centroid_m, &to.centroid_m);
        step_m <= (time_share + MOST_AHEAD) * displacement_m
    })
}

/// Whether the ends of the object have come as far as its centroid must, each that was seen at first and is now; one of
/// them was. The centroid of what something else uncovers, going by, moves as well; the end that is seen stays. In free
/// space nothing static is uncovered.
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
