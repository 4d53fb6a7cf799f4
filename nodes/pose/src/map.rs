//! The map that keyframes make: keyframes, points, lines, and their observations (PL-SLAM sections 2.1 to 2.3).
//!
//! | module | what is in it |
//! |---|---|
//! | `arena` | things under numbers that are never given twice |
//! | `keyframe`, `landmark` | what is kept of each |
//! | `insertion` | keyframes and landmarks come in, sightings are added |
//! | `sightings` | the two steps that all others are made of: a keyframe sees a landmark, or no longer does |
//! | `culling`, `fusion` | what goes, and what was one all along |
//! | `tree` | the spanning tree, when a keyframe goes |
//! | `queries` | visibility and covisibility |
//! | `look` | what a landmark looks like, by all that see it |
//! | `consistency` | what must hold of a map |
//! | `memory` | how much memory it takes |
//! | `parts` | a map taken apart, to be saved, and put together again |
//!
//! Things refer to each other by [`Id`], which an [`Arena`] resolves: there are no cycles of references, and an id of a thing that is
//! gone finds nothing. A clone of a map is a snapshot: it shares the unchanged parts. A solver works on one, and
//! what it finds is taken into the map afterwards, as far as it is still there.
//!
//! Covisibility is counted with every sighting that comes or goes, so it is exact at all times.

mod arena;
mod consistency;
mod culling;
mod fusion;
mod insertion;
mod keyframe;
mod landmark;
mod look;
mod memory;
mod parts;
mod queries;
mod sightings;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;
mod tree;

use geometry::{ParameterError, parameter};
use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

pub use arena::{Arena, Id};
pub use consistency::Inconsistency;
pub use culling::CulledKeyframe;
use estimation::perturbation::is_rigid;
pub use fusion::Fused;
pub use insertion::{NewKeyframe, NewLine};
pub use keyframe::{ByOdometry, Keyframe, LoopEdge, Shared};
pub use landmark::{FoundTimes, Landmark, MapLine, MapPoint, PointLook, Sightings};
pub use memory::MapMemory;
pub use parts::{KeyframePart, LinePart, MapParts, PartsError, PointPart};

use crate::solve::PluckerLine;

/// The number of a keyframe.
pub type KeyframeId = Id<Keyframe>;
/// The number of a point.
pub type PointId = Id<MapPoint>;
/// The number of a line.
pub type LineId = Id<MapLine>;

/// Keyframes, points, lines, and their observations.
#[derive(Clone, Debug)]
pub struct Map {
    config: MapConfig,
    keyframes: Arena<Keyframe>,
    points: Arena<MapPoint>,
    lines: Arena<MapLine>,
    root: Option<KeyframeId>,
    newest: Option<KeyframeId>,
    next_number: u64,
}

/// Parameters of a [`Map`].
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MapConfig {
    /// The factor between the levels that corners are found on.
    pub scale_factor: f64,
    /// How many levels there are.
    pub levels: u8,
}

impl Default for MapConfig {
    fn default() -> Self {
        // Those of the corners (ORB-SLAM2).
        Self { scale_factor: 1.2, levels: 8 }
    }
}

impl MapConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        parameter::check("scale_factor", "above 1", self.scale_factor, self.scale_factor > 1.0)?;
        parameter::positive("levels", f64::from(self.levels))
    }
}

/// The operations that a map refuses.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum MapError {
    /// The keyframe is not, or no longer, in the map.
    #[error("the map has no keyframe {0:?}")]
    NoKeyframe(KeyframeId),
    /// The landmark is not, or no longer, in the map.
    #[error("the map has no such point or line")]
    NoLandmark,
    /// The keyframe has no feature of this index.
    #[error("the keyframe has {features} such features, none of index {feature}")]
    NoFeature {
        /// The index.
        feature: usize,
        /// How many there are.
        features: usize,
    },
    /// The feature is another landmark.
    #[error("feature {feature} is another landmark already")]
    FeatureTaken {
        /// The feature.
        feature: usize,
    },
    /// The keyframe sees the landmark as another feature.
    #[error("the keyframe sees the landmark as feature {feature} already")]
    SeenAlready {
        /// That feature.
        feature: usize,
    },
    /// A landmark is to be fused with itself, or a loop closed from a keyframe to itself.
    #[error("a landmark or keyframe cannot be joined with itself")]
    WithItself,
    /// The root of the spanning tree stays.
    #[error("the first keyframe of the map cannot be dropped")]
    Root,
    /// A number is not finite, or a line has no length.
    #[error("a place or pose has a number that is not finite, or a line has no length")]
    NotFinite,
    /// There are too many things of the kind.
    #[error("the map is full")]
    Full,
}

impl Map {
    /// A map of nothing.
    #[must_use]
    pub fn new(config: MapConfig) -> Self {
        Self {
            config,
            keyframes: Arena::default(),
            points: Arena::default(),
            lines: Arena::default(),
            root: None,
            newest: None,
            next_number: 0,
        }
    }

    /// The parameters.
    #[must_use]
    pub fn config(&self) -> &MapConfig {
        &self.config
    }

    /// The keyframes.
    #[must_use]
    pub fn keyframes(&self) -> &Arena<Keyframe> {
        &self.keyframes
    }

    /// The points.
    #[must_use]
    pub fn points(&self) -> &Arena<MapPoint> {
        &self.points
    }

    /// The lines.
    #[must_use]
    pub fn lines(&self) -> &Arena<MapLine> {
        &self.lines
    }

    /// The first keyframe, the root of the spanning tree.
    #[must_use]
    pub fn root(&self) -> Option<KeyframeId> {
        self.root
    }

    /// The keyframe that came in last, of those that are left.
    #[must_use]
    pub fn newest(&self) -> Option<KeyframeId> {
        self.newest
    }

    /// How many keyframes have ever come in.
    #[must_use]
    pub fn keyframes_so_far(&self) -> u64 {
        self.next_number
    }

    /// Puts a keyframe elsewhere.
    ///
    /// # Errors
    /// When it is not there, or the pose not finite.
    pub fn set_pose(
        &mut self,
        keyframe: KeyframeId,
        camera_from_map: &Isometry3<f64>,
    ) -> Result<(), MapError> {
        if !is_rigid(camera_from_map) {
            return Err(MapError::NotFinite);
        }
        let found = self.keyframes.get_mut(keyframe).ok_or(MapError::NoKeyframe(keyframe))?;
        found.camera_from_map = *camera_from_map;
        Ok(())
    }

    /// Puts a point elsewhere.
    ///
    /// # Errors
    /// When it is not there, or the place not finite.
    pub fn set_point(&mut self, point: PointId, position_m: &Point3<f64>) -> Result<(), MapError> {
        if !position_m.iter().all(|value| value.is_finite()) {
            return Err(MapError::NotFinite);
        }
        self.points.get_mut(point).ok_or(MapError::NoLandmark)?.position_m = *position_m;
        Ok(())
    }

    /// Puts a line elsewhere: two points of it, as in [`MapLine::ends_m`].
    ///
    /// # Errors
    /// When it is not there, or the points are one or not finite.
    pub fn set_line(&mut self, line: LineId, ends_m: &[Point3<f64>; 2]) -> Result<(), MapError> {
        let [start_m, end_m] = *ends_m;
        PluckerLine::through(&start_m, &end_m).ok_or(MapError::NotFinite)?;
        let line = self.lines.get_mut(line).ok_or(MapError::NoLandmark)?;
        (line.start_m, line.end_m) = (start_m, end_m);
        Ok(())
    }

    /// Counts how often frames should have seen the landmark, and how often they have.
    pub fn count_predicted<L: Landmark>(&mut self, landmark: Id<L>, times: FoundTimes) {
        if let Some(landmark) = L::arena_mut(self).get_mut(landmark) {
            landmark.sightings_mut().times.add(times);
        }
    }

    /// Remembers that a loop was closed between two keyframes, measured so. A second one between the same two takes the
    /// place of the first.
    ///
    /// # Errors
    /// When one is not there, both are one, or the pose is not finite.
    pub fn close_loop(
        &mut self,
        keyframe: KeyframeId,
        other: KeyframeId,
        camera_from_other: &Isometry3<f64>,
    ) -> Result<(), MapError> {
        if keyframe == other {
            return Err(MapError::WithItself);
        }
        if !is_rigid(camera_from_other) {
            return Err(MapError::NotFinite);
        }
        for id in [keyframe, other] {
            self.keyframes.get(id).ok_or(MapError::NoKeyframe(id))?;
        }
        self.link(keyframe, other, camera_from_other);
        Ok(())
    }

    /// Puts a loop between two keyframes, to be found from both.
    fn link(
        &mut self,
        keyframe: KeyframeId,
        other: KeyframeId,
        camera_from_other: &Isometry3<f64>,
    ) {
        let there = LoopEdge { camera_from_other: *camera_from_other };
        let back = LoopEdge { camera_from_other: camera_from_other.inverse() };
        for (one, two, edge) in [(keyframe, other, there), (other, keyframe, back)] {
            if let Some(one) = self.keyframes.get_mut(one) {
                one.loops.insert(two, edge);
            }
        }
    }
}
