//! The pose near a guess.

use geometry::CameraModel;
use nalgebra::{Isometry3, Matrix6};

use super::Tracker;
use crate::frame::{Frame, LeftOut};
use crate::local_map::{Associations, ReadoutDerivative, Verdicts, View};
use crate::motion::KnownPose;
use crate::solve::{
    LineObservation, PointObservation, PoseEstimate, PoseGuess, information_at, is_surprising,
    refine_pose, split_rigid_sets,
};

/// A segment is worth as many corners as it has ends.
pub(super) const ENDS: usize = 2;

/// A pose that a frame gives, and by what.
pub(super) struct Sighting {
    /// The features that were looked at: without those of moving things, taken to the middle row.
    pub(super) frame: Frame,
    pub(super) pose: PoseEstimate,
    pub(super) associations: Associations,
    pub(super) points: Vec<PointObservation>,
    /// Features that agree on another motion.
    pub(super) otherwise: LeftOut,
}

impl Tracker {
    /// The pose near a guess: by the landmarks around where they should be, then by those around where they must be.
    /// `None` when it explains too little.
    pub(super) fn sighted(
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
        let inliers = second.pose.point_inliers() + ENDS * second.pose.line_inliers();
        let follow = &self.config.follow;
        // Against the prediction it takes as much as without one.
        let is_surprise = is_surprising(guess, &second.pose, &self.config.sets);
        let needed = if is_surprise { follow.least_relocalised } else { 0 };
        let is_enough = inliers >= least_inliers.max(needed)
            && (otherwise != LeftOut::default() || share(&second) >= follow.least_inlier_share);
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
        let readout_derivative = ReadoutDerivative::default();
        let view = View { number: self.number, frame, camera, camera_from_map, readout_derivative };
        let mut associations = self.map.search(&view, radius_px as f32);
        associations.points.retain(|pair| !otherwise.has_corner(pair.feature));
        associations.lines.retain(|pair| !otherwise.has_line(pair.feature));
        let (points, lines) = self.map.observations(&view, &associations);
        let pose = refine_pose(camera, guess, &points, &lines, &self.config.refine).ok()?;
        Some(Attempt { pose, associations, points, lines })
    }

    /// The pose relative to the static scene, and the features of moving objects.
    fn split(
        &self,
        camera: &CameraModel,
        guess: &PoseGuess,
        attempt: &Attempt,
    ) -> Option<(Isometry3<f64>, LeftOut)> {
        let Attempt { points, lines, associations, .. } = attempt;
        let (sets, refine) = (&self.config.sets, &self.config.refine);
        let split = split_rigid_sets(camera, Some(guess), points, lines, sets, refine).ok()?;
        let mut otherwise = LeftOut::default();
        for set in &split.others {
            let corner = |index: &usize| Some(associations.points.get(*index)?.feature);
            let line = |index: &usize| Some(associations.lines.get(*index)?.feature);
            otherwise.add(set.points.iter().filter_map(corner), set.lines.iter().filter_map(line));
        }
        Some((split.background.pose.camera_from_map, otherwise))
    }

    /// The covariance of a pose by the observations of the frame alone, were the landmarks exact.
    pub(super) fn frame_covariance(
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
    pub(super) fn radius_px(&self, guess: &PoseGuess, camera: &CameraModel) -> f64 {
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
