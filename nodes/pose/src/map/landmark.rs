//! Points and lines that keyframes see.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::keyframe::Shared;
use super::{Arena, Id, Keyframe, KeyframeId, Map};
use crate::feature::lines::LineDescriptor;
use crate::feature::points::Descriptor;
use crate::frame::Frame;
use crate::solve::PluckerLine;

/// The keyframes that see a landmark.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Sightings {
    pub(super) by_keyframe: BTreeMap<KeyframeId, u32>,
    pub(super) born: u64,
    pub(super) times: FoundTimes,
}

/// How often frames should have seen a landmark, and how often they have.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct FoundTimes {
    /// Frames that should have.
    pub expected: u32,
    /// Those of them that have.
    pub found: u32,
}

impl FoundTimes {
    /// A frame that should have seen it, and has or has not.
    #[must_use]
    pub fn once(is_found: bool) -> Self {
        Self { expected: 1, found: u32::from(is_found) }
    }

    /// More frames.
    pub fn add(&mut self, more: Self) {
        self.expected = self.expected.saturating_add(more.expected);
        self.found = self.found.saturating_add(more.found);
    }
}

impl Sightings {
    /// The keyframes that see it, each with which of its features it is.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (KeyframeId, usize)> + '_ {
        self.by_keyframe.iter().map(|(keyframe, feature)| (*keyframe, *feature as usize))
    }

    /// How many keyframes see it; never none.
    #[must_use]
    pub fn count(&self) -> usize {
        self.by_keyframe.len()
    }

    /// Which feature of a keyframe it is.
    #[must_use]
    pub fn feature_in(&self, keyframe: KeyframeId) -> Option<usize> {
        self.by_keyframe.get(&keyframe).map(|feature| *feature as usize)
    }

    /// The number of the keyframe that brought it in.
    #[must_use]
    pub fn born(&self) -> u64 {
        self.born
    }

    /// In which share of the frames it was found that should see it; 1 before there are any.
    #[must_use]
    pub fn found_share(&self) -> f64 {
        let FoundTimes { expected, found } = self.times;
        if expected == 0 { 1.0 } else { f64::from(found) / f64::from(expected) }
    }
}

/// A point of the map.
#[derive(Clone, PartialEq, Debug)]
pub struct MapPoint {
    pub(super) position_m: Point3<f64>,
    pub(super) look: PointLook,
    pub(super) sightings: Sightings,
}

/// The appearance of a point, and the range of views (PL-SLAM section 2.2).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PointLook {
    /// Of the descriptors of all corners that are the point, the one that differs least from the others.
    pub descriptor: Descriptor,
    /// The mean of the directions from the point to the cameras that see it, of length 1.
    pub towards_cameras: Vector3<f64>,
    /// It can be found from no nearer ...
    pub nearest_m: f64,
    /// ... and no farther: the levels of the pyramid end there.
    pub farthest_m: f64,
}

/// A line of the map.
#[derive(Clone, PartialEq, Debug)]
pub struct MapLine {
    pub(super) start_m: Point3<f64>,
    pub(super) end_m: Point3<f64>,
    pub(super) descriptor: LineDescriptor,
    pub(super) sightings: Sightings,
}

impl MapPoint {
    /// Where it is in the map frame.
    #[must_use]
    pub fn position_m(&self) -> &Point3<f64> {
        &self.position_m
    }

    /// Its appearance, and the range of views.
    #[must_use]
    pub fn look(&self) -> &PointLook {
        &self.look
    }

    /// The keyframes that see it.
    #[must_use]
    pub fn sightings(&self) -> &Sightings {
        &self.sightings
    }
}

impl MapLine {
    /// The ends in the map frame: two points of the line, to be drawn and matched. From the first to the second the
    /// brighter side is on the left.
    #[must_use]
    pub fn ends_m(&self) -> [Point3<f64>; 2] {
        [self.start_m, self.end_m]
    }

    /// The line without its ends, in Plücker coordinates of the map frame. `None` for a line without length, which the map
    /// never takes in.
    #[must_use]
    pub fn plucker(&self) -> Option<PluckerLine> {
        PluckerLine::through(&self.start_m, &self.end_m)
    }

    /// Of the descriptors of all segments that are the line, the one that differs least from the others.
    #[must_use]
    pub fn descriptor(&self) -> &LineDescriptor {
        &self.descriptor
    }

    /// The keyframes that see it.
    #[must_use]
    pub fn sightings(&self) -> &Sightings {
        &self.sightings
    }
}

/// The common interface of points and lines: the operations of [`Map`] are for both.
pub trait Landmark: Clone + private::Parts {}

impl Landmark for MapPoint {}
impl Landmark for MapLine {}

pub(super) mod private {
    use super::{Arena, Frame, Id, Keyframe, Map, Shared, Sightings};

    /// Where things of the kind are kept.
    pub trait Parts: Sized {
        fn sightings(&self) -> &Sightings;
        fn sightings_mut(&mut self) -> &mut Sightings;
        fn arena(map: &Map) -> &Arena<Self>;
        fn arena_mut(map: &mut Map) -> &mut Arena<Self>;
        fn features(keyframe: &Keyframe) -> &[Option<Id<Self>>];
        fn features_mut(keyframe: &mut Keyframe) -> &mut [Option<Id<Self>>];
        fn shared(shared: &mut Shared) -> &mut u32;
        /// Whether a frame says how far such a feature is.
        fn is_measured(frame: &Frame, feature: usize) -> bool;
    }
}

impl private::Parts for MapPoint {
    fn sightings(&self) -> &Sightings {
        &self.sightings
    }

    fn sightings_mut(&mut self) -> &mut Sightings {
        &mut self.sightings
    }

    fn arena(map: &Map) -> &Arena<Self> {
        &map.points
    }

    fn arena_mut(map: &mut Map) -> &mut Arena<Self> {
        &mut map.points
    }

    fn features(keyframe: &Keyframe) -> &[Option<Id<Self>>] {
        &keyframe.points
    }

    fn features_mut(keyframe: &mut Keyframe) -> &mut [Option<Id<Self>>] {
        &mut keyframe.points
    }

    fn shared(shared: &mut Shared) -> &mut u32 {
        &mut shared.points
    }

    fn is_measured(frame: &Frame, corner: usize) -> bool {
        frame.corner_depths.get(corner).is_some_and(Option::is_some)
    }
}

impl private::Parts for MapLine {
    fn sightings(&self) -> &Sightings {
        &self.sightings
    }

    fn sightings_mut(&mut self) -> &mut Sightings {
        &mut self.sightings
    }

    fn arena(map: &Map) -> &Arena<Self> {
        &map.lines
    }

    fn arena_mut(map: &mut Map) -> &mut Arena<Self> {
        &mut map.lines
    }

    fn features(keyframe: &Keyframe) -> &[Option<Id<Self>>] {
        &keyframe.lines
    }

    fn features_mut(keyframe: &mut Keyframe) -> &mut [Option<Id<Self>>] {
        &mut keyframe.lines
    }

    fn shared(shared: &mut Shared) -> &mut u32 {
        &mut shared.lines
    }

    fn is_measured(frame: &Frame, segment: usize) -> bool {
        frame.lines_in_space.get(segment).is_some_and(Option::is_some)
    }
}
