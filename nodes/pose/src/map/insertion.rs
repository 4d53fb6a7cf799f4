//! Keyframes and landmarks come in.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use estimation::perturbation::is_rigid;
use geometry::CameraModel;
use nalgebra::{Isometry3, Point3};

use super::landmark::Sightings;
use super::{
    ByOdometry, Keyframe, KeyframeId, LineId, Map, MapError, MapLine, MapPoint, PointId, look,
};
use crate::frame::Frame;
use crate::solve::PluckerLine;

/// A frame that is to be kept.
#[derive(Clone, Debug)]
pub struct NewKeyframe<'a> {
    /// The rectified camera.
    pub camera: CameraModel,
    /// Where it was.
    pub camera_from_map: Isometry3<f64>,
    /// Its features.
    pub frame: Arc<Frame>,
    /// Which of its corners are which points, as tracking has found.
    pub points: &'a [(usize, PointId)],
    /// Which of its segments are which lines.
    pub lines: &'a [(usize, LineId)],
    /// Its pose by odometry, if there was one.
    pub by_odometry: Option<ByOdometry>,
}

/// A line that a keyframe shows for the first time: its ends in the map frame.
pub type NewLine = [Point3<f64>; 2];

impl Map {
    /// Adds a keyframe. Its parent is the one that sees most of the same landmarks, of equal ones the newest; where none
    /// does, the newest of all: the camera came from there.
    ///
    /// A landmark that is gone meanwhile, or named twice, is ignored.
    ///
    /// # Errors
    /// When the pose is not finite, or the map full.
    pub fn insert_keyframe(&mut self, new: NewKeyframe<'_>) -> Result<KeyframeId, MapError> {
        let by_odometry = new.by_odometry.iter();
        if !by_odometry.map(|by| &by.camera_from_odom).chain([&new.camera_from_map]).all(is_rigid) {
            return Err(MapError::NotFinite);
        }
        let keyframe = Keyframe {
            number: self.next_number,
            camera: new.camera,
            camera_from_map: new.camera_from_map,
            points: vec![None; new.frame.corners.len()],
            lines: vec![None; new.frame.lines.len()],
            frame: new.frame,
            covisible: BTreeMap::new(),
            parent: None,
            children: BTreeSet::new(),
            loops: BTreeMap::new(),
            by_odometry: new.by_odometry,
        };
        let id = self.keyframes.insert(keyframe).ok_or(MapError::Full)?;
        self.next_number += 1;
        for &(feature, point) in new.points {
            // It refuses only those that are ignored here.
            self.observe(id, feature, point).ok();
        }
        for &(feature, line) in new.lines {
            self.observe(id, feature, line).ok();
        }
        let most = self.neighbours(id, 1).first().map(|(neighbour, _)| *neighbour);
        match most.or(self.newest) {
            Some(parent) => self.set_parent(id, parent),
            None => self.root = Some(id),
        }
        self.newest = Some(id);
        Ok(id)
    }

    /// Takes a point in that a keyframe shows as one of its corners.
    ///
    /// # Errors
    /// When the keyframe or the corner is not there, the corner is another point, or the place is not finite.
    pub fn insert_point(
        &mut self,
        keyframe: KeyframeId,
        corner: usize,
        position_m: &Point3<f64>,
    ) -> Result<PointId, MapError> {
        if !position_m.iter().all(|value| value.is_finite()) {
            return Err(MapError::NotFinite);
        }
        self.free_feature::<MapPoint>(keyframe, corner)?;
        let from = self.keyframes.get(keyframe).ok_or(MapError::NoKeyframe(keyframe))?;
        let look = look::of_one(&self.config, from, corner, position_m);
        let look = look.ok_or(MapError::NotFinite)?;
        let sightings = Sightings { born: from.number, ..Sightings::default() };
        let point = MapPoint { position_m: *position_m, look, sightings };
        let id = self.points.insert(point).ok_or(MapError::Full)?;
        self.observe(keyframe, corner, id)?;
        Ok(id)
    }

    /// Takes a line in that a keyframe shows as one of its segments.
    ///
    /// # Errors
    /// When the keyframe or the segment is not there, the segment is another line, or the line has no length.
    pub fn insert_line(
        &mut self,
        keyframe: KeyframeId,
        segment: usize,
        ends_m: &NewLine,
    ) -> Result<LineId, MapError> {
        let [start_m, end_m] = *ends_m;
        PluckerLine::through(&start_m, &end_m).ok_or(MapError::NotFinite)?;
        self.free_feature::<MapLine>(keyframe, segment)?;
        let from = self.keyframes.get(keyframe).ok_or(MapError::NoKeyframe(keyframe))?;
        let feature = from.frame.lines.get(segment);
        let features = from.frame.lines.len();
        let feature = feature.ok_or(MapError::NoFeature { feature: segment, features })?;
        let (descriptor, born) = (feature.descriptor, from.number);
        let sightings = Sightings { born, ..Sightings::default() };
        let line = MapLine { start_m, end_m, descriptor, sightings };
        let id = self.lines.insert(line).ok_or(MapError::Full)?;
        self.observe(keyframe, segment, id)?;
        Ok(id)
    }
}
