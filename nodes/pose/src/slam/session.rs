//! A frame at a time.

use geometry::{CameraModel, Stamp};
use nalgebra::Isometry3;

use super::localiser::Localiser;
use super::waypoints::Waypoints;
use super::{Done, InlineMapping, Localised, Mapping, SlamConfig, SlamConfigError, Trajectory};
use crate::frame::Frame;
use crate::mapping::MappingStep;
use crate::tracking::{Hints, Tracked, Tracker, TrackingState};

/// Follows a camera and maps what it sees.
#[derive(Clone, Debug)]
pub struct Slam<M> {
    tracker: Tracker,
    localiser: Localiser,
    mapping: M,
    trajectory: Option<Trajectory>,
    waypoints: Waypoints,
}

/// The result of a frame.
#[derive(Clone, PartialEq, Debug)]
pub struct SlamFrame {
    /// By odometry.
    pub tracked: Tracked,
    /// In the map.
    pub localised: Localised,
    /// The answers of the mapper since the last frame.
    pub steps: Vec<MappingStep>,
    /// Whether the map has found a lost camera since the last frame.
    pub is_found: bool,
}

impl SlamFrame {
    /// The camera in the map, `camera_from_map`; `None` while either of the two is not known.
    #[must_use]
    pub fn camera_from_map(&self) -> Option<Isometry3<f64>> {
        let camera_from_odom = self.tracked.pose.as_ref()?.camera_from_map;
        Some(camera_from_odom * self.localised.map_from_odom?.inverse())
    }
}

impl Slam<InlineMapping> {
    /// Follows and maps in the caller's thread: the same frames give the same poses, bit for bit.
    ///
    /// # Errors
    /// When a parameter has a value that means nothing.
    pub fn inline(config: &SlamConfig) -> Result<Self, SlamConfigError> {
        let mapping = InlineMapping::new(config.mapping).map_err(SlamConfigError::Mapping)?;
        Self::new(config, mapping)
    }
}

impl<M: Mapping> Slam<M> {
    /// Follows a camera in this map.
    ///
    /// # Errors
    /// When a parameter has a value that means nothing.
    pub fn new(config: &SlamConfig, mapping: M) -> Result<Self, SlamConfigError> {
        config.validate()?;
        let localiser = Localiser::new(config.localiser, config.mapping.loops, &mapping.map());
        let tracker = Tracker::new(config.tracker.clone())?;
        Ok(Self { tracker, localiser, mapping, trajectory: None, waypoints: Waypoints::default() })
    }

    /// Remembers where the camera was at every frame.
    #[must_use]
    pub fn with_trajectory(self) -> Self {
        Self { trajectory: Some(Trajectory::default()), ..self }
    }

    /// Continues with a running odometry: its pose of the camera does not jump.
    #[must_use]
    pub fn with_tracker(self, tracker: Tracker) -> Self {
        Self { tracker, ..self }
    }

    /// The odometry.
    #[must_use]
    pub fn tracker(&self) -> &Tracker {
        &self.tracker
    }

    /// The map, and its mapper.
    #[must_use]
    pub fn mapping(&self) -> &M {
        &self.mapping
    }

    /// The camera's trajectory, `camera_from_map`, in the current map, by rising stamp: a pose each 0.3 m or 0.3 rad
    /// of its motion, relative to the keyframe that it was localised by. There are 10,000 at most.
    #[must_use]
    pub fn waypoints(&self) -> Vec<(Stamp, Isometry3<f64>)> {
        self.waypoints.in_map(&self.mapping.map())
    }

    /// When the latest of the waypoints was.
    #[must_use]
    pub fn last_waypoint(&self) -> Option<Stamp> {
        self.waypoints.last_stamp()
    }

    /// The number of keyframes that the map grows to.
    #[must_use]
    pub fn most_keyframes(&self) -> usize {
        self.localiser.most_keyframes()
    }

    /// Where the camera was; see [`Slam::with_trajectory`].
    #[must_use]
    pub fn trajectory(&self) -> Option<&Trajectory> {
        self.trajectory.as_ref()
    }

    #[cfg(test)]
    pub(super) fn remembered(&self) -> usize {
        self.localiser.remembered()
    }

    /// The parts: the map can be worked on to the end.
    #[must_use]
    pub fn into_parts(self) -> (M, Option<Trajectory>) {
        (self.mapping, self.trajectory)
    }

    /// Where the camera was when this frame was taken. `camera` is that of the rectified images.
    pub fn step(&mut self, frame: &Frame, camera: &CameraModel, hints: &Hints<'_>) -> SlamFrame {
        let (mut steps, mut is_found) = (Vec::new(), false);
        self.take_answers(&mut steps, &mut is_found);
        let tracked = self.tracker.step(frame, camera, hints);
        let (map, is_idle) = (self.mapping.map(), self.mapping.is_idle());
        let (mut localised, request) = self.localiser.step(frame, &tracked, camera, &map, is_idle);
        if let Some(pose) = &localised.pose {
            self.waypoints.come_along(pose, &map);
        }
        if let Some(request) = request {
            self.mapping.ask(request);
            // Inline it is done already.
            self.take_answers(&mut steps, &mut is_found);
            localised.map_from_odom = self.localiser.map_from_odom();
        }
        if let Some((trajectory, pose)) = self.trajectory.as_mut().zip(localised.pose) {
            trajectory.append(pose);
        }
        SlamFrame { tracked, localised, steps, is_found }
    }

    /// The answers of the mapper since the last frame, taken without another frame: at the end of a recording.
    pub fn catch_up(&mut self) -> Vec<MappingStep> {
        let (mut steps, mut is_found) = (Vec::new(), false);
        self.take_answers(&mut steps, &mut is_found);
        steps
    }

    fn take_answers(&mut self, steps: &mut Vec<MappingStep>, is_found: &mut bool) {
        for done in self.mapping.answers() {
            match done {
                Done::Kept(step) => {
                    let step = step.ok();
                    self.localiser.take_kept(step.as_ref());
                    if let Some(step) = &step {
                        self.waypoints.forget(&step.culled);
                    }
                    if let Some((trajectory, step)) = self.trajectory.as_mut().zip(step.as_ref()) {
                        trajectory.forget(&step.culled);
                    }
                    steps.extend(step);
                }
                Done::Found { frame, camera, camera_from_map } => {
                    *is_found |= self.take_found(&frame, &camera, camera_from_map);
                }
            }
        }
    }

    /// A camera was found in the map, as it was some frames ago. Where odometry had a pose then, too, the two are tied by that;
    /// where it had lost the camera, and has not recovered, it continues from there.
    fn take_found(
        &mut self,
        frame: &Frame,
        camera: &CameraModel,
        camera_from_map: Option<Isometry3<f64>>,
    ) -> bool {
        let camera_from_odom = self.localiser.take_looked_for();
        let Some(camera_from_map) = camera_from_map else { return false };
        let camera_from_odom = match camera_from_odom {
            Some(known) => known,
            None if self.tracker.state() == TrackingState::Lost => {
                // Of a map that was there before all odometry the two frames are one.
                let map_from_odom = self.localiser.map_from_odom().unwrap_or_default();
                let camera_from_odom = camera_from_map * map_from_odom;
                self.tracker.put(frame, camera, camera_from_odom);
                camera_from_odom
            }
            None => return false,
        };
        self.localiser.tie(camera_from_map.inverse() * camera_from_odom);
        true
    }
}
