//! The paths of the camera.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::odometry::ways::{beside, carried, rounds_of_the_room};
use crate::{Path, Waypoint};

/// The middle of the desk, on its top, and a position from which it fills the image.
const DESK_M: [f64; 3] = [2.6, 0.0, 0.8];
const BEFORE_THE_DESK: [f64; 6] = [1.1, 0.0, 1.3, 0.0, 0.3, 0.0];
/// The time without light, in the scenario with such a time.
pub(super) const DARK_S: [f64; 2] = [22.0, 52.0];

/// Back and forth along x, y and z, twice, hardly turning.
pub(super) fn along_the_axes(step_s: f64, reach_m: f64, seed: u64) -> Path {
    const TURN_RAD: f64 = 0.06;
    let mut offsets = [[0.0; 6]; 19];
    for (index, offset) in offsets.iter_mut().enumerate() {
        let axis = (index / 3) % 3;
        // Out to one side, to the other, and to the middle.
        let side = [1.0, -1.0, 0.0][index % 3];
        offset[axis] = side * reach_m;
        offset[3 + axis] = side * TURN_RAD;
    }
    offsets[0] = [0.0; 6];
    carried(step_s, beside(BEFORE_THE_DESK, offsets), 1.0, seed).path()
}

/// A pose at a position, looking at the desk.
fn looking_at_the_desk([x_m, y_m, z_m]: [f64; 3]) -> [f64; 6] {
    let [dx_m, dy_m, dz_m] = [DESK_M[0] - x_m, DESK_M[1] - y_m, DESK_M[2] - z_m];
    [x_m, y_m, z_m, dy_m.atan2(dx_m), (-dz_m).atan2(dx_m.hypot(dy_m)), 0.0]
}

/// On half a sphere of a metre, its pole above, looking at the desk.
pub(super) fn on_half_a_sphere(seed: u64) -> Path {
    const CENTRE_M: [f64; 3] = [1.5, 0.0, 1.1];
    const RADIUS_M: f64 = 0.5;
    let at = |azimuth_rad: f64, elevation_rad: f64| {
        looking_at_the_desk([
            CENTRE_M[0] - RADIUS_M * elevation_rad.cos() * azimuth_rad.cos(),
            CENTRE_M[1] - RADIUS_M * elevation_rad.cos() * azimuth_rad.sin(),
            CENTRE_M[2] + RADIUS_M * elevation_rad.sin(),
        ])
    };
    // From the middle to one side and over the pole to the other, again higher, and back.
    let near = vec![
        at(0.0, 0.2),
        at(0.5, 0.2),
        at(1.1, 0.2),
        at(1.4, 0.3),
        at(1.3, 0.7),
        at(1.2, 1.1),
        at(0.0, 1.4),
        at(-1.2, 1.1),
        at(-1.3, 0.6),
        at(-1.4, 0.2),
        at(-1.0, 0.1),
        at(-0.5, 0.4),
        at(-0.2, 0.8),
        at(0.2, 1.1),
        at(0.8, 0.7),
        at(0.6, 0.3),
        at(0.1, 0.1),
        at(0.0, 0.2),
    ];
    carried(1.2, near, 1.0, seed).path()
}

/// Once round the desk, looking at it.
pub(super) fn all_round_a_desk(seed: u64) -> Path {
    /// The number of poses of the round.
    const POSES: u32 = 20;
    const RADIUS_M: f64 = 1.6;
    let pose = |index: u32| {
        let angle_rad = f64::from(index) / f64::from(POSES) * TAU;
        let z_m = 1.35 + 0.15 * (2.0 * angle_rad).sin();
        let (x_m, y_m) =
            (DESK_M[0] - RADIUS_M * angle_rad.cos(), DESK_M[1] - RADIUS_M * angle_rad.sin());
        let [.., pitch_rad, roll_rad] = looking_at_the_desk([x_m, y_m, z_m]);
        // The yaw is counted on.
        [x_m, y_m, z_m, angle_rad, pitch_rad, roll_rad]
    };
    carried(1.4, (0..=POSES).map(pose).collect(), 1.0, seed).path()
}

/// Along a plane at a distance of 1.5 m, out, across and back to the start.
pub(super) fn along_a_plane(seed: u64) -> Path {
    let offsets = [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.05, 0.5, 0.0, 0.05, 0.0, 0.0],
        [0.1, 1.1, 0.1, 0.0, 0.05, 0.02],
        [0.0, 1.7, 0.2, -0.1, 0.05, 0.0],
        [-0.1, 1.9, 0.45, -0.1, 0.1, 0.0],
        [0.0, 1.4, 0.6, 0.0, 0.1, -0.02],
        [0.1, 0.6, 0.5, 0.05, 0.1, 0.0],
        [0.1, -0.2, 0.5, 0.0, 0.05, 0.0],
        [0.0, -1.0, 0.4, 0.1, 0.1, 0.02],
        [-0.1, -1.6, 0.1, 0.1, 0.0, 0.0],
        [0.0, -1.8, -0.3, 0.1, -0.1, 0.0],
        [0.1, -1.2, -0.4, 0.0, -0.1, -0.02],
        [0.05, -0.5, -0.2, 0.0, -0.05, 0.0],
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    ];
    carried(1.4, beside([1.1, 0.0, 1.5, 0.0, 0.0, 0.0], offsets), 1.0, seed).path()
}

/// Along the panels at a distance of about a metre, and half of the path back.
pub(super) fn along_panels(seed: u64) -> Path {
    let near = (0..16)
        .map(|step: u32| {
            let phase_rad = f64::from(step) / 15.0 * 1.5 * std::f64::consts::PI;
            let y_m = -1.8 * phase_rad.cos();
            [0.0, y_m, 1.2 + 0.15 * (2.0 * phase_rad).sin(), -0.05 * y_m, 0.0, 0.0]
        })
        .collect();
    carried(1.3, near, 1.0, seed).path()
}

/// From one pose of a round to the next.
const ROUND_STEP_S: f64 = 1.3;

/// Three rounds.
pub(super) fn round_and_round(seed: u64) -> Path {
    rounds_of_the_room(3, ROUND_STEP_S, seed).path()
}

/// A round; then at another place of it for some seconds; then at its start again.
pub(super) fn carried_off(seed: u64) -> Path {
    /// The time from the last image there to the first one here.
    const CARRIED_S: f64 = 0.01;
    let mut path = rounds_of_the_room(1, ROUND_STEP_S, seed).path();
    let there = carried(
        1.2,
        beside(
            [3.0, -1.2, 1.4, 0.9 - FRAC_PI_2, 0.1, 0.0],
            [
                [0.0; 6],
                [0.1, 0.1, 0.0, 0.2, 0.0, 0.0],
                [-0.1, 0.2, 0.1, 0.1, 0.1, 0.0],
                [0.0, 0.0, 0.0, -0.2, 0.0, 0.0],
            ],
        ),
        1.0,
        seed,
    );
    let again = carried(
        1.2,
        beside(
            [4.2, 0.2, 1.35, 0.8, 0.1, 0.0],
            [
                [0.0; 6],
                [-0.1, 0.2, 0.0, 0.2, 0.0, 0.0],
                [-0.2, 0.3, 0.1, 0.3, 0.1, 0.0],
                [-0.2, 0.4, 0.0, 0.5, 0.0, 0.0],
            ],
        ),
        1.0,
        seed,
    );
    for next in [there, again] {
        let begin_s = path.end_s() + CARRIED_S;
        let waypoints = next.path().waypoints.into_iter().map(|waypoint| Waypoint {
            time_s: begin_s + waypoint.time_s - next.start_s,
            ..waypoint
        });
        path.waypoints.extend(waypoints);
    }
    path
}
