//! A sighting: an object in one scan; and the sightings of the last second.

use std::collections::VecDeque;

use nalgebra::{Point2, Vector2, distance};

/// How long sightings are kept, and how long an object that is not visible may be associated again: in this time a slow
/// walker moves 0.3 m, and a pause between two steps is over.
pub(crate) const MEMORY_MS: u32 = 1_000;

/// The class of the place of an object, by the evidence.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Space {
    /// It is in observed free space: a run of moving beams.
    Free,
    /// Some of its returns are in free space, too few for a run.
    PartlyFree,
    /// Some of its returns are not background.
    Unknown,
    /// All of its returns are background.
    Background,
}

/// What is beside an object at one side.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Side {
    /// A farther return, or none: the end of the object is visible.
    Open,
    /// Background that is nearer, and may hide a part of the object.
    BehindBackground,
    /// Another nearer surface that may move: the part that it hides changes.
    BehindOther,
}

/// An object in one scan.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Sighting {
    /// The time of the scan, in the time of the evidence.
    pub(crate) now_ms: u32,
    /// The mean of its returns in the map's plane.
    pub(crate) centroid_m: Point2<f64>,
    /// Its outermost returns to the right and to the left.
    pub(crate) ends_m: [Point2<f64>; 2],
    /// What is beside each of them.
    pub(crate) sides: [Side; 2],
    /// The position of the platform.
    pub(crate) platform_m: Point2<f64>,
    /// The largest error of its returns: of ranges, bearings and the pose.
    pub(crate) error_m: f64,
    /// The number of its returns.
    pub(crate) returns: usize,
    /// The class of its place.
    pub(crate) space: Space,
}

impl Sighting {
    /// The distance between its outermost returns.
    pub(crate) fn width_m(&self) -> f64 {
        distance(&self.ends_m[0], &self.ends_m[1])
    }

    /// Whether something nearer hides a part of it.
    pub(crate) fn is_partly_hidden(&self) -> bool {
        self.sides != [Side::Open; 2]
    }
}

/// The sightings of an object, the latest last: at least one, and none older than [`MEMORY_MS`] before the latest.
#[derive(Clone, Debug)]
pub(crate) struct History {
    earlier: VecDeque<Sighting>,
    last: Sighting,
}

impl History {
    pub(crate) fn new(first: Sighting) -> Self {
        Self { earlier: VecDeque::new(), last: first }
    }

    pub(crate) fn push(&mut self, sighting: Sighting) {
        self.earlier.push_back(self.last);
        self.last = sighting;
        let is_old = |old: &Sighting| sighting.now_ms.saturating_sub(old.now_ms) > MEMORY_MS;
        while self.earlier.front().is_some_and(is_old) {
            self.earlier.pop_front();
        }
    }

    pub(crate) fn last(&self) -> &Sighting {
        &self.last
    }

    pub(crate) fn first(&self) -> &Sighting {
        self.earlier.front().unwrap_or(&self.last)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &Sighting> {
        self.earlier.iter().chain([&self.last])
    }

    pub(crate) fn len(&self) -> usize {
        self.earlier.len() + 1
    }

    /// From the first sighting to the last.
    pub(crate) fn duration_ms(&self) -> u32 {
        self.last.now_ms.saturating_sub(self.first().now_ms)
    }

    /// Each sighting with the next one.
    pub(crate) fn steps(&self) -> impl Iterator<Item = (&Sighting, &Sighting)> {
        self.iter().zip(self.iter().skip(1))
    }

    /// The displacement of the platform meanwhile.
    pub(crate) fn platform_displacement_m(&self) -> Vector2<f64> {
        self.last.platform_m - self.first().platform_m
    }

    /// The distance from the first to the last sighting.
    pub(crate) fn displacement_m(&self) -> f64 {
        distance(&self.first().centroid_m, &self.last.centroid_m)
    }

    /// The length of the path from sighting to sighting.
    pub(crate) fn path_m(&self) -> f64 {
        self.steps().map(|(from, to)| distance(&from.centroid_m, &to.centroid_m)).sum()
    }
}
