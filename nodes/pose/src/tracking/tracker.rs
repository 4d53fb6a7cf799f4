//! A frame at a time.

use geometry::{CameraModel, Stamp};
use nalgebra::{Isometry3, Matrix6};

use super::history::History;
use super::readout::{Readout, SeenMoving};
use super::relocalisation::relocalised;
use super::result::CameraPose;
use super::{Fate, Tracked, TrackerConfig, TrackerConfigError, TrackingState, Trouble};
use crate::frame::{Frame, LeftOut, MovingThing};
use crate::local_map::{Associations, Lean, LocalMap, Verdicts, View};
use crate::motion::{KnownPose, Turn, WheelStep};
use crate::solve::{
    LineObservation, PointObservation, PoseEstimate, PoseGuess, information_at, is_surprising,
    refine_pose, split_rigid_sets,
};

/// What else is known at a frame.
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
    config: TrackerConfig,
    map: LocalMap,
    history: History,
    readout: Readout,
    state: TrackingState,
    /// Frames so far.
    number: u64,
    last_stamp: Option<Stamp>,
    out_of_order: u32,
}

/// A pose that a frame gives, and by what.
struct Sighting {
    /// The features that were looked at: without those of moving things, taken to the middle row.
    frame: Frame,
    pose: PoseEstimate,
    associations: Associations,
    points: Vec<PointObservation>,
    /// Features that agree on another motion.
    otherwise: LeftOut,
}

impl Tracker {
    /// A tracker that has seen nothing yet.
    ///
    /// # Errors
    /// When a parameter has a value that means nothing.
    pub fn new(config: TrackerConfig) -> Result<Self, TrackerConfigError> {
        config.validate()?;
        Ok(Self {
            map: LocalMap::new(config.map),
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

    /// What has been seen so far.
    #[must_use]
    pub fn map(&self) -> &LocalMap {
        &self.map
    }

    /// How long the camera takes to read an image, as far as it is known.
    #[must_use]
    pub fn readout(&self) -> &Readout {
        &self.readout
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
        let lean = Lean::default();
        let view = View { number: self.number, frame, camera, camera_from_map, lean };
        let (nothing, refine) = (Associations::default(), &self.config.refine);
        self.map.insert(&view, &Matrix6::zeros(), &nothing, &left_out, refine);
        let covariance = Matrix6::zeros();
        let known = KnownPose { stamp: frame.stamp, camera_from_map, covariance };
        self.history.append(known, self.config.motion.max_gap_s);
        let (corners, lines) = fates(frame, &left_out, None);
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
            ..Tracked::default()
        }
    }

    /// What makes a frame worth nothing.
    fn trouble_with(&self, frame: &Frame) -> Option<Trouble> {
        let needed = self.config.follow.least_to_begin;
        let (corners, lines) = (frame.corners.len(), frame.lines.len());
        let measured = frame.measured_corners() + frame.measured_lines();
        if corners + lines < needed {
            Some(Trouble::TooFewFeatures { corners, lines })
        } else if measured < needed {
            Some(Trouble::TooFewDepths { features: corners + lines, measured, needed })
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
        let trouble = self.trouble_with(frame);
        let found = relocalised(&self.map, frame, camera, &self.config).and_then(|pose| {
            // Things that move are looked for from the pose that was found.
            let left_out = LeftOut::on_things(hints.moving, frame, camera, &pose);
            let guess = PoseGuess { camera_from_map: pose, covariance: None };
            let seen = frame.without(&left_out);
            let near = (follow.narrow_radius_px, follow.least_relocalised);
            let sighting = self.sighted(&seen, camera, &guess, follow.narrow_radius_px, near)?;
            Some((left_out, sighting))
        });
        self.history.forget_motion();
        match found {
            Some((left_out, sighting)) => {
                let mut tracked = self.accept(frame, camera, &left_out, sighting);
                tracked.is_relocalised = true;
                tracked
            }
            None => {
                let (inliers, matches) = (0, frame.corners.len() + frame.lines.len());
                let trouble = trouble.unwrap_or(Trouble::TooFewInliers { inliers, matches });
                Tracked { state: TrackingState::Lost, trouble: Some(trouble), ..Tracked::default() }
            }
        }
    }

    /// The pose near a guess: by the landmarks around where they should be, then by those around where they must be.
    /// `None` when it explains too little.
    fn sighted(
        &self,
        seen: &Frame,
        camera: &CameraModel,
        guess: &PoseGuess,
        radius_px: f64,
        (narrow_px, least_inliers): (f64, usize),
    ) -> Option<Sighting> {
        let frame = self.at_middle_row(seen, camera, guess);
        let mut otherwise = LeftOut::default();
        let first = self.attempt(&frame, camera, guess, radius_px, &otherwise)?;
        let mut pose = first.pose.camera_from_map;
        let is_suspicious = share(&first) < self.config.follow.suspicious_share
            || is_surprising(guess, &first.pose, &self.config.sets);
        if is_suspicious && let Some((room, others)) = self.split(camera, guess, &first) {
            pose = room;
            otherwise = others;
        }
        let refined = PoseGuess { camera_from_map: pose, ..*guess };
        let frame = self.at_middle_row(seen, camera, &refined);
        let second = self.attempt(&frame, camera, &refined, narrow_px, &otherwise)?;
        let inliers = second.pose.point_inliers() + second.pose.line_inliers();
        let is_enough = inliers >= least_inliers
            && (otherwise != LeftOut::default()
                || share(&second) >= self.config.follow.least_inlier_share);
        is_enough.then_some(Sighting {
            pose: second.pose,
            associations: second.associations,
            points: second.points,
            frame,
            otherwise,
        })
    }

    /// The features at the moment of the middle row, were the camera where the guess has it.
    fn at_middle_row(&self, seen: &Frame, camera: &CameraModel, guess: &PoseGuess) -> Frame {
        let pose = KnownPose {
            stamp: seen.stamp,
            camera_from_map: guess.camera_from_map,
            covariance: Matrix6::zeros(),
        };
        seen.at_middle_row(&self.history.twist(&pose), self.readout.seconds, camera)
    }

    /// The pose by the landmarks that are within the radius of where the guess has them, without some features.
    fn attempt(
        &self,
        frame: &Frame,
        camera: &CameraModel,
        guess: &PoseGuess,
        radius_px: f64,
        otherwise: &LeftOut,
    ) -> Option<Attempt> {
        let camera_from_map = guess.camera_from_map;
        let lean = Lean::default();
        let view = View { number: self.number, frame, camera, camera_from_map, lean };
        let mut associations = self.map.search(&view, radius_px as f32);
        associations.points.retain(|pair| !otherwise.has_corner(pair.feature));
        associations.lines.retain(|pair| !otherwise.has_line(pair.feature));
        let (points, lines) = self.map.observations(&view, &associations);
        let pose = refine_pose(camera, guess, &points, &lines, &self.config.refine).ok()?;
        Some(Attempt { pose, associations, points, lines })
    }

    /// The pose of the room, and the features of what moves otherwise.
    fn split(
        &self,
        camera: &CameraModel,
        guess: &PoseGuess,
        attempt: &Attempt,
    ) -> Option<(Isometry3<f64>, LeftOut)> {
        let Attempt { points, lines, associations, .. } = attempt;
        let sets = &self.config.sets;
        let split = split_rigid_sets(camera, Some(guess), points, lines, sets).ok()?;
        let mut otherwise = LeftOut::default();
        for set in &split.others {
            let corner = |index: &usize| Some(associations.points.get(*index)?.feature);
            let line = |index: &usize| Some(associations.lines.get(*index)?.feature);
            otherwise.add(set.points.iter().filter_map(corner), set.lines.iter().filter_map(line));
        }
        Some((split.background.pose.camera_from_map, otherwise))
    }

    /// Takes a pose for the camera's, and what the frame shows into the map.
    fn accept(
        &mut self,
        frame: &Frame,
        camera: &CameraModel,
        left_out: &LeftOut,
        sighting: Sighting,
    ) -> Tracked {
        let Sighting { frame: seen, pose, associations, points, otherwise } = sighting;
        let camera_from_map = pose.camera_from_map;
        let known = KnownPose { stamp: frame.stamp, camera_from_map, covariance: pose.covariance };
        let (mut lean, mut longer_s) = (Lean::default(), 0.0);
        if self.config.follow.estimate_readout {
            let verdicts = &pose.points;
            let twist = self.history.twist(&known);
            let points = &points;
            let leans_m_per_s = &self.map.leans_m_per_s(&associations);
            let seen =
                SeenMoving { camera, camera_from_map, twist, points, leans_m_per_s, verdicts };
            (lean, longer_s) = self.readout.learn(&seen);
        }
        let view = View { number: self.number, frame: &seen, camera, camera_from_map, lean };
        let verdicts = Verdicts { points: &pose.points, lines: &pose.lines };
        let frame_covariance = self.frame_covariance(&view, &pose, &associations);
        let covariance = self.map.covariance_at(&view, &associations, verdicts) + frame_covariance;
        self.map.learn(&view, &associations, verdicts);
        let inliers = pose.point_inliers() + pose.line_inliers();
        let measured = seen.measured_corners() + seen.measured_lines();
        if (inliers as f64) < self.config.follow.known_share * measured as f64 {
            let refine = &self.config.refine;
            self.map.insert(&view, &covariance, &associations, &otherwise, refine);
        }
        self.map.forget();
        self.map.correct_readout(longer_s);
        self.history.append(known, self.config.motion.max_gap_s);
        let (corners, lines) = fates(frame, left_out, Some((&associations, verdicts, &otherwise)));
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
        }
    }

    /// What a pose is off by through what the frame shows alone, were the landmarks where they are said to be.
    fn frame_covariance(
        &self,
        view: &View<'_>,
        pose: &PoseEstimate,
        associations: &Associations,
    ) -> Matrix6<f64> {
        let verdicts = Verdicts { points: &pose.points, lines: &pose.lines };
        let (points, lines) = self.map.observations_if_known(view.frame, associations, verdicts);
        let (camera, at, refine) = (view.camera, &view.camera_from_map, &self.config.refine);
        let information = information_at(camera, at, &points, &lines, refine);
        let is_told = pose.observability.estimated() == 6;
        let of_frame = information.cholesky().filter(|_| is_told).map(|c| c.inverse());
        of_frame.unwrap_or(pose.covariance)
    }

    /// How far around its place a landmark is to be looked for.
    fn radius_px(&self, guess: &PoseGuess, camera: &CameraModel) -> f64 {
        let follow = &self.config.follow;
        let Some(covariance) = guess.covariance else { return follow.widest_radius_px };
        // A shift moves what is a metre away as a turn does; hardly anything is nearer.
        let variance = covariance.diagonal().sum() / 3.0;
        let std_dev_px = camera.fx_px * variance.sqrt();
        (follow.search_std_devs * std_dev_px)
            .clamp(follow.narrow_radius_px, follow.widest_radius_px)
    }
}

/// A pose near a guess, and by what.
struct Attempt {
    pose: PoseEstimate,
    associations: Associations,
    points: Vec<PointObservation>,
    lines: Vec<LineObservation>,
}

/// Which share of the matches the pose explains.
fn share(attempt: &Attempt) -> f64 {
    let inliers = attempt.pose.point_inliers() + attempt.pose.line_inliers();
    let matches = attempt.points.len() + attempt.lines.len();
    inliers as f64 / matches.max(1) as f64
}

/// What became of the features of the whole frame, by what became of those that were not left out.
fn fates(
    frame: &Frame,
    left_out: &LeftOut,
    seen: Option<(&Associations, Verdicts<'_>, &LeftOut)>,
) -> (Vec<Fate>, Vec<Fate>) {
    let (mut corners, mut lines) =
        (vec![Fate::New; frame.corners.len()], vec![Fate::New; frame.lines.len()]);
    if let Some((associations, verdicts, otherwise)) = seen {
        let fate = |is_inlier| if is_inlier { Fate::Inlier } else { Fate::Outlier };
        let mark = |fates: &mut Vec<Fate>, index: usize, fate: Fate| {
            if let Some(place) = fates.get_mut(index) {
                *place = fate;
            }
        };
        for (pair, verdict) in associations.points.iter().zip(verdicts.points) {
            mark(&mut corners, pair.feature, fate(verdict.is_inlier()));
        }
        for (pair, verdict) in associations.lines.iter().zip(verdicts.lines) {
            mark(&mut lines, pair.feature, fate(verdict.is_inlier()));
        }
        for (index, fate) in
            corners.iter_mut().enumerate().filter(|(_, fate)| **fate != Fate::Inlier)
        {
            if otherwise.has_corner(index) {
                *fate = Fate::LeftOut;
            }
        }
        for (index, fate) in lines.iter_mut().enumerate().filter(|(_, fate)| **fate != Fate::Inlier)
        {
            if otherwise.has_line(index) {
                *fate = Fate::LeftOut;
            }
        }
    }
    let spread = |fates: Vec<Fate>, is_out: &dyn Fn(usize) -> bool| {
        let all = fates.len();
        let mut fates = fates.into_iter();
        let fate = |index: usize| {
            if is_out(index) { Fate::LeftOut } else { fates.next().unwrap_or_default() }
        };
        (0..all).map(fate).collect::<Vec<Fate>>()
    };
    (
        spread(corners, &|index| left_out.has_corner(index)),
        spread(lines, &|index| left_out.has_line(index)),
    )
}
