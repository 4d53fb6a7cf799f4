//! The paths of the camera.

use crate::Handheld;
use crate::noise::{FrameNoise, Stream};

/// The largest deviation of a pose by the seed: metres and radians.
const VARIED_M: f64 = 0.04;
const VARIED_RAD: f64 = 0.03;
/// The time before the rig moves, in which filters may settle.
const LEAD_S: f64 = 0.7;

/// A path near poses that the seed shifts, except the first and the last.
pub(crate) fn carried(step_s: f64, mut near: Vec<[f64; 6]>, tremor: f64, seed: u64) -> Handheld {
    let inner = near.len().saturating_sub(2);
    for (index, pose) in near.iter_mut().enumerate().skip(1).take(inner) {
        let noise = FrameNoise::new(seed, Stream::Way, index as u64);
        for (axis, value) in pose.iter_mut().enumerate() {
            let most = if axis < 3 { VARIED_M } else { VARIED_RAD };
            *value += most * (2.0 * f64::from(noise.draw(axis).uniform()) - 1.0);
        }
    }
    Handheld { start_s: LEAD_S, step_s, near, tremor, seed }
}

/// Poses given as offsets from a middle one.
pub(crate) fn beside<const N: usize>(middle: [f64; 6], offsets: [[f64; 6]; N]) -> Vec<[f64; 6]> {
    offsets.map(|offset| std::array::from_fn(|axis| middle[axis] + offset[axis])).to_vec()
}

pub(super) fn along_the_axes(seed: u64) -> Handheld {
    let offsets = [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.5, 0.0, 0.0, 0.05, 0.05, 0.0],
        [0.7, 0.0, 0.05, 0.0, 0.1, 0.0],
        [0.0, 0.1, 0.0, -0.05, 0.05, 0.05],
        [0.0, 0.8, 0.0, -0.15, 0.0, 0.0],
        [0.1, 0.6, 0.3, -0.1, 0.1, -0.05],
        [0.1, -0.7, 0.3, 0.1, 0.1, 0.0],
        [0.3, -0.8, -0.2, 0.15, 0.0, 0.05],
        [0.3, 0.0, -0.4, 0.0, -0.05, 0.0],
        [0.4, 0.0, 0.5, 0.0, 0.15, 0.0],
        [0.2, 0.1, 0.3, 0.05, 0.1, 0.0],
        [0.9, -0.3, 0.1, 0.1, 0.1, 0.0],
        [0.5, 0.3, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    ];
    carried(1.3, beside([1.2, 0.0, 1.3, 0.0, 0.0, 0.0], offsets), 1.0, seed)
}

pub(crate) fn round_a_desk(seed: u64) -> Handheld {
    // On an arc of a quarter turn round the middle of the desk, back and forth, higher and lower.
    let middle_m = [2.6, 0.0];
    let pose = |angle_rad: f64, radius_m: f64, z_m: f64| {
        let pitch_rad = (z_m - 0.85).atan2(radius_m);
        [
            middle_m[0] - radius_m * angle_rad.cos(),
            middle_m[1] - radius_m * angle_rad.sin(),
            z_m,
            angle_rad,
            pitch_rad,
            0.0,
        ]
    };
    let near = vec![
        pose(0.0, 1.5, 1.3),
        pose(0.2, 1.4, 1.3),
        pose(0.6, 1.3, 1.4),
        pose(0.9, 1.2, 1.5),
        pose(0.7, 1.0, 1.3),
        pose(0.2, 0.95, 1.2),
        pose(-0.3, 1.0, 1.25),
        pose(-0.8, 1.2, 1.4),
        pose(-1.0, 1.3, 1.6),
        pose(-0.6, 1.2, 1.7),
        pose(-0.1, 1.1, 1.5),
        pose(0.3, 1.2, 1.3),
        pose(0.1, 1.4, 1.3),
        pose(0.0, 1.5, 1.3),
    ];
    carried(1.3, near, 1.0, seed)
}

pub(super) fn turning(seed: u64) -> Handheld {
    let offsets = [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.02, 0.0, 0.0, 0.2, 0.3, 0.0],
        [0.0, 0.02, 0.0, 0.0, -0.3, 0.0],
        [0.0, 0.0, 0.02, 0.0, 0.0, 0.4],
        [0.0, -0.02, 0.0, 0.1, 0.0, -0.4],
        [0.0, 0.0, 0.0, 0.6, 0.1, 0.0],
        [0.03, 0.0, 0.0, 1.4, 0.1, 0.1],
        [0.03, 0.03, 0.0, 2.2, 0.0, 0.0],
        [0.0, 0.03, 0.0, 3.0, 0.1, -0.1],
        [0.0, 0.0, 0.0, 3.8, 0.1, 0.0],
        [0.0, -0.03, 0.0, 4.6, 0.0, 0.0],
        [0.02, 0.0, 0.0, 5.4, 0.1, 0.1],
        [0.0, 0.0, 0.0, 6.1, 0.0, 0.0],
        [0.0, 0.0, 0.0, std::f64::consts::TAU, 0.0, 0.0],
    ];
    carried(1.3, beside([2.6, 0.0, 1.4, 0.0, 0.0, 0.0], offsets), 0.7, seed)
}

pub(super) fn round_the_room(seed: u64) -> Handheld {
    rounds_of_the_room(1, 1.15, seed)
}

/// Rounds of the office, with a time from pose to pose.
pub(crate) fn rounds_of_the_room(rounds: u32, step_s: f64, seed: u64) -> Handheld {
    /// The number of poses per round.
    const POSES: u32 = 16;
    let pose = |index: u32| {
        let angle_rad = f64::from(index) / f64::from(POSES) * std::f64::consts::TAU;
        // Looking along the path and a little outwards.
        let yaw_rad = angle_rad + 0.9;
        let z_m = 1.35 + 0.1 * (2.0 * angle_rad).sin();
        [3.0 + 1.3 * angle_rad.cos(), 1.3 * angle_rad.sin(), z_m, yaw_rad, 0.1, 0.0]
    };
    carried(step_s, (0..=POSES * rounds).map(pose).collect(), 1.0, seed)
}

pub(super) fn through_a_hall(seed: u64) -> Handheld {
    let near = vec![
        [1.0, 0.0, 1.5, 0.0, 0.0, 0.0],
        [1.6, 0.3, 1.5, 0.1, 0.05, 0.0],
        [2.6, 0.8, 1.5, 0.2, 0.1, 0.0],
        [3.6, 1.0, 1.55, -0.1, 0.1, 0.0],
        [4.6, 0.7, 1.5, -0.4, 0.05, 0.0],
        [5.6, 0.0, 1.5, -0.5, 0.1, 0.0],
        [6.6, -0.8, 1.5, -0.3, 0.1, 0.0],
        [7.6, -1.0, 1.55, 0.2, 0.05, 0.0],
        [8.4, -0.5, 1.5, 0.5, 0.0, 0.0],
        [8.9, 0.3, 1.5, 0.7, 0.1, 0.0],
        [9.0, 0.9, 1.5, 0.6, 0.1, 0.0],
        [9.0, 1.2, 1.5, 0.4, 0.05, 0.0],
    ];
    carried(1.45, near, 1.0, seed)
}

pub(super) fn along_a_corridor(seed: u64) -> Handheld {
    let near = (0..15)
        .map(|step: u32| {
            let step = f64::from(step);
            [
                1.0 + 0.95 * step,
                0.15 * (step * 0.9).sin(),
                1.4,
                0.06 * (step * 0.7).sin(),
                0.08,
                0.0,
            ]
        })
        .collect();
    carried(1.2, near, 1.0, seed)
}

pub(super) fn along_a_wall(seed: u64) -> Handheld {
    let offsets = [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.2, 0.4, 0.0, 0.05, 0.0, 0.0],
        [0.4, 1.0, 0.2, 0.0, 0.05, 0.03],
        [0.3, 1.6, 0.3, -0.2, 0.1, 0.0],
        [0.0, 1.2, 0.0, -0.25, -0.05, 0.0],
        [-0.3, 0.4, -0.2, 0.0, -0.1, -0.03],
        [-0.2, -0.4, 0.0, 0.1, 0.0, 0.0],
        [0.3, -1.0, 0.3, 0.25, 0.1, 0.0],
        [0.7, -1.6, 0.2, 0.3, 0.05, 0.03],
        [0.5, -1.2, -0.2, 0.1, -0.05, 0.0],
        [0.2, -0.5, -0.1, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    ];
    carried(1.45, beside([0.0, 0.0, 1.5, 0.0, 0.0, 0.0], offsets), 1.0, seed)
}

pub(super) fn shaking(seed: u64) -> Handheld {
    let offsets = [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.1, 0.0, 0.0, 0.3, 0.05, 0.0],
        [0.3, 0.1, 0.0, -0.4, 0.1, 0.0],
        [0.4, 0.3, 0.1, 0.5, 0.0, 0.1],
        [0.3, 0.5, 0.1, -0.3, 0.15, 0.0],
        [0.2, 0.3, 0.0, 0.6, -0.1, -0.1],
        [0.4, 0.0, -0.1, -0.5, 0.15, 0.0],
        [0.7, -0.3, 0.0, 0.2, 0.0, 0.1],
        [0.8, -0.5, 0.1, 0.7, 0.1, 0.0],
        [0.6, -0.3, 0.2, -0.2, 0.2, -0.1],
        [0.4, 0.0, 0.1, -0.7, 0.0, 0.0],
        [0.3, 0.3, 0.0, 0.1, -0.1, 0.1],
        [0.2, 0.4, 0.0, 0.6, 0.1, 0.0],
        [0.1, 0.2, 0.0, -0.3, 0.1, 0.0],
        [0.2, 0.0, 0.1, 0.4, 0.0, 0.0],
        [0.3, -0.2, 0.1, -0.5, 0.1, 0.1],
        [0.1, 0.0, 0.0, 0.2, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    ];
    carried(0.8, beside([1.4, 0.0, 1.35, 0.0, 0.0, 0.0], offsets), 1.5, seed)
}

pub(super) fn looking_on(seed: u64) -> Handheld {
    let offsets = [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.1, 0.2, 0.0, -0.05, 0.05, 0.0],
        [0.3, 0.4, 0.1, -0.1, 0.05, 0.0],
        [0.4, 0.2, 0.1, 0.0, 0.1, 0.02],
        [0.4, -0.2, 0.0, 0.1, 0.05, 0.0],
        [0.2, -0.5, 0.0, 0.15, 0.0, -0.02],
        [0.0, -0.3, 0.1, 0.1, 0.05, 0.0],
        [-0.2, 0.0, 0.2, 0.0, 0.1, 0.0],
        [-0.1, 0.3, 0.1, -0.1, 0.1, 0.0],
        [0.2, 0.3, 0.0, -0.1, 0.0, 0.0],
        [0.3, 0.1, 0.0, 0.0, 0.05, 0.0],
        [0.1, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    ];
    carried(1.4, beside([0.9, 0.0, 1.35, 0.0, 0.0, 0.0], offsets), 1.0, seed)
}
