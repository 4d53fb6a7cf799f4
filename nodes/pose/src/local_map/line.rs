//! A line of the map.

use nalgebra::{Isometry3, Point2, Point3, Vector2, Vector3};

use super::place::{InverseDepth, Place, Spread};
use super::{LocalMapConfig, View};
use crate::feature::lines::{LineDescriptor, LineFeature, LineSegment, SegmentInSpace};
use crate::frame::MeasuredDepth;
use crate::matching::lines::ProjectedLine;
use crate::solve::LineObservation;
use crate::solve::line_ransac::LinePair;

/// An end of a line: a place on it that is known across the line.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LineEnd {
    /// Where it is in the map frame.
    pub position_m: Point3<f64>,
    /// The same, with what it may be off by, the poses from which it was seen held to be known.
    place: Place,
}

/// A line that was seen as a segment.
#[derive(Clone, PartialEq, Debug)]
pub struct LineLandmark {
    /// Its number; no other landmark of the same map has ever had it.
    pub id: u64,
    /// The end at the segment's start: from here the brighter side is on the left.
    pub start: LineEnd,
    /// The other one.
    pub end: LineEnd,
    /// Its descriptor when it was last seen.
    pub descriptor: LineDescriptor,
    /// The frame that saw it last.
    pub seen_in_frame: u64,
    /// The frame that brought it in.
    pub arrival: u64,
    /// Frames that saw it.
    pub seen: u32,
    /// Frames that should have.
    pub expected: u32,
}

/// A segment with its place in space, at a pose.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct SeenLine<'a> {
    pub(super) feature: &'a LineFeature,
    pub(super) in_space: Option<&'a SegmentInSpace>,
}

impl LineLandmark {
    /// A landmark that a segment shows for the first time. Where its depths make no line its ends are somewhere along
    /// their rays.
    pub(super) fn new(
        id: u64,
        seen: SeenLine<'_>,
        view: &View<'_>,
        config: &LocalMapConfig,
    ) -> Option<Self> {
        let [start, end] = LineEnd::both(seen, view, config)?;
        Some(Self {
            id,
            start,
            end,
            descriptor: seen.feature.descriptor,
            seen_in_frame: view.number,
            arrival: view.number,
            seen: 1,
            expected: 1,
        })
    }

    /// It as a feature that has no place in an image.
    pub(super) fn as_segment(&self) -> LineFeature {
        let segment = LineSegment { start_px: [0.0; 2], end_px: [0.0; 2], response: 0.0 };
        LineFeature { segment, descriptor: self.descriptor }
    }

    /// It and a segment that may be it, in space; `None` where either's depth is not known.
    pub(super) fn pair(&self, seen: SeenLine<'_>, config: &LocalMapConfig) -> Option<LinePair> {
        let (line, ends) = (seen.in_space?, [&self.start, &self.end]);
        let is_located = ends.iter().all(|end| end.place.is_located(config));
        let variances_m2 = ends.map(|end| end.place.covariance_m2().trace());
        let seen_std_dev_m = line.start_std_dev_m.max(line.end_std_dev_m);
        is_located.then_some(LinePair {
            in_map_m: ends.map(|end| end.position_m),
            in_camera_m: [line.start_m, line.end_m],
            std_dev_m: seen_std_dev_m.hypot(variances_m2[0].max(variances_m2[1]).sqrt()),
        })
    }

    /// Where it should be in an image; `None` where less than half of it would be in view.
    pub(super) fn expected(&self, view: &View<'_>) -> Option<ProjectedLine> {
        let View { camera, camera_from_map, .. } = view;
        let end = |end: &LineEnd| camera.project(&(camera_from_map * end.position_m));
        let (start_px, end_px) = (end(&self.start)?, end(&self.end)?);
        let middle_px = nalgebra::center(&start_px, &end_px);
        let inside = [&start_px, &middle_px, &end_px].into_iter();
        let inside = inside.filter(|pixel| camera.contains(pixel)).count();
        (inside >= 2).then_some(ProjectedLine { start_px, end_px, descriptor: self.descriptor })
    }

    /// Whether a segment that lies there may be it: neither hides the other.
    pub(super) fn may_lie_at(
        &self,
        in_space: Option<&SegmentInSpace>,
        view: &View<'_>,
        config: &LocalMapConfig,
    ) -> bool {
        let is_located = [&self.start, &self.end].iter().all(|end| end.place.is_located(config));
        let Some(seen) = in_space.filter(|_| is_located) else { return true };
        let depth_m = (view.camera_from_map * self.middle_m()).z;
        let seen_m = nalgebra::center(&seen.start_m, &seen.end_m).z;
        config.may_be_one(seen_m, depth_m)
    }

    /// The place between its ends.
    pub(super) fn middle_m(&self) -> Point3<f64> {
        nalgebra::center(&self.start.position_m, &self.end.position_m)
    }

    /// The observation of the pose by a segment, were it this landmark and its place known.
    pub(super) fn observation_if_known(
        &self,
        seen: SeenLine<'_>,
        config: &LocalMapConfig,
    ) -> LineObservation {
        let [start_px, end_px] = [seen.feature.segment.start_px, seen.feature.segment.end_px]
            .map(|pixel| Point2::from(pixel.map(f64::from)));
        let variance =
            |line: &SegmentInSpace| mean(line.start_std_dev_m.powi(2), line.end_std_dev_m.powi(2));
        LineObservation {
            start_in_map_m: self.start.position_m,
            end_in_map_m: self.end.position_m,
            start_px,
            end_px,
            pixel_std_dev_px: config.line_std_dev_px,
            start_depth_m: seen.in_space.map(|line| line.start_m.z),
            end_depth_m: seen.in_space.map(|line| line.end_m.z),
            depth_std_dev_m: seen.in_space.map_or(0.0, variance).sqrt(),
        }
    }

    /// The observation with the uncertainty of the place.
    pub(super) fn observation(
        &self,
        seen: SeenLine<'_>,
        view: &View<'_>,
        config: &LocalMapConfig,
    ) -> LineObservation {
        let [start, end] = [&self.start, &self.end].map(|end| end.place.spread(view));
        let known = self.observation_if_known(seen, config);
        // How far the line may lie from where it is thought to be, across the segment.
        let along = (known.end_px - known.start_px).normalize();
        let across = Vector2::new(-along.y, along.x);
        let across_px2 = |spread: &Spread| across.dot(&(spread.image_px2 * across)).max(0.0);
        let error_factor =
            self.start.place.error_factor(config).max(self.end.place.error_factor(config));
        let pixel_px2 = error_factor * error_factor * mean(across_px2(&start), across_px2(&end));
        let depth_m2 = mean(start.depth_std_dev_m.powi(2), end.depth_std_dev_m.powi(2));
        LineObservation {
            pixel_std_dev_px: known.pixel_std_dev_px.hypot(pixel_px2.sqrt()),
            depth_std_dev_m: known.depth_std_dev_m.hypot(depth_m2.sqrt()),
            ..known
        }
    }

    /// A segment that the pose explains makes its place surer: each end is moved across the line, never along it.
    pub(super) fn learn(&mut self, seen: SeenLine<'_>, view: &View<'_>, config: &LocalMapConfig) {
        let is_located = [&self.start, &self.end].map(|end| end.place.is_located(config));
        let measured = seen.in_space.and_then(|_| LineEnd::both(seen, view, config));
        match measured {
            // A line known only by two rays is now where it is seen.
            Some([start, end]) if is_located != [true; 2] => (self.start, self.end) = (start, end),
            _ => self.correct(seen, view, config),
        }
        for end in [&mut self.start, &mut self.end] {
            end.place.loosen(config.landmark_noise_m);
            end.position_m = end.place.in_map_m();
        }
        self.descriptor = seen.feature.descriptor;
        self.seen_in_frame = view.number;
        self.seen += 1;
    }

    fn correct(&mut self, seen: SeenLine<'_>, view: &View<'_>, config: &LocalMapConfig) {
        self.learn_image(seen, view, config);
        if let Some(in_space) = seen.in_space {
            self.learn_depths(in_space, &view.camera_from_map);
        }
    }

    /// By how far the images of its ends lie from the segment.
    fn learn_image(&mut self, seen: SeenLine<'_>, view: &View<'_>, config: &LocalMapConfig) {
        let View { camera, camera_from_map, .. } = view;
        let [start_px, end_px] = [seen.feature.segment.start_px, seen.feature.segment.end_px]
            .map(|pixel| Point2::from(pixel.map(f64::from)));
        let Some(along) = (end_px - start_px).try_normalize(0.0) else { return };
        let across = Vector2::new(-along.y, along.x);
        let rotation = camera_from_map.rotation.to_rotation_matrix().into_inner();
        for end in [&mut self.start, &mut self.end] {
            let in_camera_m = camera_from_map * end.position_m;
            let Some(pixel) = camera.project(&in_camera_m) else { continue };
            let z = in_camera_m.z;
            let [x, y] = [across.x * camera.fx_px / z, across.y * camera.fy_px / z];
            let toward = -(x * in_camera_m.x + y * in_camera_m.y) / z;
            let slope = rotation.transpose() * Vector3::new(x, y, toward);
            end.update(&slope, across.dot(&(start_px - pixel)), config.line_std_dev_px.powi(2));
        }
    }

    /// By how far the depths of the line at its ends are from those measured.
    fn learn_depths(&mut self, in_space: &SegmentInSpace, camera_from_map: &Isometry3<f64>) {
        let rotation = camera_from_map.rotation.to_rotation_matrix().into_inner();
        let Some(along) = (in_space.end_m - in_space.start_m).try_normalize(0.0) else { return };
        let length_m = (in_space.end_m - in_space.start_m).norm();
        for end in [&mut self.start, &mut self.end] {
            let in_camera_m = camera_from_map * end.position_m;
            let Some(ray) = in_camera_m.coords.try_normalize(0.0) else { continue };
            // The point of the measured line beside the end, and its distance along the ray, less the part along the line.
            let at_m = (in_camera_m - in_space.start_m).dot(&along);
            let beside_m = in_space.start_m + along * at_m - in_camera_m;
            let Some(across) = (ray - along * along.dot(&ray)).try_normalize(1e-3) else {
                continue;
            };
            let share = (at_m / length_m).clamp(-1.0, 2.0);
            let std_dev_m = in_space.start_std_dev_m
                + share * (in_space.end_std_dev_m - in_space.start_std_dev_m);
            let slope = rotation.transpose() * across;
            end.update(&slope, across.dot(&beside_m), (std_dev_m * across.dot(&ray)).powi(2));
        }
    }
}

impl LineEnd {
    /// The ends that a segment shows.
    fn both(seen: SeenLine<'_>, view: &View<'_>, config: &LocalMapConfig) -> Option<[Self; 2]> {
        let View { camera, camera_from_map, .. } = view;
        let (map_from_camera, std_dev_px) = (camera_from_map.inverse(), config.line_std_dev_px);
        let end = |pixel: Point2<f64>, depth: InverseDepth| {
            let place = Place::seen(camera, map_from_camera, &pixel, std_dev_px, depth)?;
            Some(Self { position_m: place.in_map_m(), place })
        };
        let measured = |in_camera_m: &Point3<f64>, std_dev_m: f64| {
            let depth = MeasuredDepth { depth_m: in_camera_m.z, std_dev_m };
            end(camera.project(in_camera_m)?, depth.into())
        };
        let unmeasured =
            |pixel: [f32; 2]| end(Point2::from(pixel.map(f64::from)), config.unmeasured_depth());
        let segment = &seen.feature.segment;
        Some(match seen.in_space {
            Some(line) => [
                measured(&line.start_m, line.start_std_dev_m)?,
                measured(&line.end_m, line.end_std_dev_m)?,
            ],
            None => [unmeasured(segment.start_px)?, unmeasured(segment.end_px)?],
        })
    }

    /// A step of the Kalman filter with one number.
    fn update(&mut self, slope: &Vector3<f64>, off: f64, variance: f64) {
        self.place.correct(slope, off, variance, &Vector3::zeros());
        self.position_m = self.place.in_map_m();
    }
}

fn mean(one: f64, other: f64) -> f64 {
    0.5 * (one + other)
}
