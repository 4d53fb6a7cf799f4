//! Which features are which landmarks.

use geometry::CameraModel;

use super::{Association, Associations, LocalMap, Verdicts, View, seen_line, seen_point};
use crate::frame::Frame;
use crate::matching::lines::{DirectionBins, ProjectedLine, match_projected_lines};
use crate::matching::points::{CornerGrid, PredictedCorner, match_guided};
use crate::solve::line_ransac::LinePair;
use crate::solve::{LineObservation, PointObservation};

impl LocalMap {
    /// Looks for the landmarks where a camera at this pose should see them, no farther off than `radius_px`.
    #[must_use]
    pub fn search(&self, view: &View<'_>, radius_px: f32) -> Associations {
        let (predicted_points, points) = self.search_points(view, radius_px);
        let (predicted_lines, lines) = self.search_lines(view, radius_px);
        Associations { predicted_points, predicted_lines, points, lines }
    }

    fn search_points(&self, view: &View<'_>, radius_px: f32) -> (Vec<usize>, Vec<Association>) {
        let (mut predicted, mut corners) = (Vec::new(), Vec::<PredictedCorner>::new());
        for (index, point) in self.points.iter().enumerate() {
            if let Some(corner) = point.expected(view, &self.config) {
                predicted.push(index);
                corners.push(corner);
            }
        }
        let guided = self.config.guided(radius_px);
        let pairs = match_guided(&corners, &CornerGrid::new(&view.frame.corners), &guided);
        let pairs = pairs.iter().filter_map(|pair| {
            let landmark = *predicted.get(pair.sought)?;
            let point = self.points.get(landmark)?;
            let depth = view.frame.corner_depths.get(pair.found)?;
            let is_it = point.may_lie_at(depth.as_ref(), view, &self.config);
            is_it.then_some(Association { landmark, feature: pair.found })
        });
        let pairs = pairs.collect();
        (predicted, pairs)
    }

    fn search_lines(&self, view: &View<'_>, radius_px: f32) -> (Vec<usize>, Vec<Association>) {
        let (mut predicted, mut projected) = (Vec::new(), Vec::<ProjectedLine>::new());
        for (index, line) in self.lines.iter().enumerate() {
            if let Some(line) = line.expected(view) {
                predicted.push(index);
                projected.push(line);
            }
        }
        let matching = self.config.projected(f64::from(radius_px));
        let bins = DirectionBins::new(&view.frame.lines);
        let pairs = match_projected_lines(&projected, &view.frame.lines, &bins, &matching);
        let pairs = pairs.iter().filter_map(|pair| {
            let landmark = *predicted.get(pair.from)?;
            let line = self.lines.get(landmark)?;
            let in_space = view.frame.lines_in_space.get(pair.to)?;
            let is_it = line.may_lie_at(in_space.as_ref(), view, &self.config);
            is_it.then_some(Association { landmark, feature: pair.to })
        });
        let pairs = pairs.collect();
        (predicted, pairs)
    }

    /// The observations of the pose by the associated features: one for each association.
    #[must_use]
    pub fn observations(
        &self,
        view: &View<'_>,
        associations: &Associations,
    ) -> (Vec<PointObservation>, Vec<LineObservation>) {
        let points = associations.points.iter().filter_map(|pair| {
            let seen = seen_point(view.frame, pair.feature)?;
            Some(self.points.get(pair.landmark)?.observation(seen, view, &self.config))
        });
        let lines = associations.lines.iter().filter_map(|pair| {
            let seen = seen_line(view.frame, pair.feature)?;
            Some(self.lines.get(pair.landmark)?.observation(seen, view, &self.config))
        });
        (points.collect(), lines.collect())
    }

    /// The observations of the pose by the associated features that the verdicts accept, were the places of the landmarks known.
    #[must_use]
    pub fn observations_if_known(
        &self,
        frame: &Frame,
        associations: &Associations,
        verdicts: Verdicts<'_>,
    ) -> (Vec<PointObservation>, Vec<LineObservation>) {
        let points = associations.points.iter().zip(verdicts.points);
        let points = points.filter(|(_, verdict)| verdict.is_inlier()).filter_map(|(pair, _)| {
            let seen = seen_point(frame, pair.feature)?;
            Some(self.points.get(pair.landmark)?.observation_if_known(seen, &self.config))
        });
        let lines = associations.lines.iter().zip(verdicts.lines);
        let lines = lines.filter(|(_, verdict)| verdict.is_inlier()).filter_map(|(pair, _)| {
            let seen = seen_line(frame, pair.feature)?;
            Some(self.lines.get(pair.landmark)?.observation_if_known(seen, &self.config))
        });
        (points.collect(), lines.collect())
    }

    /// The observations of points for a pose that is not known yet: one for each pair of a point that is
    /// located.
    #[must_use]
    pub fn blind_observations(
        &self,
        frame: &Frame,
        camera: &CameraModel,
        pairs: &[Association],
    ) -> Vec<PointObservation> {
        let points = pairs.iter().filter_map(|pair| {
            let seen = seen_point(frame, pair.feature)?;
            let point = self.points.get(pair.landmark)?;
            let is_located = point.is_located(&self.config);
            is_located.then(|| point.blind_observation(seen, camera, &self.config))
        });
        points.collect()
    }

    /// The observations of lines for a pose that is not known yet: one pair for each that both have a place in space.
    pub(crate) fn line_pairs(&self, frame: &Frame, pairs: &[Association]) -> Vec<LinePair> {
        let lines = pairs.iter().filter_map(|pair| {
            let seen = seen_line(frame, pair.feature)?;
            self.lines.get(pair.landmark)?.pair(seen, &self.config)
        });
        lines.collect()
    }
}
