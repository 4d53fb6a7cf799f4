//! Landmarks that something nearer hides, and what has come before them.
//!
//! A landmark that is hidden is evidence neither for nor against anything. What hides one that the camera has seen through the
//! very place was not there then: it has come since, and may go as it came. It is no part of the static scene.
//!
//! How near things are is known where features have depths: a place in the image is as near as the feature nearest to it.

use std::collections::BTreeSet;

use geometry::CameraModel;
use nalgebra::{Point2, Point3};

use super::{Association, Associations, LocalMap, LocalMapConfig, Verdicts, View};
use crate::frame::{Frame, LeftOut};
use crate::solve::Verdict;

/// What a frame hides, and by what.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Hidden {
    /// Points that something nearer hides.
    pub points: BTreeSet<usize>,
    /// Lines likewise.
    pub lines: BTreeSet<usize>,
    /// Features of what has come before points that were seen through its place.
    pub newcomers: LeftOut,
}

impl LocalMap {
    /// What is hidden from this view, given what is seen.
    #[must_use]
    pub fn hidden(
        &self,
        view: &View<'_>,
        associations: &Associations,
        verdicts: Verdicts<'_>,
    ) -> Hidden {
        let (points_seen, corners_seen) = inliers(&associations.points, verdicts.points);
        let (lines_seen, segments_seen) = inliers(&associations.lines, verdicts.lines);
        let View { frame, camera, camera_from_map, .. } = view;
        let surface = Surface { spots: Spots::new(spots(frame)), camera, config: &self.config };
        let (mut hidden, mut backdrops) = (Hidden::default(), Vec::new());
        for index in &associations.predicted_points {
            let point = self.points.get(*index).filter(|point| point.is_located(&self.config));
            let Some(point) = point else { continue };
            let in_camera_m = camera_from_map * point.position_m;
            let Some(spot) = spot(camera, &in_camera_m) else { continue };
            let before_m = surface.before(&spot).filter(|_| !points_seen.contains(index));
            let Some(before_m) = before_m else {
                backdrops.push(spot);
                continue;
            };
            hidden.points.insert(*index);
            let seen_from_m = camera_from_map * point.seen_from_m();
            if surface.is_pierced(&seen_from_m, &in_camera_m, before_m) {
                backdrops.push(Spot { is_covered: true, ..spot });
            }
        }
        let lines = &associations.predicted_lines;
        for index in lines.iter().filter(|index| !lines_seen.contains(index)) {
            let middle_m = self.lines.get(*index).map(|line| camera_from_map * line.middle_m());
            let middle = middle_m.and_then(|middle_m| spot(camera, &middle_m));
            if middle.and_then(|middle| surface.before(&middle)).is_some() {
                hidden.lines.insert(*index);
            }
        }
        if backdrops.iter().any(|spot| spot.is_covered) {
            let backdrops = Spots::new(backdrops);
            let corners = self.newcoming_corners(frame, &backdrops, &corners_seen);
            let segments = self.newcoming_segments(frame, &backdrops, &segments_seen);
            hidden.newcomers.add(corners, segments);
        }
        hidden
    }

    fn newcoming_corners(
        &self,
        frame: &Frame,
        backdrops: &Spots,
        seen: &BTreeSet<usize>,
    ) -> impl Iterator<Item = usize> {
        let corners = frame.corners.iter().zip(&frame.corner_depths).enumerate();
        corners.filter_map(|(index, (corner, depth))| {
            let depth_m = depth.map(|depth| depth.depth_m);
            let is_new = !seen.contains(&index) && self.is_before(backdrops, corner.pixel, depth_m);
            is_new.then_some(index)
        })
    }

    fn newcoming_segments(
        &self,
        frame: &Frame,
        backdrops: &Spots,
        seen: &BTreeSet<usize>,
    ) -> impl Iterator<Item = usize> {
        let lines = frame.lines.iter().zip(&frame.lines_in_space).enumerate();
        lines.filter_map(|(index, (line, in_space))| {
            let [start, end] = [line.segment.start_px, line.segment.end_px].map(Point2::from);
            let depth_m = in_space.map(|line| nalgebra::center(&line.start_m, &line.end_m).z);
            let mut places = [start, nalgebra::center(&start, &end), end].into_iter();
            let is_new = !seen.contains(&index)
                && places.any(|place| self.is_before(backdrops, place, depth_m));
            is_new.then_some(index)
        })
    }

    /// Whether a feature is on what has come before something. What lies far behind it, beside the thing that it is on, says nothing
    /// of it.
    fn is_before(&self, backdrops: &Spots, pixel: Point2<f32>, depth_m: Option<f64>) -> bool {
        let says = |spot: &Spot| {
            depth_m
                .is_none_or(|depth_m| spot.is_covered == self.config.hides(depth_m, spot.depth_m))
        };
        backdrops.nearest(pixel, says).is_some_and(|spot| spot.is_covered)
    }
}

/// The landmarks, and the features, of the associations that the verdicts accept.
fn inliers(pairs: &[Association], verdicts: &[Verdict]) -> (BTreeSet<usize>, BTreeSet<usize>) {
    let inliers = pairs.iter().zip(verdicts).filter(|(_, verdict)| verdict.is_inlier());
    inliers.map(|(pair, _)| (pair.landmark, pair.feature)).unzip()
}

/// What the camera sees.
struct Surface<'a> {
    spots: Spots,
    camera: &'a CameraModel,
    config: &'a LocalMapConfig,
}

impl Surface<'_> {
    fn depth_m(&self, pixel: Point2<f32>) -> Option<f64> {
        self.spots.nearest(pixel, |_| true).map(|spot| spot.depth_m)
    }

    /// The depth of what hides something.
    fn before(&self, spot: &Spot) -> Option<f64> {
        self.depth_m(spot.pixel).filter(|depth_m| self.config.hides(*depth_m, spot.depth_m))
    }

    /// Whether one who looked from there to a point looked through what hides it now, at a depth of `before_m`.
    fn is_pierced(&self, from_m: &Point3<f64>, to_m: &Point3<f64>, before_m: f64) -> bool {
        let share = (before_m - from_m.z) / (to_m.z - from_m.z);
        if !(0.0..=1.0).contains(&share) {
            return false;
        }
        let through = spot(self.camera, &(from_m + share * (to_m - from_m)));
        let depth_m = through.and_then(|through| self.depth_m(through.pixel));
        depth_m.is_some_and(|depth_m| !self.config.hides(before_m, depth_m))
    }
}

/// A place in an image with its depth.
#[derive(Clone, Copy)]
struct Spot {
    pixel: Point2<f32>,
    depth_m: f64,
    /// Whether something has come before it.
    is_covered: bool,
}

fn spot(camera: &CameraModel, in_camera_m: &Point3<f64>) -> Option<Spot> {
    let pixel = camera.project(in_camera_m).filter(|pixel| camera.contains(pixel))?;
    Some(Spot { pixel: pixel.cast(), depth_m: in_camera_m.z, is_covered: false })
}

/// All that has a depth.
fn spots(frame: &Frame) -> Vec<Spot> {
    let spot = |pixel, depth_m| Spot { pixel, depth_m, is_covered: false };
    let corners = frame.corners.iter().zip(&frame.corner_depths);
    let corners =
        corners.filter_map(|(corner, depth)| Some(spot(corner.pixel, depth.as_ref()?.depth_m)));
    let lines = frame.lines.iter().zip(&frame.lines_in_space).filter_map(|(line, in_space)| {
        let (segment, in_space) = (&line.segment, in_space.as_ref()?);
        let start = spot(segment.start_px.into(), in_space.start_m.z);
        Some([start, spot(segment.end_px.into(), in_space.end_m.z)])
    });
    corners.chain(lines.flatten()).collect()
}

/// Spots, by column.
struct Spots(Vec<Spot>);

impl Spots {
    fn new(mut spots: Vec<Spot>) -> Self {
        spots.sort_by(|a, b| a.pixel.x.total_cmp(&b.pixel.x));
        Self(spots)
    }

    /// The nearest one of those that are wanted.
    fn nearest<'a>(
        &'a self,
        pixel: Point2<f32>,
        is_wanted: impl Fn(&Spot) -> bool,
    ) -> Option<&'a Spot> {
        let middle = self.0.partition_point(|spot| spot.pixel.x < pixel.x);
        let (left, right) = self.0.split_at_checked(middle)?;
        let (mut nearest, mut least_px2) = (None, f32::INFINITY);
        // Whether one of a column farther off may still be nearer.
        let mut look = |spot: &'a Spot| {
            let off = spot.pixel - pixel;
            if off.norm_squared() < least_px2 && is_wanted(spot) {
                (nearest, least_px2) = (Some(spot), off.norm_squared());
            }
            off.x * off.x < least_px2
        };
        let _ = left.iter().rev().all(&mut look);
        let _ = right.iter().all(&mut look);
        nearest
    }
}
