//! The measured values of a run, each a number that the run may lack.

use simulator::Scenario;

use super::cases::PAUSE_S;
use crate::experiments::figures::{RunFigures, Sighting};
use crate::experiments::positions::{Along, MEAN_OF_POINTS, PositionErrors, TRACK};
use geometry::Method;

pub(super) fn found(_: &Scenario, run: &RunFigures) -> Option<f64> {
    run.object()?.found_or_removed_share()
}

pub(super) fn in_zone(_: &Scenario, run: &RunFigures) -> Option<f64> {
    run.object()?.found_share()
}

/// By the position of the method: the track, or the mean of the points for a method without tracks.
pub(super) fn position(run: &RunFigures, along: Along) -> Option<PositionErrors> {
    let position_of = match run.method {
        Method::RecHv => MEAN_OF_POINTS,
        Method::FreeSpace => TRACK,
    };
    PositionErrors::of(&run.object()?.sightings, position_of, along)
}

/// By the thesis' own view, with a measured map of the empty scene as in the thesis.
pub(super) fn correlation(_: &Scenario, run: &RunFigures) -> Option<f64> {
    Some(run.map.correlation_with_measured?.front)
}

/// With the true surface, without the noise and gaps of a sensor.
pub(super) fn correlation_with_surface(_: &Scenario, run: &RunFigures) -> Option<f64> {
    Some(run.map.correlation?.front)
}

pub(super) fn removed(_: &Scenario, run: &RunFigures) -> Option<f64> {
    run.object()?.removed_share()
}

pub(super) fn ghost_voxels(_: &Scenario, run: &RunFigures) -> Option<f64> {
    Some(run.labels?.ghost_voxels as f64)
}

pub(super) fn without_zone(_: &Scenario, run: &RunFigures) -> Option<f64> {
    let without = run.cycles.iter().filter(|cycle| cycle.zones.is_empty()).count();
    (!run.cycles.is_empty()).then(|| without as f64 / run.cycles.len() as f64)
}

/// rec_hv has no tracks, so it has no identities.
pub(super) fn keeps_identities(_: &Scenario, run: &RunFigures) -> Option<f64> {
    let kept = if run.identity_switches == 0 { 1.0 } else { 0.0 };
    (run.method == Method::FreeSpace).then_some(kept)
}

/// A part of a crossing with a pause.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Phase {
    Before,
    During,
    After,
}

/// The share of the object's points in a phase that was removed.
pub(super) fn recall_in(scenario: &Scenario, run: &RunFigures, phase: Phase) -> Option<f64> {
    let [from_s, until_s] = pause_s(scenario)?;
    let is_in = |sighting: &&Sighting| match phase {
        Phase::Before => sighting.time_s < from_s,
        Phase::During => (from_s..=until_s).contains(&sighting.time_s),
        Phase::After => sighting.time_s > until_s,
    };
    let sightings = || run.object().into_iter().flat_map(|object| &object.sightings).filter(is_in);
    let points: u64 = sightings().map(|sighting| sighting.points).sum();
    let removed: u64 = sightings().map(|sighting| sighting.points_removed).sum();
    (points > 0).then(|| removed as f64 / points as f64)
}

/// Start and end of the first object's rest.
fn pause_s(scenario: &Scenario) -> Option<[f64; 2]> {
    let waypoints = &scenario.scene.objects.first()?.path.waypoints;
    let rests = |pair: &&[simulator::Waypoint]| {
        pair[0].pose == pair[1].pose && pair[1].time_s - pair[0].time_s >= 0.99 * PAUSE_S
    };
    waypoints.windows(2).find(rests).map(|pair| [pair[0].time_s, pair[1].time_s])
}
