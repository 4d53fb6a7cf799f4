//! Where something is at which time.

use geometry::pose_from_vector;
use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

/// A pose at a time.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Waypoint {
    /// Seconds since the start of the scenario.
    pub time_s: f64,
    /// `[x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad]` in the room.
    pub pose: [f64; 6],
}

/// A way through the room: straight at constant speed from waypoint to waypoint, still before the first and
/// after the last.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Path {
    /// At least one, their times increasing.
    pub waypoints: Vec<Waypoint>,
}

impl Path {
    /// Always at the same pose.
    #[must_use]
    pub fn still(pose: [f64; 6]) -> Self {
        Self { waypoints: vec![Waypoint { time_s: 0.0, pose }] }
    }

    /// From one place on the floor to another, facing forward: still until `start_s`, then straight at
    /// `speed_m_per_s`, then still. A speed that is not positive leaves it where it starts.
    #[must_use]
    pub fn straight(start_s: f64, from_m: [f64; 2], to_m: [f64; 2], speed_m_per_s: f64) -> Self {
        let (dx_m, dy_m) = (to_m[0] - from_m[0], to_m[1] - from_m[1]);
        let duration_s = dx_m.hypot(dy_m) / speed_m_per_s;
        let pose = |[x_m, y_m]: [f64; 2]| [x_m, y_m, 0.0, dy_m.atan2(dx_m), 0.0, 0.0];
        let mut waypoints = vec![Waypoint { time_s: start_s, pose: pose(from_m) }];
        if duration_s > 0.0 && duration_s.is_finite() {
            waypoints.push(Waypoint { time_s: start_s + duration_s, pose: pose(to_m) });
        }
        Self { waypoints }
    }

    /// Whether it never moves.
    #[must_use]
    pub fn is_still(&self) -> bool {
        self.waypoints.windows(2).all(|pair| pair[0].pose == pair[1].pose)
    }

    /// When it gets to its last waypoint.
    #[must_use]
    pub fn end_s(&self) -> f64 {
        self.waypoints.last().map_or(0.0, |waypoint| waypoint.time_s)
    }

    /// The pose at a time: takes a point of what moves to the room.
    #[must_use]
    pub fn pose_at(&self, time_s: f64) -> Isometry3<f64> {
        let next = self.waypoints.partition_point(|waypoint| waypoint.time_s <= time_s);
        let pose = |index: usize| self.waypoints.get(index).map(|w| pose_from_vector(&w.pose));
        match (next.checked_sub(1).and_then(pose), pose(next)) {
            (Some(from), Some(to)) => {
                let (from_s, to_s) = (self.waypoints[next - 1].time_s, self.waypoints[next].time_s);
                let share = (time_s - from_s) / (to_s - from_s);
                // Half a turn has no shortest way; it then keeps the old heading until it arrives.
                from.try_lerp_slerp(&to, share, 1e-9).unwrap_or(Isometry3::from_parts(
                    from.translation.vector.lerp(&to.translation.vector, share).into(),
                    from.rotation,
                ))
            }
            (Some(still), None) | (None, Some(still)) => still,
            (None, None) => Isometry3::identity(),
        }
    }

    /// Where it is at a time.
    #[must_use]
    pub fn position_at(&self, time_s: f64) -> Point3<f64> {
        self.pose_at(time_s).translation.vector.into()
    }

    /// The length of the way up to a time.
    #[must_use]
    pub fn distance_at(&self, time_s: f64) -> f64 {
        let position = |waypoint: &Waypoint| {
            let [x_m, y_m, z_m, ..] = waypoint.pose;
            Point3::new(x_m, y_m, z_m)
        };
        self.waypoints
            .windows(2)
            .take_while(|pair| pair[0].time_s < time_s)
            .map(|pair| {
                let share = (time_s - pair[0].time_s) / (pair[1].time_s - pair[0].time_s);
                (position(&pair[1]) - position(&pair[0])).norm() * share.min(1.0)
            })
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_path_keeps_its_speed_and_rests_at_its_ends() {
        let path = Path::straight(2.0, [1.0, 3.0], [1.0, -1.0], 0.5);
        assert_eq!(path.end_s(), 10.0);
        assert_eq!(path.position_at(0.0), Point3::new(1.0, 3.0, 0.0));
        assert!((path.position_at(4.0) - Point3::new(1.0, 2.0, 0.0)).norm() < 1e-12);
        assert_eq!(path.position_at(99.0), Point3::new(1.0, -1.0, 0.0));
        assert!((path.distance_at(4.0) - 1.0).abs() < 1e-12);
        assert!((path.distance_at(99.0) - 4.0).abs() < 1e-12);
        // It faces where it goes: -y.
        let forward = path.pose_at(3.0) * nalgebra::Vector3::x();
        assert!((forward + nalgebra::Vector3::y()).norm() < 1e-12);
        assert!(!path.is_still());
    }

    #[test]
    fn a_still_path_and_one_without_speed_stay() {
        let pose = [1.0, 2.0, 3.0, 0.5, 0.0, 0.0];
        assert!(Path::still(pose).is_still());
        assert_eq!(Path::still(pose).pose_at(-5.0), Path::still(pose).pose_at(5.0));
        assert!(Path::straight(1.0, [0.0, 0.0], [1.0, 0.0], 0.0).is_still());
    }

    #[test]
    fn headings_turn_the_short_way() {
        let waypoint = |time_s, yaw| Waypoint { time_s, pose: [0.0, 0.0, 0.0, yaw, 0.0, 0.0] };
        let path = Path { waypoints: vec![waypoint(0.0, 3.0), waypoint(1.0, -3.0)] };
        let heading = path.pose_at(0.5) * nalgebra::Vector3::x();
        assert!((heading + nalgebra::Vector3::x()).norm() < 1e-9);
    }
}
