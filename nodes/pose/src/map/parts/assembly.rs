//! A map put together of its parts.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Isometry3;

use super::checks::{check_keyframe, check_point};
use super::{KeyframePart, MapParts, PartsError};
use crate::map::{
    FoundTimes, Id, Keyframe, KeyframeId, Landmark, LoopEdge, Map, MapError, MapLine, MapPoint,
    Sightings,
};
use crate::solve::PluckerLine;

impl Map {
    /// Puts a map together.
    ///
    /// # Errors
    /// When the parts are not those of a map: the first thing that is wrong.
    pub fn from_parts(parts: MapParts) -> Result<Self, PartsError> {
        parts.config.validate()?;
        let counts = (parts.keyframes.len(), parts.points.len(), parts.lines.len());
        let mut map = Self { next_number: parts.keyframes_so_far, ..Self::new(parts.config) };
        let mut points = Vec::with_capacity(counts.1);
        for (index, point) in parts.points.into_iter().enumerate() {
            check_point(&point).ok_or(PartsError::Number { what: "point", index })?;
            let sightings = unobserved(point.born, point.times);
            let point = MapPoint { position_m: point.position_m, look: point.look, sightings };
            points.push(map.points.insert(point).ok_or(PartsError::Full)?);
        }
        let mut lines = Vec::with_capacity(counts.2);
        for (index, line) in parts.lines.into_iter().enumerate() {
            let [start_m, end_m] = line.ends_m;
            PluckerLine::through(&start_m, &end_m)
                .ok_or(PartsError::Number { what: "line", index })?;
            let sightings = unobserved(line.born, line.times);
            let line = MapLine { start_m, end_m, descriptor: line.descriptor, sightings };
            lines.push(map.lines.insert(line).ok_or(PartsError::Full)?);
        }
        let mut rest = Vec::with_capacity(counts.0);
        let mut numbers = BTreeSet::new();
        for (index, part) in parts.keyframes.into_iter().enumerate() {
            check_keyframe(index, &part)?;
            let (number, so_far) = (part.number, parts.keyframes_so_far);
            if number >= so_far || !numbers.insert(number) {
                return Err(PartsError::Order { index, number, so_far });
            }
            rest.push(map.take_in(part)?);
        }
        let ids: Vec<KeyframeId> = rest.iter().map(|rest| rest.id).collect();
        for (index, rest) in rest.iter().enumerate() {
            map.join::<MapPoint>(index, rest.id, &rest.points, (&points, "point"))?;
            map.join::<MapLine>(index, rest.id, &rest.lines, (&lines, "line"))?;
            map.tie(index, rest, &ids)?;
        }
        let in_order = || map.keyframes.iter().map(|(id, keyframe)| (keyframe.number, id));
        map.newest = in_order().max().map(|(_, id)| id);
        let without_parent = map.keyframes.iter().find(|(_, keyframe)| keyframe.parent.is_none());
        map.root = without_parent.map(|(id, _)| id);
        map.check()?;
        Ok(map)
    }

    /// Takes a keyframe in that knows nothing of others yet; gives back what it is to know.
    fn take_in(&mut self, part: KeyframePart) -> Result<Rest, PartsError> {
        let keyframe = Keyframe {
            number: part.number,
            camera: part.camera,
            camera_from_map: part.camera_from_map,
            points: vec![None; part.points.len()],
            lines: vec![None; part.lines.len()],
            frame: part.frame,
            covisible: BTreeMap::new(),
            parent: None,
            children: BTreeSet::new(),
            loops: BTreeMap::new(),
            by_odometry: part.by_odometry,
        };
        let id = self.keyframes.insert(keyframe).ok_or(PartsError::Full)?;
        let KeyframePart { points, lines, parent, loops, .. } = part;
        Ok(Rest { id, points, lines, parent, loops })
    }

    /// A keyframe sees these landmarks.
    fn join<L: Landmark>(
        &mut self,
        index: usize,
        keyframe: KeyframeId,
        seen: &[Option<u32>],
        (landmarks, what): (&[Id<L>], &'static str),
    ) -> Result<(), PartsError> {
        for (feature, named) in seen.iter().enumerate() {
            let Some(named) = *named else { continue };
            let landmark = found(landmarks, named, (index, what))?;
            self.observe(keyframe, feature, landmark)
                .map_err(|source| PartsError::Sighting { index, source })?;
        }
        Ok(())
    }

    /// Sets the parent of a keyframe, and its loops.
    fn tie(&mut self, index: usize, rest: &Rest, ids: &[KeyframeId]) -> Result<(), PartsError> {
        if let Some(parent) = rest.parent {
            let parent = found(ids, parent, (index, "parent"))?;
            self.set_parent(rest.id, parent);
        }
        let mut loops = BTreeMap::new();
        for (other, camera_from_other) in &rest.loops {
            let other = found(ids, *other, (index, "end of a loop"))?;
            if other == rest.id {
                return Err(PartsError::Sighting { index, source: MapError::WithItself });
            }
            loops.insert(other, LoopEdge { camera_from_other: *camera_from_other });
        }
        if let Some(keyframe) = self.keyframes.get_mut(rest.id) {
            keyframe.loops = loops;
        }
        Ok(())
    }
}

/// The references of a keyframe to others, set when these exist.
struct Rest {
    id: KeyframeId,
    points: Vec<Option<u32>>,
    lines: Vec<Option<u32>>,
    parent: Option<u32>,
    loops: Vec<(u32, Isometry3<f64>)>,
}

fn unobserved(born: u64, times: FoundTimes) -> Sightings {
    Sightings { by_keyframe: BTreeMap::new(), born, times }
}

fn found<T: Copy>(
    all: &[T],
    named: u32,
    (index, what): (usize, &'static str),
) -> Result<T, PartsError> {
    let count = all.len();
    all.get(named as usize).copied().ok_or(PartsError::NotThere { index, what, named, count })
}
