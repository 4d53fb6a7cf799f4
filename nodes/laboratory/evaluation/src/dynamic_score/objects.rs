//! How each object fared: in how many cycles it was found and removed, and what of it is left in the map.

use serde::{Deserialize, Serialize};

use super::map_score::MapVoxels;
use super::tally::{ObjectTally, SceneTally, share};
use super::{FirstFound, RemovedPoints};

/// The score of one object.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct ObjectScore {
    /// The object's label in the truth.
    pub object_id: u16,
    /// What it is, where that is known.
    pub name: Option<String>,
    /// Cycles in which it was in view.
    pub cycles_in_view: usize,
    /// Of these, cycles in which it was found in a zone.
    pub cycles_found: usize,
    /// Of those in view, cycles in which it was removed, whether or not a zone held it.
    pub cycles_removed: usize,
    /// Of those in view, cycles in which it was found in a zone or removed: a zone is as wide as what the scanner
    /// meets, and what leaves the camera's view feet last is found by its track.
    pub cycles_found_or_removed: usize,
    /// `cycles_found_or_removed / cycles_in_view`; none of what was never in view.
    pub found_or_removed_share: Option<f64>,
    /// The first of the cycles in which it was found in a zone or removed.
    pub first_found: Option<FirstFound>,
    /// Its points over all scored cycles, those in which too little of it was in view included.
    pub points: RemovedPoints,
    /// Voxels of the map that this object touched and no static point ever did.
    pub own_voxels: usize,
    /// Of these, voxels that the map without removal holds.
    pub own_voxels_without_removal: usize,
    /// Of its own voxels, those that the final map still holds.
    pub own_voxels_left: usize,
    /// Each cycle in which it has a point.
    pub per_cycle: Vec<ObjectCycleScore>,
}

/// The score of one object in one cycle.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct ObjectCycleScore {
    /// The cycle's number.
    pub index: u32,
    /// Its points.
    pub points: RemovedPoints,
    /// Share of its points whose direction lies in a zone.
    pub share_in_zone: f64,
    /// The true bearing: azimuth of the mean of its points in the rig frame.
    pub azimuth_rad: f64,
    /// Whether enough of it was seen to count.
    pub in_view: bool,
    /// Whether it was in view and found.
    pub found: bool,
    /// Whether it was in view and removed.
    pub removed: bool,
}

/// The score of an object, of which `name` says what it is.
pub(super) fn object_score(
    object_id: u16,
    tally: &ObjectTally,
    name: Option<&String>,
    scene: &SceneTally,
    map: &MapVoxels,
) -> ObjectScore {
    let own = || tally.region.voxels().iter().filter(|key| !scene.contains(key));
    let cycles_that =
        |is: fn(&ObjectCycleScore) -> bool| tally.per_cycle.iter().filter(|&c| is(c)).count();
    let cycles_in_view = cycles_that(|cycle| cycle.in_view);
    let cycles_found_or_removed = cycles_that(ObjectCycleScore::is_found_or_removed);
    ObjectScore {
        object_id,
        name: name.cloned(),
        cycles_in_view,
        cycles_found: cycles_that(|cycle| cycle.found),
        cycles_removed: cycles_that(|cycle| cycle.removed),
        cycles_found_or_removed,
        found_or_removed_share: share(cycles_found_or_removed as u64, cycles_in_view as u64),
        first_found: FirstFound::of(&tally.per_cycle),
        points: RemovedPoints::sum(tally.per_cycle.iter().map(|cycle| cycle.points)),
        own_voxels: own().count(),
        own_voxels_without_removal: own().filter(|key| map.unfiltered.contains(key)).count(),
        own_voxels_left: own().filter(|key| map.filtered.contains(key)).count(),
        per_cycle: tally.per_cycle.clone(),
    }
}
