//! Curved paths.

use nalgebra::Point2;
use serde::{Deserialize, Serialize};

use super::{Path, Waypoint};

/// Pieces of the polygon that a segment of the curve is measured with: a segment of 2 m is then followed
/// within a millimetre, and headings turn by a few degrees from piece to piece.
const PIECES_PER_SEGMENT: usize = 40;

/// A smooth path on the floor through places, at constant speed, facing forward.
///
/// A Catmull-Rom curve (Catmull and Rom 1974), centripetal, so that it neither loops nor overshoots between
/// places that are close to each other (Yuksel, Schaefer and Keyser 2011).
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spline {
    /// When it starts to move, in seconds since the start.
    pub start_s: f64,
    /// The places `[x_m, y_m]` in the room, at least one.
    pub through_m: Vec<[f64; 2]>,
    /// The speed.
    pub speed_m_per_s: f64,
    /// The time of the rest, in seconds since the start; it then stays at its position for `pause_s`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pause_at_s: Option<f64>,
    /// The duration of the rest.
    #[serde(default)]
    pub pause_s: f64,
}

impl Spline {
    /// A path through places without a rest.
    #[must_use]
    pub fn new(start_s: f64, through_m: &[[f64; 2]], speed_m_per_s: f64) -> Self {
        Self {
            start_s,
            through_m: through_m.to_vec(),
            speed_m_per_s,
            pause_at_s: None,
            pause_s: 0.0,
        }
    }

    /// The path. Without places it is empty, which no scenario accepts; with a speed that is not positive it stays at its
    /// first place.
    #[must_use]
    pub fn path(&self) -> Path {
        let path = self.moving_path();
        match self.pause_at_s {
            Some(at_s) => path.pausing(at_s, self.pause_s),
            None => path,
        }
    }

    fn moving_path(&self) -> Path {
        let places_m = distinct(&self.through_m);
        let polygon_m = polygon(&places_m);
        let still = |place: &Point2<f64>, yaw_rad: f64, time_s: f64| Waypoint {
            time_s,
            pose: [place.x, place.y, 0.0, yaw_rad, 0.0, 0.0],
        };
        let mut waypoints: Vec<Waypoint> =
            polygon_m.first().map(|place| still(place, 0.0, self.start_s)).into_iter().collect();
        if !(self.speed_m_per_s > 0.0 && self.speed_m_per_s.is_finite()) {
            return Path { waypoints };
        }
        let mut time_s = self.start_s;
        for pair in polygon_m.windows(2) {
            let along = pair[1] - pair[0];
            let next_s = time_s + along.norm() / self.speed_m_per_s;
            // Pieces too short for different times are left out.
            if next_s > time_s {
                let yaw_rad = along.y.atan2(along.x);
                if let [first] = waypoints.as_mut_slice() {
                    first.pose[3] = yaw_rad;
                }
                waypoints.push(still(&pair[1], yaw_rad, next_s));
                time_s = next_s;
            }
        }
        Path { waypoints }
    }
}

/// The places without repetitions, which have no direction.
fn distinct(places_m: &[[f64; 2]]) -> Vec<Point2<f64>> {
    const SAME_PLACE_M: f64 = 1e-6;
    let mut distinct: Vec<Point2<f64>> = Vec::with_capacity(places_m.len());
    for place in places_m.iter().copied().map(Point2::from) {
        if distinct.last().is_none_or(|last| (place - last).norm() > SAME_PLACE_M) {
            distinct.push(place);
        }
    }
    distinct
}

/// The curve as a polygon.
fn polygon(places_m: &[Point2<f64>]) -> Vec<Point2<f64>> {
    let mut polygon_m: Vec<Point2<f64>> = places_m.first().copied().into_iter().collect();
    for (index, pair) in places_m.windows(2).enumerate() {
        // Beyond its ends the curve is extended straight.
        let before = index.checked_sub(1).map_or(pair[0] - (pair[1] - pair[0]), |at| places_m[at]);
        let after =
            places_m.get(index + 2).copied().unwrap_or_else(|| pair[1] + (pair[1] - pair[0]));
        let control = [before, pair[0], pair[1], after];
        polygon_m.extend(
            (1..=PIECES_PER_SEGMENT)
                .map(|piece| centripetal(&control, piece as f64 / PIECES_PER_SEGMENT as f64)),
        );
    }
    polygon_m
}

/// The point at a share of the way from the second to the third of four control points: the pyramid of
/// Barry and Goldman (1988) with knots apart by the square root of the distance.
fn centripetal(control: &[Point2<f64>; 4], share: f64) -> Point2<f64> {
    let mut knots = [0.0; 4];
    for at in 1..4 {
        knots[at] = knots[at - 1] + (control[at] - control[at - 1]).norm().sqrt();
    }
    let at = knots[1] + share * (knots[2] - knots[1]);
    let mix = |a: Point2<f64>, b: Point2<f64>, from: f64, to: f64| {
        a + (b - a) * ((at - from) / (to - from))
    };
    let [a, b, c] = [0, 1, 2].map(|i| mix(control[i], control[i + 1], knots[i], knots[i + 1]));
    let d = mix(a, b, knots[0], knots[2]);
    let e = mix(b, c, knots[1], knots[3]);
    mix(d, e, knots[1], knots[2])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_spline_meets_its_places_at_constant_speed_facing_forward() {
        let places_m = [[2.0, -3.0], [3.0, -1.0], [2.2, 1.0], [2.6, 3.0]];
        let path = Spline::new(1.5, &places_m, 1.4).path();
        let nearest_m = |place: [f64; 2]| {
            path.waypoints
                .iter()
                .map(|w| (w.pose[0] - place[0]).hypot(w.pose[1] - place[1]))
                .fold(f64::INFINITY, f64::min)
        };
        assert!(places_m.iter().all(|&place| nearest_m(place) < 1e-9));
        assert_eq!((path.start_s(), path.position_at(0.0).x), (1.5, 2.0));
        for pair in path.waypoints.windows(2) {
            let middle_s = f64::midpoint(pair[0].time_s, pair[1].time_s);
            let step_s = pair[1].time_s - pair[0].time_s;
            let way_m = path.distance_at(pair[1].time_s) - path.distance_at(pair[0].time_s);
            assert!((way_m / step_s - 1.4).abs() < 1e-9);
            let forward = path.pose_at(middle_s) * nalgebra::Vector3::x();
            let going = path.position_at(pair[1].time_s) - path.position_at(pair[0].time_s);
            assert!(forward.dot(&going.normalize()) > 0.99, "at {middle_s} s");
        }
        // It is a curve: longer than the polygon through its places, and smooth.
        assert!(path.distance_at(99.0) > 2.2 + 2.1 + 2.0);
    }

    #[test]
    fn a_straight_row_of_places_is_a_straight_path() {
        let spline = Spline::new(0.0, &[[0.0, 0.0], [1.0, 0.0], [4.0, 0.0]], 2.0).path();
        assert!((spline.end_s() - 2.0).abs() < 1e-9);
        assert!(spline.waypoints.iter().all(|w| w.pose[1].abs() < 1e-12 && w.pose[3] == 0.0));
    }

    #[test]
    fn places_that_say_nothing_are_no_trouble() {
        assert!(Spline::new(0.0, &[], 1.0).path().waypoints.is_empty());
        assert_eq!(Spline::new(0.0, &[[1.0, 2.0]; 5], 1.0).path().waypoints.len(), 1);
        assert!(Spline::new(0.0, &[[1.0, 2.0], [2.0, 2.0]], 0.0).path().is_still());
        assert!(Spline::new(0.0, &[[1.0, 2.0], [2.0, 2.0]], f64::NAN).path().is_still());
    }

    proptest! {
        #[test]
        fn times_increase_whatever_the_places(
            places_m in prop::collection::vec(prop::array::uniform2(-50.0..50.0), 1..8),
            speed_m_per_s in 0.01..10.0,
        ) {
            let path = Spline::new(0.0, &places_m, speed_m_per_s).path();
            prop_assert!(path.waypoints.windows(2).all(|p| p[0].time_s < p[1].time_s));
            prop_assert!(path.waypoints.iter().all(|w| w.pose.iter().all(|v| v.is_finite())));
        }
    }
}
