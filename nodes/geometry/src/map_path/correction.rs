//! How a correction of the map has moved it, moment by moment.

use nalgebra::{Isometry3, Point3, Translation3};

use super::PathVertex;
use crate::Stamp;

/// The motion of the map around one moment of the trajectory.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PathKnot {
    /// When the platform was there.
    pub stamp: Stamp,
    /// Where the map of before had it.
    pub place_m: Point3<f64>,
    /// Takes a point of the map of before, as seen from there, to where it is now.
    pub now_from_before: Isometry3<f64>,
}

impl PathKnot {
    /// `new * old^-1`: the same whatever point of the platform the path is of.
    pub(super) fn between(before: &PathVertex, now: &PathVertex) -> Self {
        let place_m = before.map_from_rig.translation.vector.into();
        // The product of a pose with its own inverse is not the identity to the bit.
        let now_from_before = if before.map_from_rig == now.map_from_rig {
            Isometry3::identity()
        } else {
            now.map_from_rig * before.map_from_rig.inverse()
        };
        Self { stamp: now.stamp, place_m, now_from_before }
    }

    /// How far something moves, at most, that is no farther from the platform than `reach_m`.
    #[must_use]
    pub fn shift_m(&self, reach_m: f64) -> f64 {
        let shift_m = (self.now_from_before * self.place_m - self.place_m).norm();
        shift_m + self.now_from_before.rotation.angle() * reach_m
    }

    fn stays(&self) -> bool {
        self.now_from_before == Isometry3::identity()
    }
}

/// The motion of the map, as a function of the time at which a part of it was seen.
#[derive(Clone, PartialEq, Debug)]
pub struct PathCorrection {
    /// Never empty, by rising stamp.
    knots: Vec<PathKnot>,
}

impl PathCorrection {
    /// `None` without knots.
    pub(super) fn new(knots: Vec<PathKnot>) -> Option<Self> {
        (!knots.is_empty()).then_some(Self { knots })
    }

    /// The moments at which it is known, by rising stamp; never empty.
    #[must_use]
    pub fn knots(&self) -> &[PathKnot] {
        &self.knots
    }

    /// The same without the knots that move points within `reach_m` of them by at most `tolerance_m`: those stay.
    #[must_use]
    pub fn beyond(&self, tolerance_m: f64, reach_m: f64) -> Self {
        let knots = self.knots.iter().map(|knot| {
            if knot.shift_m(reach_m) > tolerance_m {
                *knot
            } else {
                PathKnot { now_from_before: Isometry3::identity(), ..*knot }
            }
        });
        Self { knots: knots.collect() }
    }

    /// Whether nothing moves.
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.knots.iter().all(PathKnot::stays)
    }

    /// The period in which the correction moves something: points seen before or after it stay. The same moment twice, or later and
    /// earlier, where nothing moves.
    #[must_use]
    pub fn span(&self) -> (Stamp, Stamp) {
        let (earliest, latest) = (Stamp::from_nanos(i64::MIN), Stamp::from_nanos(i64::MAX));
        let moves = |knot: &PathKnot| !knot.stays();
        let Some(first) = self.knots.iter().position(moves) else { return (latest, earliest) };
        let after = self.knots.iter().rposition(moves).and_then(|last| self.knots.get(last + 1));
        let before = first.checked_sub(1).and_then(|index| self.knots.get(index));
        (before.map_or(earliest, |knot| knot.stamp), after.map_or(latest, |knot| knot.stamp))
    }

    /// Whether there is a knot at this moment that moves nothing.
    pub(super) fn stays_at(&self, stamp: Stamp) -> bool {
        let index = self.knots.binary_search_by_key(&stamp, |knot| knot.stamp);
        index.ok().and_then(|index| self.knots.get(index)).is_some_and(PathKnot::stays)
    }

    /// How far something moves, at most, that is no farther from the platform than `reach_m`.
    #[must_use]
    pub fn largest_shift_m(&self, reach_m: f64) -> f64 {
        self.knots.iter().map(|knot| knot.shift_m(reach_m)).fold(0.0, f64::max)
    }

    /// Takes a point of the earlier map that was seen at this moment to where it is now: between two knots a motion
    /// interpolated linearly in time about the place between; before the first knot that of the first, after the last that of
    /// the last.
    #[must_use]
    pub fn at(&self, stamp: Stamp) -> Isometry3<f64> {
        let later = self.knots.partition_point(|knot| knot.stamp <= stamp);
        let before = later.checked_sub(1).and_then(|index| self.knots.get(index));
        match (before, self.knots.get(later)) {
            (Some(before), Some(after)) => between(before, after, stamp),
            (Some(only), None) | (None, Some(only)) => only.now_from_before,
            (None, None) => Isometry3::identity(),
        }
    }
}

fn between(before: &PathKnot, after: &PathKnot, stamp: Stamp) -> Isometry3<f64> {
    if before.now_from_before == after.now_from_before {
        return before.now_from_before;
    }
    let share = stamp.seconds_since(before.stamp) / after.stamp.seconds_since(before.stamp);
    // About a place near by: about the origin a small turn would bend the path of points far from it.
    let place_m = nalgebra::center(&before.place_m, &after.place_m);
    let moved = |knot: &PathKnot| (knot.now_from_before * place_m).coords;
    let moved_m = moved(before).lerp(&moved(after), share);
    let (from, to) = (before.now_from_before.rotation, after.now_from_before.rotation);
    // Half a turn apart there is no unique rotation between them.
    let rotation = from.try_slerp(&to, share, f64::EPSILON).unwrap_or(from);
    Isometry3::from_parts(Translation3::from(moved_m - rotation * place_m.coords), rotation)
}
