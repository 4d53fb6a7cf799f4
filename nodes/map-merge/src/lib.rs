//! Two saved maps of one place, of another day or another robot: where the second one lies in the first, what changed between them, and
//! both as one map.
//!
//! | file | the idea |
//! |---|---|
//! | `saved_map` | a map as its file has it, and as it is made ready: thinned out, with normals, level |
//! | `level`, `heading`, `height` | up by the level surfaces; the yaws by the walls; the heights by the floors |
//! | `plan`, `search` | a map from above; every shift of the other upon it, by branch and bound |
//! | `seen_space` | where a map was seen through, by the views that it was seen from |
//! | `nearby` | whether a map has the same surface near a place |
//! | `agreement` | what speaks for a place, and what against it |
//! | `alignment` | the places, each registered; the decision |
//! | `change` | what has gone, and what was added |
//! | `merged` | both as one |
//!
//! No ROS, no files, no clock, no random numbers: the same maps give the same result to the bit.

mod agreement;
mod alignment;
mod change;
mod error;
mod heading;
mod height;
mod level;
mod merged;
mod nearby;
mod plan;
mod saved_map;
mod search;
mod seen_space;

use estimation::Executor;
use nalgebra::Isometry3;

pub use agreement::Agreement;
pub use alignment::{Alignment, Candidate};
pub use change::{Changes, Group};
pub use error::MergeError;
pub use saved_map::SavedMap;

use alignment::Pair;
use change::{Side, one_sided};
use saved_map::PreparedMap;

/// Two maps as one.
#[derive(Clone, PartialEq, Debug)]
pub struct Merge {
    /// Where the second map lies in the first.
    pub alignment: Alignment,
    /// What changed from the first to the second.
    pub changes: Changes,
    /// Both as one, in the first map's frame.
    pub merged: SavedMap,
}

/// Merges the second map into the first, which is the older one. With a guess of where the second lies in the first no other place is
/// looked for. `is_over` is asked now and then whether to end the work.
///
/// # Errors
/// When the maps do not fit, fit in two places alike, or have too little to be aligned by.
pub fn merge(
    a: &SavedMap,
    b: &SavedMap,
    guess: Option<&Isometry3<f64>>,
    executor: &dyn Executor,
    is_over: &dyn Fn() -> bool,
) -> Result<Merge, MergeError> {
    let prepared = [prepare(a, 0, executor)?, prepare(b, 1, executor)?];
    if is_over() {
        return Err(MergeError::Interrupted);
    }
    let pair = Pair::new([a, b], [&prepared[0], &prepared[1]], executor)?;
    let alignment = pair.align(guess, executor, is_over)?;
    let a_from_b = &alignment.a_from_b;
    let (of_a, of_b) = (
        Side { map: a, a_from_own: Isometry3::identity() },
        Side { map: b, a_from_own: *a_from_b },
    );
    let a_level = prepared[0].level_from_map;
    let b_level = prepared[1].level_from_map * a_from_b.inverse();
    let no_edge = MergeError::Edge { edge_m: a.edge_m.max(b.edge_m) };
    let only_a = one_sided(&of_a, &of_b, &pair.b.seen, &b_level).ok_or(no_edge.clone())?;
    let only_b = one_sided(&of_b, &of_a, &pair.a.seen, &a_level).ok_or(no_edge.clone())?;
    let mut changes = Changes::default();
    *(if only_a.is_known { &mut changes.gone } else { &mut changes.only_in_a }) = only_a.groups;
    *(if only_b.is_known { &mut changes.added } else { &mut changes.only_in_b }) = only_b.groups;
    if is_over() {
        return Err(MergeError::Interrupted);
    }
    let gone = changes.gone.iter().flat_map(|group| &group.points);
    let is_in_a = all_but(of_a.len(), gone.chain(&only_a.noise));
    let is_in_b = all_but(of_b.len(), only_b.noise.iter());
    let merged = merged::merged([&of_a, &of_b], [&is_in_a, &is_in_b]).ok_or(no_edge)?;
    Ok(Merge { alignment, changes, merged })
}

/// For each of a number of points, whether it is none of those.
fn all_but<'a>(count: usize, those: impl Iterator<Item = &'a usize>) -> Vec<bool> {
    let mut is_left = vec![true; count];
    for index in those {
        if let Some(is_left) = is_left.get_mut(*index) {
            *is_left = false;
        }
    }
    is_left
}

fn prepare(
    map: &SavedMap,
    index: usize,
    executor: &dyn Executor,
) -> Result<PreparedMap, MergeError> {
    if map.points.points_m.is_empty() {
        return Err(MergeError::Empty { map: index });
    }
    let prepared = PreparedMap::new(map, executor)?;
    let upright_m2 = prepared.upright_m2();
    if upright_m2 < alignment::LEAST_SAME_M2 {
        return Err(MergeError::NoWalls {
            map: index,
            upright_m2,
            least_m2: alignment::LEAST_SAME_M2,
        });
    }
    Ok(prepared)
}
