//! Which frames the map keeps, what it takes from them, and what it lets go (PL-SLAM section 2.1, local mapping).
//!
//! | module | rule |
//! |---|---|
//! | `config` | the numbers of all rules, with their sources |
//! | `decision` | when a frame becomes a keyframe |
//! | `creation` | features become landmarks by their depth |
//! | `triangulation` | others do when two keyframes see them |
//! | `fusion` | landmarks that are one become one |
//! | `culling` | recent landmarks that do not prove themselves go, and keyframes that say nothing new |
//! | `prediction` | where a keyframe should see a landmark |
//!
//! [`take_in`] does what a new keyframe brings about, but for the bundle adjustment.

mod config;
mod creation;
mod culling;
mod decision;
mod fusion;
pub(crate) mod prediction;
#[cfg(test)]
mod tests;
mod triangulation;

pub use config::KeyframingConfig;
pub use creation::create_measured;
pub use culling::{cull_keyframes, cull_recent, is_redundant};
pub use decision::{FollowedFrame, NotYet, decide};
pub use fusion::{FusedDuplicates, fuse_duplicates, fuse_into, fuse_lines_into};
pub use triangulation::triangulate;

use crate::map::{KeyframeId, Map};

/// The changes by a keyframe.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct TakenIn {
    /// Recent landmarks that did not prove themselves.
    pub culled: usize,
    /// Landmarks that its depths gave.
    pub created: usize,
    /// Points that other keyframes gave together with it.
    pub triangulated: usize,
    /// The result of fusing duplicate landmarks.
    pub fused: FusedDuplicates,
}

/// All that a keyframe that was just inserted brings about: recent landmarks are culled, new ones made, and those that are
/// one fused, in the order of ORB-SLAM2.
pub fn take_in(map: &mut Map, keyframe: KeyframeId, config: &KeyframingConfig) -> TakenIn {
    let culled = cull_recent(map, config);
    let created = create_measured(map, keyframe);
    let triangulated = triangulate(map, keyframe, config);
    let fused = fuse_duplicates(map, keyframe, config);
    TakenIn { culled, created, triangulated, fused }
}
