//! Paths of a hand-held camera.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::{Path, Waypoint};
use crate::noise::{FrameNoise, Stream};

/// A smooth path in six degrees of freedom near poses, with the sway and the tremor of a person.
///
/// A uniform cubic B-spline with these poses as its controls: it begins in the first and ends in the last, both at
/// rest, and passes the others smoothly on their inner side. Its acceleration has no jumps.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Handheld {
    /// When it starts to move, in seconds since the start.
    pub start_s: f64,
    /// The time from one pose to the next.
    pub step_s: f64,
    /// `[x_m, y_m, z_m, yaw_rad, pitch_rad, roll_rad]` in the room, at least one. Yaws are counted on, beyond pi,
    /// where it turns on.
    pub near: Vec<[f64; 6]>,
    /// The strength of the tremor: 1 for a walking person, 0 for a machine.
    #[serde(default)]
    pub tremor: f64,
    /// The seed of the phases of the tremor.
    #[serde(default)]
    pub seed: u64,
}

/// Between waypoints: a velocity of 1 m/s that turns at 1 rad/s is followed within 13 um.
const WAYPOINT_STEP_S: f64 = 0.01;
/// The longest path: an hour of waypoints.
const MAX_WAYPOINTS: f64 = 360_000.0;
/// Tremor fades in and out over this time.
const FADE_S: f64 = 1.0;
/// Of positions and of angles: amplitude, frequency. The first is the sway of steps and breath, the second that of
/// the arm, the third the physiological tremor of the hand. Typical of RGB-D recordings by hand; the figures are
/// this module's.
const POSITION_TREMOR: [(f64, f64); 3] = [(0.006, 0.9), (0.002, 2.3), (0.000_4, 7.1)];
const ANGLE_TREMOR: [(f64, f64); 3] = [(0.008, 0.8), (0.004, 2.1), (0.000_8, 6.7)];

impl Handheld {
    /// The path. Without poses it is empty, which no scenario accepts; with a step that is not positive it stays at its
    /// first pose.
    #[must_use]
    pub fn path(&self) -> Path {
        let Some(first) = self.near.first() else { return Path { waypoints: Vec::new() } };
        let length_s = (self.near.len() + 1) as f64 * self.step_s;
        let moves = self.near.len() > 1 && self.step_s > 0.0 && self.start_s.is_finite();
        if !moves {
            return Path::still(*first);
        }
        let steps = (length_s / WAYPOINT_STEP_S).ceil().min(MAX_WAYPOINTS) as u32;
        let waypoints = (0..=steps)
            .map(|step| {
                let after_s = f64::from(step) * WAYPOINT_STEP_S;
                let fade =
                    smooth_step(after_s / FADE_S) * smooth_step((length_s - after_s) / FADE_S);
                let smooth = self.curve(after_s / self.step_s);
                let pose = std::array::from_fn(|axis| {
                    let value = smooth.get(axis).copied().unwrap_or_default();
                    value + fade * self.tremor * self.tremor_at(axis, after_s)
                });
                Waypoint { time_s: self.start_s + after_s, pose }
            })
            .collect();
        Path { waypoints }
    }

    /// The B-spline at a parameter from 0 to one more than there are poses: its ends count three times.
    fn curve(&self, parameter: f64) -> [f64; 6] {
        let segment = parameter.floor();
        let t = parameter - segment;
        let weights = [
            (1.0 - t).powi(3) / 6.0,
            (3.0 * t.powi(3) - 6.0 * t.powi(2) + 4.0) / 6.0,
            (-3.0 * t.powi(3) + 3.0 * t.powi(2) + 3.0 * t + 1.0) / 6.0,
            t.powi(3) / 6.0,
        ];
        let control = |index: usize| {
            let at = (segment as usize + index).saturating_sub(2).min(self.near.len() - 1);
            self.near.get(at).copied().unwrap_or_default()
        };
        let controls = [0, 1, 2, 3].map(control);
        std::array::from_fn(|axis| {
            controls.iter().zip(weights).map(|(control, weight)| weight * control[axis]).sum()
        })
    }

    fn tremor_at(&self, axis: usize, after_s: f64) -> f64 {
        let parts = if axis < 3 { POSITION_TREMOR } else { ANGLE_TREMOR };
        let phases = FrameNoise::new(self.seed, Stream::Tremor, axis as u64);
        let waves = parts.iter().enumerate().map(|(part, (amplitude, rate_hz))| {
            // No two axes have the same rate.
            let rate_hz = rate_hz * (1.0 + 0.07 * axis as f64);
            let phase = f64::from(phases.draw(part).uniform());
            amplitude * (TAU * (rate_hz * after_s + phase)).sin()
        });
        waves.sum()
    }
}

/// From 0 at 0 to 1 at 1, flat at both.
fn smooth_step(share: f64) -> f64 {
    let t = share.clamp(0.0, 1.0);
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn there_and_back(tremor: f64) -> Handheld {
        let pose = |x: f64, yaw: f64| [x, 0.5 * x, 1.2, yaw, 0.1 * x, 0.0];
        let near =
            vec![pose(0.0, 0.0), pose(1.0, 0.5), pose(2.0, 1.0), pose(1.0, 3.0), pose(0.0, 6.0)];
        Handheld { start_s: 0.5, step_s: 1.5, near, tremor, seed: 3 }
    }

    #[test]
    fn it_begins_in_the_first_pose_and_ends_in_the_last_at_rest() {
        for tremor in [0.0, 1.0] {
            let path = there_and_back(tremor).path();
            let (first, last) = (path.waypoints[0], path.waypoints[path.waypoints.len() - 1]);
            assert_eq!(first.pose, there_and_back(0.0).near[0]);
            assert!((last.time_s - 9.5).abs() < 0.011);
            let off = last.pose.iter().zip(there_and_back(0.0).near[4]).map(|(a, b)| (a - b).abs());
            assert!(off.fold(0.0, f64::max) < 1e-6);
            let moved_m = (path.position_at(0.52) - path.position_at(0.5)).norm();
            assert!(moved_m < 1e-5, "{moved_m}");
        }
    }

    #[test]
    fn velocity_and_acceleration_have_no_jumps() {
        let path = there_and_back(1.0).path();
        let positions: Vec<_> = path.waypoints.iter().map(|w| path.position_at(w.time_s)).collect();
        let velocities: Vec<_> =
            positions.windows(2).map(|p| (p[1] - p[0]) / WAYPOINT_STEP_S).collect();
        let accelerations: Vec<_> =
            velocities.windows(2).map(|v| (v[1] - v[0]) / WAYPOINT_STEP_S).collect();
        let fastest = velocities.iter().map(|v| v.norm()).fold(0.0, f64::max);
        let strongest = accelerations.iter().map(|a| a.norm()).fold(0.0, f64::max);
        let jerk = accelerations.windows(2).map(|a| (a[1] - a[0]).norm()).fold(0.0, f64::max);
        assert!((0.5..1.2).contains(&fastest), "{fastest} m/s");
        assert!((0.8..5.0).contains(&strongest), "{strongest} m/s^2");
        assert!(jerk < 1.2, "{jerk} m/s^2 within 10 ms");
    }

    #[test]
    fn the_seed_is_that_of_the_tremor_only() {
        let other = Handheld { seed: 4, ..there_and_back(1.0) };
        assert_ne!(other.path(), there_and_back(1.0).path());
        let steady = Handheld { tremor: 0.0, ..other };
        assert_eq!(steady.path(), there_and_back(0.0).path());
        let off_m =
            (there_and_back(1.0).path().position_at(4.0) - steady.path().position_at(4.0)).norm();
        assert!(off_m > 1e-4 && off_m < 0.02, "{off_m}");
    }

    #[test]
    fn what_says_nothing_is_no_trouble() {
        let with =
            |near: Vec<[f64; 6]>, step_s: f64| Handheld { near, step_s, ..there_and_back(1.0) };
        assert!(with(Vec::new(), 1.0).path().waypoints.is_empty());
        assert!(with(vec![[1.0; 6]], 1.0).path().is_still());
        for step_s in [0.0, -1.0, f64::NAN] {
            assert!(with(vec![[1.0; 6], [2.0; 6]], step_s).path().is_still());
        }
        assert!(with(vec![[1.0; 6], [2.0; 6]], f64::INFINITY).path().waypoints.len() <= 360_001);
    }
}
