//! Whether an object is a leaf that turns about its hinges: a door, a window, the door of a cupboard.
//!
//! It is flat in each cycle, one of its ends remains in its place, and the other goes round that end. Nobody who walks, stands or turns
//! is flat or has such an end.

use nalgebra::Vector2;

use super::footprint::Footprint;

/// The end at the hinges is where it was, and the leaf as long: the noise of a voxel's place at each side, and what of the leaf is taken
/// for the frame.
const SAME_M: f64 = 0.15;
/// A leaf that has turned by less may be a plane whose noise is another; 20 degrees.
const LEAST_TURN_RAD: f64 = 0.35;
/// A leaf whose ends have moved by no more rests.
const REST_M: f64 = 0.1;

/// What the cycles show of an object that may be a leaf.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Hinge {
    /// It from when on one of its ends has been in its place.
    first: Option<Footprint>,
    /// Where it has rested, and since when.
    rest: Option<(Footprint, f64)>,
    is_found: bool,
}

impl Hinge {
    /// Takes what a cycle shows.
    pub(super) fn see(&mut self, footprint: Option<Footprint>, now_s: f64) {
        let Some(now) = footprint.filter(Footprint::is_flat) else {
            // It is joined with who opens it, or is none.
            (self.first, self.rest) = (None, None);
            return;
        };
        match self.first.and_then(|first| turn_rad(&first, &now)) {
            Some(turn_rad) => self.is_found |= turn_rad >= LEAST_TURN_RAD,
            None => self.first = Some(now),
        }
        if self.rest.is_none_or(|(rest, _)| rest.distance_m(&now) > REST_M) {
            self.rest = Some((now, now_s));
        }
    }

    /// For how long it has been a leaf at rest; `None` where it is none.
    pub(super) fn rested_s(&self, now_s: f64) -> Option<f64> {
        self.rest.filter(|_| self.is_found).map(|(_, since_s)| now_s - since_s)
    }
}

/// By how much a footprint has turned about one of its ends; `None` where neither is in its place.
fn turn_rad(first: &Footprint, now: &Footprint) -> Option<f64> {
    let from_end = |footprint: &Footprint, end: usize| -> Vector2<f64> {
        footprint.ends_m[1 - end] - footprint.ends_m[end]
    };
    let ends = [(0, 0), (0, 1), (1, 0), (1, 1)].into_iter();
    let turns = ends.filter_map(|(of_first, of_now)| {
        let apart_m = (first.ends_m[of_first] - now.ends_m[of_now]).norm();
        let (was_m, is_m) = (from_end(first, of_first), from_end(now, of_now));
        let is_same = apart_m <= SAME_M && (was_m.norm() - is_m.norm()).abs() <= SAME_M;
        is_same.then(|| was_m.angle(&is_m))
    });
    turns.reduce(f64::max)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use nalgebra::Point3;

    use super::*;

    const CYCLE_S: f64 = 0.14;

    /// The front of a thing, `thickness_m` deep, that is 0.8 m long and 1.9 m high, with an end at a place.
    fn footprint(end_m: [f64; 2], angle_rad: f64, thickness_m: f64) -> Option<Footprint> {
        let points_m: Vec<Point3<f64>> = (0..10)
            .flat_map(|along| (0..24).map(move |up| (f64::from(along), f64::from(up))))
            .map(|(along, up)| {
                let along_m = 0.08 * (along + 0.5);
                let across_m = thickness_m * (PI * along_m / 0.8).sin();
                let (sin, cos) = angle_rad.sin_cos();
                Point3::new(
                    end_m[0] + along_m * cos - across_m * sin,
                    end_m[1] + along_m * sin + across_m * cos,
                    0.08 * up,
                )
            })
            .collect();
        Footprint::of(&points_m.iter().collect::<Vec<_>>())
    }

    /// For how long it rests after a motion of a second and a rest of another.
    fn rested_s(place: impl Fn(f64) -> ([f64; 2], f64), thickness_m: f64) -> Option<f64> {
        let mut hinge = Hinge::default();
        let cycles_s = || (0..15).map(|cycle| f64::from(cycle) * CYCLE_S);
        for now_s in cycles_s() {
            let (end_m, angle_rad) = place(now_s.min(1.0));
            hinge.see(footprint(end_m, angle_rad, thickness_m), now_s);
        }
        hinge.rested_s(2.0)
    }

    #[test]
    fn a_flat_thing_that_turns_about_its_end_is_a_leaf() {
        let swings = |time_s: f64| ([2.0, 1.0], -FRAC_PI_2 * time_s);
        assert!(rested_s(swings, 0.0).is_some_and(|rested_s| (0.8..=1.2).contains(&rested_s)));
        assert_eq!(rested_s(swings, 0.15), None, "it is as thick as a body");
    }

    #[test]
    fn what_is_flat_and_goes_or_turns_about_its_middle_is_none() {
        let goes = |time_s: f64| ([2.0, 1.0 + time_s], 0.5);
        assert_eq!(rested_s(goes, 0.0), None);
        let turns = |time_s: f64| {
            let (sin, cos) = time_s.sin_cos();
            ([2.0 - 0.4 * cos, 1.0 - 0.4 * sin], time_s)
        };
        assert_eq!(rested_s(turns, 0.0), None);
        assert_eq!(rested_s(|_| ([2.0, 1.0], 0.5), 0.0), None, "it has not turned");
    }
}
