//! The update of landmarks, and which are added and dropped.

use std::collections::BTreeSet;

use nalgebra::Matrix6;

use super::{
    Associations, Hidden, LandmarkNumbers, LineLandmark, LocalMap, PointLandmark, Verdicts, View,
    seen_line, seen_point,
};
use crate::frame::LeftOut;
use crate::solve::{RefineConfig, Verdict, information_at};

impl LocalMap {
    /// Takes in what a frame at a known pose says of the landmarks that it shows, or should; of those that are hidden it says
    /// nothing.
    pub fn learn(
        &mut self,
        view: &View<'_>,
        associations: &Associations,
        verdicts: Verdicts<'_>,
        hidden: &Hidden,
    ) {
        let points = &associations.predicted_points;
        for index in points.iter().filter(|index| !hidden.points.contains(index)) {
            if let Some(point) = self.points.get_mut(*index) {
                point.expected += 1;
            }
        }
        let lines = &associations.predicted_lines;
        for index in lines.iter().filter(|index| !hidden.lines.contains(index)) {
            if let Some(line) = self.lines.get_mut(*index) {
                line.expected += 1;
            }
        }
        for (pair, verdict) in associations.points.iter().zip(verdicts.points) {
            let seen = seen_point(view.frame, pair.feature).filter(|_| verdict.is_inlier());
            if let Some((mut seen, point)) = seen.zip(self.points.get_mut(pair.landmark)) {
                seen.depth = seen.depth.filter(|_| *verdict == Verdict::Fits);
                point.learn(seen, view, &self.config);
            }
        }
        for (pair, verdict) in associations.lines.iter().zip(verdicts.lines) {
            let seen = seen_line(view.frame, pair.feature).filter(|_| verdict.is_inlier());
            if let Some((mut seen, line)) = seen.zip(self.lines.get_mut(pair.landmark)) {
                seen.in_space = seen.in_space.filter(|_| *verdict == Verdict::Fits);
                line.learn(seen, view, &self.config);
            }
        }
    }

    /// Takes in the features of a frame that are no landmark yet, from a pose of this covariance, and notes their numbers.
    pub fn insert(
        &mut self,
        view: &View<'_>,
        covariance: &Matrix6<f64>,
        associations: &Associations,
        left_out: &LeftOut,
        refine: &RefineConfig,
        numbers: &mut LandmarkNumbers,
    ) {
        let (mut points, mut lines) = (Vec::new(), Vec::new());
        let known = associations.points.iter().map(|pair| pair.feature);
        for index in others(view.frame.corners.len(), known, &left_out.corners) {
            let Some(seen) = seen_point(view.frame, index) else { continue };
            let new = PointLandmark::new(self.next_id, seen, view, &self.config);
            let Some(new) = new else { continue };
            points.push(new.observation_if_known(seen, &self.config));
            self.points.push(new);
            numbers.set_corner(index, self.next_id);
            self.next_id += 1;
        }
        let known = associations.lines.iter().map(|pair| pair.feature);
        for index in others(view.frame.lines.len(), known, &left_out.lines) {
            let Some(seen) = seen_line(view.frame, index) else { continue };
            let new = LineLandmark::new(self.next_id, seen, view, &self.config);
            let Some(new) = new else { continue };
            lines.push(new.observation_if_known(seen, &self.config));
            self.lines.push(new);
            numbers.set_line(index, self.next_id);
            self.next_id += 1;
        }
        let at = &view.camera_from_map;
        let information = information_at(view.camera, at, &points, &lines, refine);
        // In directions that a landmark does not constrain, others determine the pose.
        let of_landmarks = information.cholesky().map_or_else(Matrix6::zeros, |c| c.inverse());
        let landmarks = points.len() + lines.len();
        self.arrivals.arrive(view.number, at, covariance, &of_landmarks, landmarks);
    }

    /// Forgets what is seen too seldom, and what was not seen for longest where there is too much.
    pub fn forget(&mut self) {
        let config = self.config;
        let keeps = |seen: u32, expected: u32| {
            expected < config.min_expected_frames
                || f64::from(seen) >= config.min_seen_share * f64::from(expected)
        };
        self.points.retain(|point| keeps(point.seen, point.expected));
        self.lines.retain(|line| keeps(line.seen, line.expected));
        bound(&mut self.points, config.max_points, |point| (point.seen_in_frame, point.id));
        bound(&mut self.lines, config.max_lines, |line| (line.seen_in_frame, line.id));
        let of_points = self.points.iter().map(|point| point.arrival);
        let of_lines = self.lines.iter().map(|line| line.arrival);
        self.arrivals.keep(&of_points.chain(of_lines).collect::<BTreeSet<u64>>());
    }
}

/// The features that are neither known nor left out.
fn others(
    features: usize,
    known: impl Iterator<Item = usize>,
    left_out: &[bool],
) -> impl Iterator<Item = usize> {
    let mut is_taken = left_out.to_vec();
    is_taken.resize(features, false);
    for index in known {
        if let Some(is_taken) = is_taken.get_mut(index) {
            *is_taken = true;
        }
    }
    is_taken.into_iter().enumerate().filter_map(|(index, is_taken)| (!is_taken).then_some(index))
}

/// Keeps those with the largest keys, in their order. No two keys are the same.
fn bound<T>(landmarks: &mut Vec<T>, most: usize, key: impl Fn(&T) -> (u64, u64)) {
    let surplus = landmarks.len().saturating_sub(most);
    if surplus == 0 {
        return;
    }
    let mut keys: Vec<(u64, u64)> = landmarks.iter().map(&key).collect();
    if surplus < keys.len() {
        let (_, least, _) = keys.select_nth_unstable(surplus);
        let least = *least;
        landmarks.retain(|landmark| key(landmark) >= least);
    } else {
        landmarks.clear();
    }
}
