//! A frame at a time.

use std::sync::Arc;

use geometry::{CameraModel, ParameterError, Stamp};
use nalgebra::{Isometry3, Matrix6};

use super::history::History;
use super::readout::{Readout, SeenMoving};
use super::relocalisation::relocalised;
use super::result::CameraPose;
use super::sighting::{ENDS, Sighting};
use super::statuses::statuses;
use super::{StaticFeatures, Tracked, TrackerConfig, TrackingState, Trouble};
use crate::frame::{Frame, LeftOut, MovingThing};
use crate::local_map::{
    Associations, LandmarkNumbers, LocalMap, LocalMapConfig, ReadoutDerivative, Verdicts, View,
};
use crate::motion::{KnownPose, Turn, WheelStep};
use crate::solve::PoseGuess;

/// Further inputs at a frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Hints<'a> {
    /// How the camera has turned since the last frame, by a gyroscope.
    pub turn: Option<Turn>,
    /// How the platform has gone since the last frame, by its wheels.
    pub wheels: Option<WheelStep>,
    /// Things that are known to move, where they are at the frame's stamp.
    pub moving: &'a [MovingThing],
}

/// Follows a camera. The same frames give the same poses, bit for bit.
#[derive(Clone, Debug)]
pub struct Tracker {
    pub(super) config: TrackerConfig,
    pub(super) map: LocalMap,
    pub(super) history: History,
    pub(super) readout: Readout,
    state: TrackingState,
    /// Frames so far.
    pub(super) number: u64,
    last_stamp: Option<Stamp>,
    out_of_order: u32,
}

impl Tracker {
    /// A tracker that has seen nothing yet.
    ///
    /// # Errors
    /// When a parameter has a value that means nothing.
    pub fn new(config: TrackerConfig) -> Result<Self, ParameterError> {
        config.validate()?;
        let pyramid = config.frame.points.pyramid();
        Ok(Self {
            map: LocalMap::new(LocalMapConfig { pyramid, ..config.map }),
            history: History::default(),
            readout: Readout::new(config.follow.readout_s),
            state: TrackingState::default(),
            number: 0,
            last_stamp: None,
            out_of_order: 0,
            config,
        })
    }

    /// The parameters.
    #[must_use]
    pub fn config(&self) -> &TrackerConfig {
        &self.config
    }

    /// The landmarks seen so far.
    #[must_use]
    pub fn map(&self) -> &LocalMap {
        &self.map
    }

    /// How long the camera takes to read an image, as far as it is known.
    #[must_use]
    pub fn readout(&self) -> &Readout {
        &self.readout
    }

    /// Its state.
    #[must_use]
    pub fn state(&self) -> TrackingState {
        self.state
    }

    /// The stamp of the last frame that was not dropped: what hints are to begin at.
    #[must_use]
    pub fn last_stamp(&self) -> Option<Stamp> {
        self.last_stamp
    }

    /// Where the camera was when this frame was taken. `camera` is that of the rectified images.
    pub fn step(&mut self, frame: &Frame, camera: &CameraModel, hints: &Hints<'_>) -> Tracked {
        let late_s = self.last_stamp.map_or(-1.0, |last| last.seconds_since(frame.stamp));
        let mut trouble = None;
        if late_s >= 0.0 {
            self.out_of_order += 1;
            let is_near = late_s < self.config.motion.max_gap_s;
            if is_near && self.out_of_order < self.config.follow.most_out_of_order {
                let trouble = Some(Trouble::OutOfOrder { by_s: late_s });
                return Tracked { state: self.state, trouble, ..Tracked::default() };
            }
            self.history.forget_motion();
            trouble = Some(Trouble::TimeWentBack { by_s: late_s });
        }
        self.out_of_order = 0;
        self.last_stamp = Some(frame.stamp);
        self.number += 1;
        let mut tracked = match self.state {
            TrackingState::Initialising => self.begin(frame, camera, hints),
            TrackingState::Tracking => self.follow(frame, camera, hints),
            TrackingState::Lost => self.look_around(frame, camera, hints),
        };
        tracked.trouble = tracked.trouble.or(trouble);
        self.state = tracked.state;
        tracked
    }

    /// The first frame that shows enough makes the map, and the camera there is its origin.
    fn begin(&mut self, frame: &Frame, camera: &CameraModel, hints: &Hints<'_>) -> Tracked {
        let camera_from_map = Isometry3::identity();
        let left_out = LeftOut::on_things(hints.moving, frame, camera, &camera_from_map);
        if let Some(trouble) = self.trouble_with(frame) {
            return Tracked { trouble: Some(trouble), ..Tracked::default() };
        }
        let readout_derivative = ReadoutDerivative::default();
        let view = View { number: self.number, frame, camera, camera_from_map, readout_derivative };
        let (nothing, refine) = (Associations::default(), &self.config.refine);
        let mut numbers = LandmarkNumbers::none(frame);
        self.map.insert(&view, &Matrix6::zeros(), &nothing, &left_out, refine, &mut numbers);
        let covariance = Matrix6::zeros();
        let known = KnownPose { stamp: frame.stamp, camera_from_map, covariance };
        self.history.append(known, self.config.motion.max_gap_s);
        let (corners, lines) = statuses(frame, &left_out, None);
        Tracked {
            state: TrackingState::Tracking,
            pose: Some(CameraPose {
                stamp: frame.stamp,
                camera_from_map,
                covariance,
                frame_covariance: covariance,
            }),
            corners,
            lines,
            room: Some(StaticFeatures {
                frame: Arc::new(frame.without(&left_out)),
                numbers: numbers.without(&left_out),
            }),
            ..Tracked::default()
        }
    }

    /// Takes this place for the camera's at a frame, whatever was thought before: a map that knows more has found it there.
    /// The features of the frame are added to the map from there, and the camera is tracked from it on.
    pub fn put(&mut self, frame: &Frame, camera: &CameraModel, camera_from_map: Isometry3<f64>) {
        let view = View {
            number: self.number,
            frame,
            camera,
            camera_from_map,
            readout_derivative: ReadoutDerivative::default(),
        };
        let (nothing, refine) = (Associations::default(), &self.config.refine);
        let (none, covariance) = (LeftOut::default(), Matrix6::zeros());
        let mut numbers = LandmarkNumbers::none(frame);
        self.map.insert(&view, &covariance, &nothing, &none, refine, &mut numbers);
        self.history = History::default();
        let known = KnownPose { stamp: frame.stamp, camera_from_map, covariance };
        self.history.append(known, self.config.motion.max_gap_s);
        self.state = TrackingState::Tracking;
    }

    /// The reason why a frame is useless.
    fn trouble_with(&self, frame: &Frame) -> Option<Trouble> {
        let needed = self.config.follow.least_to_begin;
        let (corners, lines) = (frame.corners.len(), frame.lines.len());
        let measured = frame.measured_corners() + ENDS * frame.measured_lines();
        if corners + ENDS * lines < needed {
            Some(Trouble::TooFewFeatures { corners, lines })
        } else if measured < needed {
            Some(Trouble::TooFewDepths { features: corners + ENDS * lines, measured, needed })
        } else {
            None
        }
    }

    /// The pose near where the camera should be.
    fn follow(&mut self, frame: &Frame, camera: &CameraModel, hints: &Hints<'_>) -> Tracked {
        let predicted = self.history.prediction(frame.stamp, hints, &self.config.motion);
        let Some((guess, trouble)) = predicted else {
            return self.look_around(frame, camera, hints);
        };
        let left_out = LeftOut::on_things(hints.moving, frame, camera, &guess.camera_from_map);
        let seen = frame.without(&left_out);
        let follow = self.config.follow;
        let near = (follow.narrow_radius_px, follow.least_inliers);
        let sighted = self
            .sighted(&seen, camera, &guess, self.radius_px(&guess, camera), near)
            .or_else(|| self.sighted(&seen, camera, &guess, follow.widest_radius_px, near));
        match sighted {
            Some(sighting) => {
                let mut tracked = self.accept(frame, camera, &left_out, sighting);
                tracked.trouble = tracked.trouble.or(trouble);
                tracked
            }
            None => {
                let mut tracked = self.look_around(frame, camera, hints);
                tracked.trouble = trouble.or(tracked.trouble);
                tracked
            }
        }
    }

    /// The pose without a guess.
    fn look_around(&mut self, frame: &Frame, camera: &CameraModel, hints: &Hints<'_>) -> Tracked {
        let follow = self.config.follow;
        let found = relocalised(&self.map, frame, camera, &self.config).and_then(|pose| {
            // Things that move are looked for from the pose that was found.
            let left_out = LeftOut::on_things(hints.moving, frame, camera, &pose);
            let guess = PoseGuess { camera_from_map: pose, covariance: None };
            let seen = frame.without(&left_out);
            let near = (follow.narrow_radius_px, follow.least_relocalised);
            let sighted = self.sighted(&seen, camera, &guess, follow.narrow_radius_px, near);
            let matches = seen.corners.len() + seen.lines.len();
            let sighting = sighted.ok_or(Trouble::TooFewInliers { inliers: 0, matches })?;
            Ok((left_out, sighting))
        });
        self.history.forget_motion();
        match found {
            Ok((left_out, sighting)) => {
                let mut tracked = self.accept(frame, camera, &left_out, sighting);
                tracked.is_relocalised = true;
                tracked
            }
            Err(reason) => {
                let trouble = Some(self.trouble_with(frame).unwrap_or(reason));
                Tracked { state: TrackingState::Lost, trouble, ..Tracked::default() }
            }
        }
    }

    /// Takes a pose for the camera's, and what the frame shows into the map.
    fn accept(
        &mut self,
        frame: &Frame,
        camera: &CameraModel,
        left_out: &LeftOut,
        sighting: Sighting,
    ) -> Tracked {
        let Sighting { frame: seen, pose, associations, points, mut otherwise } = sighting;
        let camera_from_map = pose.camera_from_map;
        let known = KnownPose { stamp: frame.stamp, camera_from_map, covariance: pose.covariance };
        let (mut readout_derivative, mut longer_s) = (ReadoutDerivative::default(), 0.0);
        if self.config.follow.estimate_readout {
            let verdicts = &pose.points;
            let twist = self.history.twist(&known);
            let points = &points;
            let readout_derivatives_m_per_s = &self.map.readout_derivatives_m_per_s(&associations);
            let seen = SeenMoving {
                camera,
                camera_from_map,
                twist,
                points,
                readout_derivatives_m_per_s,
                verdicts,
            };
            (readout_derivative, longer_s) = self.readout.learn(&seen);
        }
        let view =
            View { number: self.number, frame: &seen, camera, camera_from_map, readout_derivative };
        let verdicts = Verdicts { points: &pose.points, lines: &pose.lines };
        let frame_covariance = self.frame_covariance(&view, &pose, &associations);
        let covariance = self.map.covariance_at(&view, &associations, verdicts) + frame_covariance;
        let mut numbers = self.map.numbers(&seen, &associations, verdicts);
        let hidden = self.map.hidden(&view, &associations, verdicts);
        self.map.learn(&view, &associations, verdicts, &hidden);
        otherwise.extend(&hidden.newcomers);
        let measured = seen.measured_corners() + seen.measured_lines();
        let known_inliers = associations.measured_inliers(&seen, verdicts);
        if (known_inliers as f64) < self.config.follow.known_share * measured as f64 {
            let refine = &self.config.refine;
            self.map.insert(&view, &covariance, &associations, &otherwise, refine, &mut numbers);
        }
        self.map.forget();
        self.map.correct_readout(longer_s);
        self.history.append(known, self.config.motion.max_gap_s);
        let (corners, lines) =
            statuses(frame, left_out, Some((&associations, verdicts, &otherwise)));
        let room = StaticFeatures {
            frame: Arc::new(seen.without(&otherwise)),
            numbers: numbers.without(&otherwise),
        };
        let weak: Vec<_> = pose.observability.weak().copied().collect();
        Tracked {
            state: TrackingState::Tracking,
            pose: Some(CameraPose {
                stamp: frame.stamp,
                camera_from_map,
                covariance,
                frame_covariance,
            }),
            trouble: (!weak.is_empty()).then_some(Trouble::Degenerate { weak: weak.len() }),
            is_relocalised: false,
            weak,
            corners,
            lines,
            room: Some(room),
        }
    }
}
