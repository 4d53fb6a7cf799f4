//! The true floor plan: which cells of a grid static bodies take up between two heights.

use std::ops::RangeInclusive;

use geometry::{GridCell, OccupancyGrid};
use nalgebra::{Point3, Vector3};

use crate::solid::Solid;
use crate::{Ray, Scenario};

/// Vertical rays a cell, along each axis.
const SAMPLES: usize = 5;
/// Rays start and end beyond anything.
const FAR_M: f64 = 1e3;

impl Scenario {
    /// The plan of what never moves, in the cells of a grid in the map: occupied where a body reaches into the cell between two
    /// heights above the room's floor (z = 0 of the room), else free. By 25 vertical rays a cell. Panes count as bodies.
    #[must_use]
    pub fn floor_plan(
        &self,
        cells_of: &OccupancyGrid,
        heights_m: &RangeInclusive<f64>,
    ) -> OccupancyGrid {
        let solids = self.scene.static_solids();
        let room_from_map = self.map_from_room().inverse();
        let mut plan = OccupancyGrid { stamp: self.start, ..cells_of.clone() };
        for (index, cell) in plan.cells.iter_mut().enumerate() {
            let (x, y) = (index % cells_of.width, index / cells_of.width);
            let is_taken = (0..SAMPLES * SAMPLES).any(|sample| {
                let share = |part: usize| (part as f64 + 0.5) / SAMPLES as f64;
                let along = |least: i32, cell: usize, part: usize| {
                    (f64::from(least) + cell as f64 + share(part)) * cells_of.resolution_m
                };
                let in_map = Point3::new(
                    along(cells_of.least[0], x, sample % SAMPLES),
                    along(cells_of.least[1], y, sample / SAMPLES),
                    0.0,
                );
                let in_room = room_from_map * in_map;
                solids.iter().any(|solid| reaches_into(solid, &in_room, heights_m))
            });
            *cell = if is_taken { GridCell::Occupied } else { GridCell::Free };
        }
        plan
    }
}

/// Whether a solid takes up a part of a vertical line between two heights.
fn reaches_into(solid: &Solid, place: &Point3<f64>, heights_m: &RangeInclusive<f64>) -> bool {
    let height_along = |from_m: f64, direction: f64| {
        let origin = Point3::new(place.x, place.y, from_m);
        let ray = Ray { origin, direction: Vector3::new(0.0, 0.0, direction) };
        let hit = solid.shape.intersect(&ray.transformed(&solid.solid_from_room))?;
        Some(from_m + direction * hit.parameter)
    };
    if solid.shape.is_convex() {
        // From above where it begins, from below where it ends.
        let (top_m, bottom_m) = (height_along(FAR_M, -1.0), height_along(-FAR_M, 1.0));
        return top_m.zip(bottom_m).is_some_and(|(top_m, bottom_m)| {
            bottom_m <= *heights_m.end() && top_m >= *heights_m.start()
        });
    }
    // Of triangles only the surface is known.
    height_along(*heights_m.end(), -1.0).is_some_and(|height_m| height_m >= *heights_m.start())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Body, Material, Scene};

    fn plan(bodies: Vec<Body>, heights_m: RangeInclusive<f64>) -> OccupancyGrid {
        let scene = Scene { bodies, ..Scene::default() };
        let grid = OccupancyGrid {
            resolution_m: 0.1,
            least: [-10, -10],
            width: 20,
            height: 20,
            cells: vec![GridCell::Unknown; 400],
            ..OccupancyGrid::default()
        };
        Scenario { scene, ..Scenario::default() }.floor_plan(&grid, &heights_m)
    }

    #[test]
    fn a_body_takes_up_its_cells_where_it_reaches_into_the_heights() {
        let body = |z_m: [f64; 2]| {
            let (min_m, max_m) = ([0.2, -0.3, z_m[0]], [0.5, 0.1, z_m[1]]);
            Body::cuboid("box", min_m, max_m, Material::PLASTER)
        };
        let inside = plan(vec![body([0.0, 3.0])], 0.1..=1.5);
        assert_eq!(inside.count(GridCell::Occupied), 12);
        // The map begins at the rig, half a metre into the room.
        let corners = [inside.at([-3, -3]), inside.at([-1, 0])];
        assert_eq!(corners, [GridCell::Occupied; 2]);
        assert_eq!([inside.at([-4, -3]), inside.at([-1, 1])], [GridCell::Free; 2]);
        for beyond in [[-0.2, 0.05], [1.6, 3.0]] {
            assert_eq!(plan(vec![body(beyond)], 0.1..=1.5).count(GridCell::Occupied), 0);
        }
        let thin = plan(vec![body([0.7, 0.71])], 0.1..=1.5);
        assert_eq!(thin.count(GridCell::Occupied), 12);
    }
}
