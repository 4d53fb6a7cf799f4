//! A road scene for LiDAR odometry: once round a block of houses and on.

mod street;

use std::f64::consts::TAU;

use crate::{Handheld, Path, Scenario, Scene, Velodyne, VelodyneModel};

/// The corners of a block, along the middle of the road, and the path round it.
type Corners = [[f64; 2]; 4];
const CORNERS_M: Corners = [[0.0, 0.0], [90.0, 0.0], [90.0, 60.0], [0.0, 60.0]];
/// A block whose other sides are out of the scanner's range: two kilometres round it.
const LONG_CORNERS_M: Corners = [[0.0, 0.0], [600.0, 0.0], [600.0, 400.0], [0.0, 400.0]];
/// The mean speed: 30 km/h.
const SPEED_M_PER_S: f64 = 8.3;
/// The distance of the control points of the path: corners are rounded by about that.
const STEP_M: f64 = 8.3;
/// The scanner's height over the road: that of KITTI's car (Geiger et al. 2012).
const HEIGHT_M: f64 = 1.73;
/// The path begins in the middle of the first side.
const BEGINS_M: f64 = 30.0;
/// How far it goes on after one round.
const OVERLAP_M: f64 = 20.0;
/// The distance of the lane to the right of the middle of the road.
const LANE_M: f64 = 1.7;

impl Scenario {
    /// A car with a 3D scanner drives round a block between houses, parked cars and poles, and repeats the first 20 m:
    /// some 40 s at 30 km/h. The scene is the same for every seed; the noise and, by centimetres, the path are not. There
    /// are a 2D scanner and a depth camera, as everywhere, but they are useless here.
    #[must_use]
    pub fn road(model: VelodyneModel, seed: u64) -> Self {
        Self::round_block("road", &CORNERS_M, model, seed)
    }

    /// The same round a block of two kilometres, whose other sides the scanner does not see: how far an odometry drifts.
    #[must_use]
    pub fn long_road(model: VelodyneModel, seed: u64) -> Self {
        Self::round_block("long road", &LONG_CORNERS_M, model, seed)
    }

    fn round_block(name: &str, corners_m: &Corners, model: VelodyneModel, seed: u64) -> Self {
        let path = way(corners_m, seed);
        let duration_s = path.end_s() + 0.5;
        let scene = Scene { bodies: street::bodies(corners_m), ..Scene::default() };
        let mut scenario =
            Self { name: name.to_owned(), seed, duration_s, scene, ..Self::default() };
        scenario.rig.path = path;
        scenario.rig.velodyne = Some(Velodyne { model, ..Velodyne::default() });
        scenario.rig.depth_camera = scenario.rig.depth_camera.with_size(64, 48);
        scenario.rig.depth_camera.rate_hz = 1.0;
        scenario
    }
}

/// Along the right lane round the block, facing forward.
fn way(corners_m: &Corners, seed: u64) -> Path {
    let round_m: f64 = sides(corners_m).iter().map(|side| side.length_m).sum();
    let steps = ((round_m + OVERLAP_M) / STEP_M) as u32;
    let near = (0..=steps)
        .map(|step| {
            let [x_m, y_m] = lane_at(corners_m, (BEGINS_M + f64::from(step) * STEP_M) % round_m);
            [x_m, y_m, HEIGHT_M, 0.0, 0.0, 0.0]
        })
        .collect();
    // The car body on its springs sways like a hand, but less.
    let carried =
        Handheld { start_s: 0.5, step_s: STEP_M / SPEED_M_PER_S, near, tremor: 0.4, seed };
    facing_forward(carried.path())
}

struct Side {
    from_m: [f64; 2],
    along: [f64; 2],
    length_m: f64,
}

fn sides(corners_m: &Corners) -> Vec<Side> {
    let next = corners_m.iter().cycle().skip(1);
    corners_m
        .iter()
        .zip(next)
        .map(|(from, to)| {
            let (dx_m, dy_m) = (to[0] - from[0], to[1] - from[1]);
            let length_m = dx_m.hypot(dy_m);
            Side { from_m: *from, along: [dx_m / length_m, dy_m / length_m], length_m }
        })
        .collect()
}

/// A point of the lane, by the distance along the middle of the road.
fn lane_at(corners_m: &Corners, mut way_m: f64) -> [f64; 2] {
    let sides = sides(corners_m);
    for side in &sides {
        if way_m <= side.length_m {
            let [ax, ay] = side.along;
            // Right of the direction of travel.
            return [
                side.from_m[0] + ax * way_m + ay * LANE_M,
                side.from_m[1] + ay * way_m - ax * LANE_M,
            ];
        }
        way_m -= side.length_m;
    }
    corners_m[0]
}

/// The same path with the heading along it: the yaw is added to the sway.
fn facing_forward(mut path: Path) -> Path {
    /// Slower than this a path has no direction; the next or the last one is used.
    const SLOW_M: f64 = 1e-4;
    let places: Vec<[f64; 2]> = path.waypoints.iter().map(|w| [w.pose[0], w.pose[1]]).collect();
    let mut yaws_rad: Vec<Option<f64>> = places
        .iter()
        .enumerate()
        .map(|(index, _)| {
            let before = places.get(index.saturating_sub(10))?;
            let after = places.get((index + 10).min(places.len() - 1))?;
            let (dx_m, dy_m) = (after[0] - before[0], after[1] - before[1]);
            (dx_m.hypot(dy_m) > SLOW_M).then(|| dy_m.atan2(dx_m))
        })
        .collect();
    let first = yaws_rad.iter().flatten().next().copied().unwrap_or_default();
    let mut last_rad = first;
    for yaw_rad in &mut yaws_rad {
        // Counted on beyond pi, so that it turns the short way.
        let next = yaw_rad.unwrap_or(last_rad);
        last_rad = next - TAU * ((next - last_rad) / TAU).round();
        *yaw_rad = Some(last_rad);
    }
    for (waypoint, yaw_rad) in path.waypoints.iter_mut().zip(yaws_rad) {
        waypoint.pose[3] += yaw_rad.unwrap_or_default();
    }
    path
}

#[cfg(test)]
mod tests;
