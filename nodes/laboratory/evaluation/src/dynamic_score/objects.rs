//! The score of each object: in how many cycles it was found and removed, and how much of it is left in the map.

use report::{FirstFound, ObjectCycleScore, ObjectScore};

use super::map_score::MapVoxels;
use super::tally::{ObjectTally, SceneTally, removed_points, share};

/// The score of an object called `name`.
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
        first_found: first_found(&tally.per_cycle),
        points: removed_points(tally.per_cycle.iter().map(|cycle| cycle.points)),
        own_voxels: own().count(),
        own_voxels_without_removal: own().filter(|key| map.unfiltered.contains(key)).count(),
        own_voxels_left: own().filter(|key| map.filtered.contains(key)).count(),
        per_cycle: tally.per_cycle.clone(),
    }
}

/// Of an object's cycles in their order; `None` for an object that was never found.
fn first_found(cycles: &[ObjectCycleScore]) -> Option<FirstFound> {
    let mut in_view = cycles.iter().filter(|cycle| cycle.in_view);
    let before = in_view.clone().take_while(|cycle| !cycle.is_found_or_removed()).count();
    let first = in_view.nth(before)?;
    Some(FirstFound { cycle: first.index, nth_in_view: before + 1 })
}
