//! A map taken apart: what cannot be found out from anything else, under plain indices. To be saved, and put together again.
//!
//! The keyframes that see a landmark, the covisibility, and the children of a keyframe follow from the rest, and are no parts: they
//! cannot be wrong after assembly. Ids are assigned again, in the order of those before, so that anything that depends on
//! their order continues alike.
#![cfg_attr(not(test), deny(clippy::indexing_slicing))]

mod assembly;
mod checks;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::sync::Arc;

use geometry::{CameraModel, CameraModelError, ParameterError};
use nalgebra::{Isometry3, Point3};

use super::{
    Arena, ByOdometry, FoundTimes, Id, Inconsistency, Keyframe, Map, MapConfig, MapError, MapLine,
    MapPoint, PointLook,
};
use crate::feature::lines::LineDescriptor;
use crate::frame::Frame;

/// A map taken apart. Indices are places in its lists.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct MapParts {
    /// The parameters that it was made with.
    pub config: MapConfig,
    /// How many keyframes have ever come in.
    pub keyframes_so_far: u64,
    /// The keyframes.
    pub keyframes: Vec<KeyframePart>,
    /// The points.
    pub points: Vec<PointPart>,
    /// The lines.
    pub lines: Vec<LinePart>,
}

/// A keyframe; see [`Keyframe`].
#[derive(Clone, PartialEq, Debug)]
pub struct KeyframePart {
    /// Its sequence number in the map.
    pub number: u64,
    /// The rectified camera.
    pub camera: CameraModel,
    /// Where it was.
    pub camera_from_map: Isometry3<f64>,
    /// Its features.
    pub frame: Arc<Frame>,
    /// Which point each corner is.
    pub points: Vec<Option<u32>>,
    /// Which line each segment is.
    pub lines: Vec<Option<u32>>,
    /// Its parent in the spanning tree; `None` for the root.
    pub parent: Option<u32>,
    /// The keyframes that loops lead to, and their cameras' poses in the frame of this one's.
    pub loops: Vec<(u32, Isometry3<f64>)>,
    /// Its pose by odometry, if there was one.
    pub by_odometry: Option<ByOdometry>,
}

/// A point; see [`MapPoint`].
#[derive(Clone, PartialEq, Debug)]
pub struct PointPart {
    /// Where it is in the map frame.
    pub position_m: Point3<f64>,
    /// Its appearance.
    pub look: PointLook,
    /// The number of the keyframe that brought it in.
    pub born: u64,
    /// How often it was expected and found.
    pub times: FoundTimes,
}

/// A line; see [`MapLine`].
#[derive(Clone, PartialEq, Debug)]
pub struct LinePart {
    /// Its ends in the map frame.
    pub ends_m: [Point3<f64>; 2],
    /// Its appearance.
    pub descriptor: LineDescriptor,
    /// The number of the keyframe that brought it in.
    pub born: u64,
    /// How often it was expected and found.
    pub times: FoundTimes,
}

/// The parts are not those of a map.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum PartsError {
    /// A parameter has a value that means nothing.
    #[error(transparent)]
    Config(#[from] ParameterError),
    /// A number is not finite, or not what it must be.
    #[error("{what} {index} has a number that is not finite, or out of its range")]
    Number {
        /// Of which kind of thing.
        what: &'static str,
        /// Which one.
        index: usize,
    },
    /// A camera's numbers do not describe a camera.
    #[error("keyframe {index}: {source}")]
    Camera {
        /// Whose.
        index: usize,
        /// What is wrong.
        source: CameraModelError,
    },
    /// Lists that belong together differ in length.
    #[error("keyframe {index} has {features} features, and lists the landmarks of {listed}")]
    Features {
        /// Which.
        index: usize,
        /// Corners or segments.
        features: usize,
        /// The length of the other list.
        listed: usize,
    },
    /// Something is named that is not there.
    #[error("keyframe {index} names {what} {named} of {count}")]
    NotThere {
        /// Which keyframe.
        index: usize,
        /// A kind of thing.
        what: &'static str,
        /// Its index.
        named: u32,
        /// How many there are.
        count: usize,
    },
    /// The number of a keyframe is not its own, or not of the past.
    #[error(
        "keyframe {index} has the number {number}, which another has, or which {so_far} have not reached"
    )]
    Order {
        /// Which.
        index: usize,
        /// Its number.
        number: u64,
        /// How many keyframes have ever come in.
        so_far: u64,
    },
    /// A keyframe shows a landmark twice, or is both ends of a loop.
    #[error("keyframe {index}: {source}")]
    Sighting {
        /// Which.
        index: usize,
        /// The value in the map.
        source: MapError,
    },
    /// The whole is invalid.
    #[error(transparent)]
    Inconsistent(#[from] Inconsistency),
    /// There are too many things of the kind.
    #[error("too many parts for a map")]
    Full,
}

impl Map {
    /// Takes the map apart. What is large is shared with it.
    #[must_use]
    pub fn parts(&self) -> MapParts {
        let keyframes = ranks(&self.keyframes);
        let (points, lines) = (ranks(&self.points), ranks(&self.lines));
        let keyframe = |keyframe: &Keyframe| KeyframePart {
            number: keyframe.number,
            camera: keyframe.camera,
            camera_from_map: keyframe.camera_from_map,
            frame: Arc::clone(&keyframe.frame),
            points: ranked(&keyframe.points, &points),
            lines: ranked(&keyframe.lines, &lines),
            parent: keyframe.parent.and_then(|parent| keyframes.get(&parent).copied()),
            loops: keyframe
                .loops
                .iter()
                .filter_map(|(other, edge)| Some((*keyframes.get(other)?, edge.camera_from_other)))
                .collect(),
            by_odometry: keyframe.by_odometry,
        };
        let point = |point: &MapPoint| PointPart {
            position_m: point.position_m,
            look: point.look,
            born: point.sightings.born,
            times: point.sightings.times,
        };
        let line = |line: &MapLine| LinePart {
            ends_m: line.ends_m(),
            descriptor: line.descriptor,
            born: line.sightings.born,
            times: line.sightings.times,
        };
        MapParts {
            config: self.config,
            keyframes_so_far: self.next_number,
            keyframes: self.keyframes.iter().map(|(_, found)| keyframe(found)).collect(),
            points: self.points.iter().map(|(_, found)| point(found)).collect(),
            lines: self.lines.iter().map(|(_, found)| line(found)).collect(),
        }
    }
}

/// The index of each thing among its kind.
fn ranks<T>(arena: &Arena<T>) -> BTreeMap<Id<T>, u32> {
    arena.ids().zip(0..).collect()
}

fn ranked<T>(ids: &[Option<Id<T>>], ranks: &BTreeMap<Id<T>, u32>) -> Vec<Option<u32>> {
    ids.iter().map(|id| ranks.get(id.as_ref()?).copied()).collect()
}
