//! Poses over time.

mod handheld;
mod spline;
mod written;

use geometry::pose_from_vector;
use nalgebra::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

pub use handheld::Handheld;
pub use spline::Spline;
use written::WrittenPath;

/// A pose at a time.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Waypoint {
    /// Seconds since the start of the scenario.
    pub time_s: f64,
    /// `[x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad]` in the room.
    pub pose: [f64; 6],
}

/// A path through the room: straight at constant speed from waypoint to waypoint, at rest before the first and
/// after the last. A file may give a `spline` or a `handheld` path instead of the `waypoints`: see
/// [`Spline`] and [`Handheld`].
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(try_from = "WrittenPath")]
pub struct Path {
    /// At least one, with increasing times.
    pub waypoints: Vec<Waypoint>,
}

impl Path {
    /// At rest at one pose.
    #[must_use]
    pub fn still(pose: [f64; 6]) -> Self {
        Self { waypoints: vec![Waypoint { time_s: 0.0, pose }] }
    }

    /// From one place on the floor to another, facing forward: at rest until `start_s`, then straight at
    /// `speed_m_per_s`, then at rest. With a speed that is not positive it stays at the start.
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

    /// The same path with a rest of `pause_s` at the time `at_s`, which delays the rest of the path.
    /// A pause that is not positive, or not within the path's times, changes nothing.
    #[must_use]
    pub fn pausing(&self, at_s: f64, pause_s: f64) -> Self {
        let next = self.waypoints.partition_point(|waypoint| waypoint.time_s <= at_s);
        let on_the_way = next > 0 && next < self.waypoints.len();
        if !(on_the_way && pause_s > 0.0) {
            return self.clone();
        }
        let before = &self.waypoints[next - 1];
        let share = (at_s - before.time_s) / (self.waypoints[next].time_s - before.time_s);
        let mut pose = before.pose;
        for (value, to) in pose.iter_mut().zip(self.waypoints[next].pose).take(3) {
            *value += (to - *value) * share;
        }
        let (roll_rad, pitch_rad, yaw_rad) = self.pose_at(at_s).rotation.euler_angles();
        [pose[3], pose[4], pose[5]] = [yaw_rad, pitch_rad, roll_rad];
        let mut waypoints = self.waypoints[..next].to_vec();
        if before.time_s < at_s {
            waypoints.push(Waypoint { time_s: at_s, pose });
        }
        waypoints.push(Waypoint { time_s: at_s + pause_s, pose });
        waypoints.extend(
            self.waypoints[next..]
                .iter()
                .map(|waypoint| Waypoint { time_s: waypoint.time_s + pause_s, ..*waypoint }),
        );
        Self { waypoints }
    }

    /// Whether it never moves.
    #[must_use]
    pub fn is_still(&self) -> bool {
        self.waypoints.windows(2).all(|pair| pair[0].pose == pair[1].pose)
    }

    /// The time at its first waypoint.
    #[must_use]
    pub fn start_s(&self) -> f64 {
        self.waypoints.first().map_or(0.0, |waypoint| waypoint.time_s)
    }

    /// The time at its last waypoint.
    #[must_use]
    pub fn end_s(&self) -> f64 {
        self.waypoints.last().map_or(0.0, |waypoint| waypoint.time_s)
    }

    /// The pose at a time: the transform from the object's frame to the room.
    #[must_use]
    pub fn pose_at(&self, time_s: f64) -> Isometry3<f64> {
        let next = self.waypoints.partition_point(|waypoint| waypoint.time_s <= time_s);
        let pose = |index: usize| self.waypoints.get(index).map(|w| pose_from_vector(&w.pose));
        match (next.checked_sub(1).and_then(pose), pose(next)) {
            (Some(from), Some(to)) => {
                let (from_s, to_s) = (self.waypoints[next - 1].time_s, self.waypoints[next].time_s);
                let share = (time_s - from_s) / (to_s - from_s);
                // For half a turn the shortest rotation is ambiguous; it then keeps the old heading until it arrives.
                from.try_lerp_slerp(&to, share, 1e-9).unwrap_or(Isometry3::from_parts(
                    from.translation.vector.lerp(&to.translation.vector, share).into(),
                    from.rotation,
                ))
            }
            (Some(still), None) | (None, Some(still)) => still,
            (None, None) => Isometry3::identity(),
        }
    }

    /// The position at a time.
    #[must_use]
    pub fn position_at(&self, time_s: f64) -> Point3<f64> {
        self.pose_at(time_s).translation.vector.into()
    }

    /// The length of the path up to a time.
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
mod tests;
