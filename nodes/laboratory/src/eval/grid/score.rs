//! How many cells are right.

use geometry::{GridCell, OccupancyGrid, pose_from_vector};
use nalgebra::{Isometry3, Point2};
use serde::Serialize;
use simulator::Scenario;

/// How often the rig's place is taken.
const LOOK_S: f64 = 0.5;
/// What a depth camera measures.
const CAMERA_REACH_M: f64 = 5.0;
/// A line of sight is followed in steps of so many cells.
const STEP_CELLS: f64 = 0.25;

/// The score of a grid.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(super) struct GridScore {
    pub(super) free: usize,
    pub(super) occupied: usize,
    /// The share of known cells that are right.
    pub(super) right: f64,
    /// The same where a cell is right if one of the eight around it would be.
    pub(super) right_to_a_cell: f64,
    /// The known cells that are in sight or of a body, and the share of them that is right. Others are behind something or too far:
    /// what is there no sensor of the rig can tell.
    pub(super) known_to_be_seen: usize,
    pub(super) right_to_be_seen: f64,
    pub(super) free_in_body: usize,
    pub(super) occupied_beside_body: usize,
    pub(super) phantoms: usize,
    /// Free cells in sight of the sensor.
    pub(super) in_sight: usize,
    pub(super) unknown_in_sight: f64,
}

/// Compares a grid with the plan of the same cells.
pub(super) fn score(grid: &OccupancyGrid, plan: &OccupancyGrid, in_sight: &[bool]) -> GridScore {
    let (mut right, mut near, mut phantoms, mut beside, mut in_body) = (0, 0, 0, 0, 0);
    let (mut to_be_seen, mut right_to_be_seen) = (0, 0);
    for (index, (cell, truth)) in grid.cells.iter().zip(&plan.cells).enumerate() {
        if *cell == GridCell::Unknown {
            continue;
        }
        let is_near = is_around(plan, index, *cell);
        right += usize::from(cell == truth);
        near += usize::from(cell == truth || is_near);
        if *truth == GridCell::Occupied || in_sight.get(index).copied().unwrap_or_default() {
            to_be_seen += 1;
            right_to_be_seen += usize::from(cell == truth);
        }
        if cell != truth {
            match (cell, is_near) {
                (GridCell::Free, _) => in_body += 1,
                (_, true) => beside += 1,
                (_, false) => phantoms += 1,
            }
        }
    }
    let (free, occupied) = (grid.count(GridCell::Free), grid.count(GridCell::Occupied));
    let share = |part: usize, of: usize| part as f64 / of.max(1) as f64;
    let seen = in_sight.iter().filter(|seen| **seen).count();
    let unknown = in_sight
        .iter()
        .zip(&grid.cells)
        .filter(|(seen, cell)| **seen && **cell == GridCell::Unknown)
        .count();
    GridScore {
        free,
        occupied,
        right: share(right, free + occupied),
        right_to_a_cell: share(near, free + occupied),
        known_to_be_seen: to_be_seen,
        right_to_be_seen: share(right_to_be_seen, to_be_seen),
        free_in_body: in_body,
        occupied_beside_body: beside,
        phantoms,
        in_sight: seen,
        unknown_in_sight: share(unknown, seen),
    }
}

/// Whether one of the eight cells around is so.
fn is_around(plan: &OccupancyGrid, index: usize, state: GridCell) -> bool {
    let (x, y) = ((index % plan.width) as i32, (index / plan.width) as i32);
    let [least_x, least_y] = plan.least;
    (-1..=1).any(|dy| {
        (-1..=1).any(|dx| {
            let cell = [least_x + x + dx, least_y + y + dy];
            (dx, dy) != (0, 0) && plan.index(cell).is_some() && plan.at(cell) == state
        })
    })
}

/// What a sensor sees.
pub(super) struct Sight {
    /// Its places in the plane of the map, and the directions of its middle.
    looks: Vec<(Point2<f64>, f64)>,
    half_view_rad: f64,
    /// Nearer than this the sensor sees nothing that is as low as it must be for a cell to be free.
    near_m: f64,
    reach_m: f64,
    /// Its height above the room's floor at the start.
    pub(super) height_m: f64,
}

impl Sight {
    pub(super) fn of_camera(scenario: &Scenario, free_below_m: f64) -> Self {
        let camera = &scenario.rig.depth_camera;
        let rig_from_camera = pose_from_vector(&camera.rig_from_camera);
        let half_view_rad = (0.5 * camera.camera.width_px as f64 / camera.camera.fx_px).atan();
        let sight = Self::of(scenario, &rig_from_camera, half_view_rad, CAMERA_REACH_M);
        let down = 0.5 * camera.camera.height_px as f64 / camera.camera.fy_px;
        Self { near_m: ((sight.height_m - free_below_m) / down).max(0.0), ..sight }
    }

    pub(super) fn of_scanner(scenario: &Scenario) -> Self {
        let rig_from_lidar = pose_from_vector(&scenario.rig.lidar.rig_from_lidar);
        Self::of(scenario, &rig_from_lidar, std::f64::consts::PI, scenario.rig.lidar.range_max_m)
    }

    fn of(
        scenario: &Scenario,
        rig_from_sensor: &Isometry3<f64>,
        half_view_rad: f64,
        reach_m: f64,
    ) -> Self {
        let looks = (scenario.duration_s / LOOK_S) as u32;
        let look = |look: u32| {
            let map_from_rig = scenario.map_from_rig(f64::from(look) * LOOK_S);
            let ahead = map_from_rig * nalgebra::Vector3::x();
            let place = (map_from_rig * rig_from_sensor).translation.vector;
            (Point2::from(place.xy()), ahead.y.atan2(ahead.x))
        };
        let mut looks: Vec<_> = (0..=looks).map(look).collect();
        looks.dedup();
        let room_from_sensor =
            scenario.map_from_room().inverse() * scenario.map_from_rig(0.0) * rig_from_sensor;
        Self {
            looks,
            half_view_rad,
            near_m: 0.0,
            reach_m,
            height_m: room_from_sensor.translation.z,
        }
    }

    /// For each cell whether it is free by the plan and in sight.
    pub(super) fn cells(&self, plan: &OccupancyGrid) -> Vec<bool> {
        let resolution_m = plan.resolution_m;
        let middle = |index: usize| {
            let along =
                |least: i32, cell: usize| (f64::from(least) + cell as f64 + 0.5) * resolution_m;
            Point2::new(
                along(plan.least[0], index % plan.width),
                along(plan.least[1], index / plan.width),
            )
        };
        let sees = |place: &Point2<f64>| {
            self.looks.iter().any(|(from, ahead_rad)| {
                let way = place - from;
                let (range_m, azimuth_rad) = (way.norm(), way.y.atan2(way.x));
                let aside_rad = nalgebra::wrap(
                    azimuth_rad - ahead_rad,
                    -std::f64::consts::PI,
                    std::f64::consts::PI,
                );
                if !(self.near_m..=self.reach_m).contains(&range_m)
                    || aside_rad.abs() > self.half_view_rad
                {
                    return false;
                }
                let steps = (range_m / (STEP_CELLS * resolution_m)).ceil();
                (0..steps as u32).all(|step| {
                    let at = (from + way * (f64::from(step) / steps)) / resolution_m;
                    plan.at([at.x.floor() as i32, at.y.floor() as i32]) != GridCell::Occupied
                })
            })
        };
        plan.cells
            .iter()
            .enumerate()
            .map(|(index, cell)| *cell == GridCell::Free && sees(&middle(index)))
            .collect()
    }
}

#[cfg(test)]
mod tests;
