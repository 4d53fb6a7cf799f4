//! The motion of the platform with the sensors.

use std::f64::consts::TAU;

use crate::scenes::RIG_POSE;
use crate::variation::{Quantity, Variation};
use crate::{Path, Spline, Waypoint};

/// A motion of the platform, from its position in the scenes of Table 2.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Platform {
    /// It does not move (Rec-HV Figure 26 A).
    Still,
    /// 0.8 m forward on a rail, a rest, and back (Figure 2 D, Figure 26 B), at 0.2 m/s.
    Rail,
    /// Forward along x at 0.1 m/s, 1 m at most (Figure 2 E, Figure 26 C).
    Drive,
    /// Through the rear of the room along a curve at 0.2 m/s, looking at the middle.
    Tour,
    /// Back and forth along x and y at up to 0.5 m/s while it turns at up to 0.5 rad/s.
    Sway,
}

const RAIL_SPEED_M_PER_S: f64 = 0.2;
const RAIL_WAY_M: f64 = 0.8;
const RAIL_REST_S: f64 = 1.0;
const DRIVE_SPEED_M_PER_S: f64 = 0.1;
const DRIVE_WAY_M: f64 = 1.0;
/// The time before it moves: more than a window of scans.
const LEAD_S: f64 = 1.0;
const TOUR_SPEED_M_PER_S: f64 = 0.2;
const TOUR_M: [[f64; 2]; 4] = [[0.5, -0.9], [0.9, -0.3], [1.25, 0.4], [0.9, 1.0]];
/// The point that it looks at on its tour.
const TOUR_LOOKS_AT_M: [f64; 2] = [3.5, 0.0];
/// The largest speed along x and along y while it sways: 0.5 m/s together.
const SWAY_SPEED_M_PER_S: f64 = 0.353;
const SWAY_TURN_RAD_PER_S: f64 = 0.5;
/// Periods along x and y and of the turning: no two of them are multiples of each other.
const SWAY_PERIODS_S: [f64; 3] = [5.0, 4.1, 3.1];
/// The time between the waypoints of a sway: with straight pieces the velocity is right within 1 %.
const SWAY_STEP_S: f64 = 0.02;
/// The longest motion: longer scenarios are at rest from then on, which bounds the path.
const MAX_SWAY_S: f64 = 600.0;

impl Platform {
    /// The path of the rig over `duration_s`. The seed varies speeds by 5 %, and the side to which it sways.
    pub(crate) fn path(self, duration_s: f64, seed: u64) -> Path {
        let variation = Variation::new(seed, Variation::PLATFORM);
        let speed = 1.0 + SPEED_SHARE * variation.symmetric(Quantity::Speed);
        let [x_m, y_m, z_m, ..] = RIG_POSE;
        let waypoint = |time_s: f64, forward_m: f64| Waypoint {
            time_s,
            pose: [x_m + forward_m, y_m, z_m, 0.0, 0.0, 0.0],
        };
        match self {
            Self::Still => Path::still(RIG_POSE),
            Self::Rail => {
                let way_s = RAIL_WAY_M / (RAIL_SPEED_M_PER_S * speed);
                let back_s = LEAD_S + way_s + RAIL_REST_S;
                Path {
                    waypoints: vec![
                        waypoint(LEAD_S, 0.0),
                        waypoint(LEAD_S + way_s, RAIL_WAY_M),
                        waypoint(back_s, RAIL_WAY_M),
                        waypoint(back_s + way_s, 0.0),
                    ],
                }
            }
            Self::Drive => {
                let way_s = DRIVE_WAY_M / (DRIVE_SPEED_M_PER_S * speed);
                Path {
                    waypoints: vec![waypoint(LEAD_S, 0.0), waypoint(LEAD_S + way_s, DRIVE_WAY_M)],
                }
            }
            Self::Tour => tour(z_m, TOUR_SPEED_M_PER_S * speed),
            Self::Sway => {
                let side = variation.side(Quantity::Direction);
                sway(
                    duration_s.min(MAX_SWAY_S),
                    SWAY_PERIODS_S.map(|period_s| period_s / speed),
                    side,
                )
            }
        }
    }
}

/// The share by which speeds vary from seed to seed.
pub(crate) const SPEED_SHARE: f64 = 0.05;

fn tour(z_m: f64, speed_m_per_s: f64) -> Path {
    let mut path = Spline::new(LEAD_S, &TOUR_M, speed_m_per_s).path();
    for waypoint in &mut path.waypoints {
        let [x_m, y_m, ..] = waypoint.pose;
        let yaw_rad = (TOUR_LOOKS_AT_M[1] - y_m).atan2(TOUR_LOOKS_AT_M[0] - x_m);
        waypoint.pose = [x_m, y_m, z_m, yaw_rad, 0.0, 0.0];
    }
    path
}

/// Sines that begin at rest and whose largest speeds are those stated, whatever their periods.
fn sway(duration_s: f64, periods_s: [f64; 3], side: f64) -> Path {
    let largest = [SWAY_SPEED_M_PER_S, SWAY_SPEED_M_PER_S, SWAY_TURN_RAD_PER_S];
    let [x_m, y_m, z_m, ..] = RIG_POSE;
    let steps = (duration_s.max(0.0) / SWAY_STEP_S) as u32;
    let waypoints = (0..=steps)
        .map(|step| {
            let time_s = f64::from(step) * SWAY_STEP_S;
            let at = |axis: usize| {
                let rate_per_s = TAU / periods_s[axis];
                largest[axis] / rate_per_s * (rate_per_s * time_s).cos()
            };
            // Along x it goes forward from its first position; along y and about z to both sides.
            let forward_m = largest[0] * periods_s[0] / TAU - at(0);
            Waypoint {
                time_s,
                pose: [x_m + forward_m, y_m - side * at(1), z_m, -side * at(2), 0.0, 0.0],
            }
        })
        .collect();
    Path { waypoints }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest speed and turning rate between waypoints.
    fn largest_rates(path: &Path) -> (f64, f64) {
        let rates = path.waypoints.windows(2).map(|pair| {
            let step_s = pair[1].time_s - pair[0].time_s;
            let (from, to) = (path.pose_at(pair[0].time_s), path.pose_at(pair[1].time_s));
            let way_m = (to.translation.vector - from.translation.vector).norm();
            (way_m / step_s, from.rotation.angle_to(&to.rotation) / step_s)
        });
        rates.fold((0.0, 0.0), |(v, w), (speed, turn)| (f64::max(v, speed), f64::max(w, turn)))
    }

    #[test]
    fn platforms_move_as_fast_as_they_say_and_begin_at_rest() {
        for seed in 0..10 {
            let rates = |platform: Platform| largest_rates(&platform.path(12.0, seed));
            assert_eq!(rates(Platform::Still), (0.0, 0.0));
            for (platform, speed_m_per_s) in
                [(Platform::Rail, 0.2), (Platform::Drive, 0.1), (Platform::Tour, 0.2)]
            {
                let (speed, turn) = rates(platform);
                assert!((speed / speed_m_per_s - 1.0).abs() <= 0.0501, "{platform:?}: {speed}");
                assert!(turn < 0.12, "{platform:?} turns at {turn} rad/s");
            }
            let (speed, turn) = rates(Platform::Sway);
            assert!((0.45..0.5).contains(&speed), "{speed} m/s");
            assert!((0.49..0.501).contains(&turn), "{turn} rad/s");
            let sway = Platform::Sway.path(12.0, seed);
            assert!((sway.position_at(0.02) - sway.position_at(0.0)).norm() < 4e-4);
        }
        let rail = Platform::Rail.path(30.0, 3);
        assert!((rail.position_at(30.0) - rail.position_at(0.0)).norm() < 1e-9);
        assert!((rail.position_at(5.5).x - 1.3).abs() < 0.06);
    }

    #[test]
    fn platforms_stay_behind_what_crosses_and_within_the_room() {
        for platform in [Platform::Rail, Platform::Drive, Platform::Tour, Platform::Sway] {
            for seed in 0..20 {
                let path = platform.path(60.0, seed);
                for waypoint in &path.waypoints {
                    let [x_m, y_m, z_m, ..] = waypoint.pose;
                    assert!((0.4..1.55).contains(&x_m) && y_m.abs() < 1.2 && z_m == 1.2);
                }
            }
        }
    }
}
