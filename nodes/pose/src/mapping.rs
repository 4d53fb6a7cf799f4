//! The processing of a new keyframe, from landmarks to loops: the modules of SLAM put together, one step a keyframe.
//!
//! A step is PL-SLAM's local mapping and loop closing (section 2.1) in turn: the keyframe is inserted, recent landmarks are
//! culled, new ones created, duplicates fused; a window is adjusted; redundant keyframes are removed; if the
//! place was seen before, the loop is closed and the whole map adjusted. It is synchronous: threads are up to the
//! caller. A clone of the map is what a reader takes.

mod resuming;
#[cfg(test)]
mod tests;

use geometry::{CameraModel, ParameterError};
use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

use crate::bundle_adjustment::{Applied, BundleConfig, BundleError, Window, adjust};
use crate::feature::points::Descriptor;
use crate::frame::Frame;
use crate::keyframing::{TakenIn, cull_keyframes, take_in};
use crate::loop_closing::{ClosedLoop, Located, LoopConfig, close_loop, locate};
use crate::map::{CulledKeyframe, KeyframeId, Map, MapConfig, MapError, NewKeyframe};
use crate::place_recognition::{
    CandidateConfig, Consistency, PlaceConfig, PlaceDatabase, loop_candidates,
};

pub use resuming::ResumeError;

/// Parameters of a [`Mapper`].
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MappingConfig {
    /// Of the map.
    pub map: MapConfig,
    /// Of bundle adjustment.
    pub bundle: BundleConfig,
    /// Of what places look like.
    pub places: PlaceConfig,
    /// Of the choice of candidates for loops.
    pub candidates: CandidateConfig,
    /// Of loops, and of keyframes and landmarks (`keyframing`).
    pub loops: LoopConfig,
}

impl MappingConfig {
    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter out of its range, with its name, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ParameterError> {
        self.map.validate()?;
        self.bundle.validate()?;
        self.places.validate()?;
        self.candidates.validate()?;
        self.loops.validate()
    }
}

/// A map that grows by keyframes.
#[derive(Clone, Debug)]
pub struct Mapper {
    config: MappingConfig,
    map: Map,
    places: PlaceDatabase,
    consistency: Consistency,
}

/// The changes by a keyframe.
#[derive(Clone, PartialEq, Debug)]
pub struct MappingStep {
    /// The keyframe.
    pub keyframe: KeyframeId,
    /// The changes of landmarks.
    pub taken_in: TakenIn,
    /// The changes by the adjustment of the window; `None` when it could not be made.
    pub adjusted: Option<Applied>,
    /// Keyframes that went.
    pub culled: Vec<(KeyframeId, CulledKeyframe)>,
    /// The loop that was closed, and with which keyframe.
    pub closed: Option<(KeyframeId, ClosedLoop)>,
    /// The motion of the map around the keyframe by this step: its pose in the map is this times the one it came with.
    /// A tracker of the camera must move its own pose alike.
    pub map_from_before: Isometry3<f64>,
}

impl Mapper {
    /// A map of nothing.
    ///
    /// # Errors
    /// When a parameter has a value that means nothing.
    pub fn new(config: MappingConfig) -> Result<Self, ParameterError> {
        config.validate()?;
        Ok(Self {
            map: Map::new(config.map),
            places: PlaceDatabase::new(config.places),
            consistency: Consistency::default(),
            config,
        })
    }

    /// The parameters.
    #[must_use]
    pub fn config(&self) -> &MappingConfig {
        &self.config
    }

    /// The map. A clone of it is a snapshot.
    #[must_use]
    pub fn map(&self) -> &Map {
        &self.map
    }

    /// The appearance of places, for relocalisation.
    #[must_use]
    pub fn places(&self) -> &PlaceDatabase {
        &self.places
    }

    /// The map, to count in it what frames have found of it.
    pub fn map_mut(&mut self) -> &mut Map {
        &mut self.map
    }

    /// Adds a keyframe, with all that follows. `is_aborted` is called by the solvers: another keyframe waits.
    ///
    /// # Errors
    /// When the keyframe cannot be taken in; the map is as it was.
    pub fn step(
        &mut self,
        new: NewKeyframe<'_>,
        is_aborted: &dyn Fn() -> bool,
    ) -> Result<MappingStep, MapError> {
        let (came_with, frame) = (new.camera_from_map, std::sync::Arc::clone(&new.frame));
        let keyframe = self.map.insert_keyframe(new)?;
        let rules = self.config.loops.keyframing;
        let taken_in = take_in(&mut self.map, keyframe, &rules);
        let window = Window::local(&self.map, keyframe, &rules.window);
        let adjusted = window.and_then(|window| self.adjust(&window, is_aborted).ok().flatten());
        let culled = cull_keyframes(&mut self.map, keyframe, &rules);
        for (gone, _) in &culled {
            self.places.remove(*gone);
        }
        let closed = self.close(keyframe, is_aborted);
        self.places.insert(keyframe, &frame);
        let now = self.map.keyframes().get(keyframe).map(|keyframe| *keyframe.camera_from_map());
        let mut map_from_before = now.unwrap_or(came_with).inverse() * came_with;
        map_from_before.rotation.renormalize();
        Ok(MappingStep { keyframe, taken_in, adjusted, culled, closed, map_from_before })
    }

    /// Adjusts a part of the map. `None` when the map was corrected meanwhile.
    fn adjust(
        &mut self,
        window: &Window,
        is_aborted: &dyn Fn() -> bool,
    ) -> Result<Option<Applied>, BundleError> {
        let adjusted = adjust(&window.bundle, &self.config.bundle, is_aborted)?;
        Ok(window.apply(&adjusted, &mut self.map).ok())
    }

    /// Closes a loop if there is one.
    fn close(
        &mut self,
        keyframe: KeyframeId,
        is_aborted: &dyn Fn() -> bool,
    ) -> Option<(KeyframeId, ClosedLoop)> {
        let MappingConfig { candidates, loops, .. } = self.config;
        let found = loop_candidates(&self.places, &self.map, keyframe, &candidates);
        let found = self.consistency.filter(&found, &self.map, &candidates);
        for candidate in found {
            let of = self.map.keyframes().get(keyframe)?;
            let (frame, camera) = (std::sync::Arc::clone(of.frame()), *of.camera());
            let to = candidate.keyframe;
            let Ok(located) = locate(&self.map, to, &frame, &camera, &loops) else { continue };
            let closed = close_loop(&mut self.map, keyframe, to, &located, &loops, is_aborted);
            let Ok(closed) = closed else { continue };
            let whole = Window::full(&self.map, &loops.keyframing.window);
            // Without it the map is not as good as it could be, but whole.
            self.adjust(&whole, is_aborted).ok();
            return Some((to, closed));
        }
        None
    }

    /// Where a lost camera is, by what it sees alone; with the keyframe that it sees most of.
    #[must_use]
    pub fn find(&self, frame: &Frame, camera: &CameraModel) -> Option<(KeyframeId, Located)> {
        let corners: Vec<Descriptor> =
            frame.corners.iter().map(|corner| corner.descriptor).collect();
        let near = self.lost_at(&corners).into_iter();
        let mut found = near.filter_map(|id| {
            Some((id, locate(&self.map, id, frame, camera, &self.config.loops).ok()?))
        });
        found.next()
    }

    /// The keyframes that a lost camera with these corners may be at; see [`crate::loop_closing::locate`].
    #[must_use]
    pub fn lost_at(&self, corners: &[Descriptor]) -> Vec<KeyframeId> {
        let candidates = &self.config.candidates;
        let found =
            crate::place_recognition::lost_candidates(&self.places, &self.map, corners, candidates);
        found.iter().map(|candidate| candidate.keyframe).collect()
    }
}
