use std::sync::Arc;

use geometry::{GridCell, MapPath, MaskedDepth, PathVertex, ScanRay, SegmentedCycle, Stamp};
use nalgebra::{Isometry3, Point3, Translation3, Vector3};

use super::*;
use crate::surface_map::tests::scene::{Scene, cycle, path_at, rig_at};
use crate::{Map, ReconstructionConfig};

use GridCell::{Free, Occupied, Unknown};

fn map_with(grid: GridConfig) -> Map {
    let mut config = ReconstructionConfig { grid, ..ReconstructionConfig::default() };
    config.pipeline.map_edge_m = 0.03;
    Map::new(config, None).unwrap()
}

fn band() -> GridConfig {
    GridConfig { grid: GridSource::HeightBand, ..GridConfig::default() }
}

fn at(grid: &OccupancyGrid, x_m: f64, y_m: f64) -> GridCell {
    grid.at([x_m, y_m].map(|along| (along / grid.resolution_m).floor() as i32))
}

/// The occupied cells' middles that are farther than so far from every wall of the scene.
fn beside_walls(grid: &OccupancyGrid, scene: &Scene, far_m: f64) -> Vec<Point3<f64>> {
    let middle = |index: usize| {
        let along =
            |least: i32, cell: usize| (f64::from(least) + cell as f64 + 0.5) * grid.resolution_m;
        let (x, y) = (index % grid.width, index / grid.width);
        Point3::new(along(grid.least[0], x), along(grid.least[1], y), 0.0)
    };
    let is_occupied = |index: &usize| grid.cells[*index] == Occupied;
    let occupied = (0..grid.cells.len()).filter(is_occupied).map(middle);
    occupied.filter(|place| scene.nearest(place).0 > far_m).collect()
}

fn masked(scene: &Scene, mut cycle: SegmentedCycle, rig: &Isometry3<f64>) -> SegmentedCycle {
    let frame = Arc::clone(cycle.depth.unwrap().frame());
    let is_moving = scene.shows_person(&frame, rig);
    cycle.depth = MaskedDepth::new(frame, is_moving).ok();
    cycle
}

/// The room after so many cycles.
fn room(grid: GridConfig, cycles: u32) -> Map {
    let mut map = map_with(grid);
    for index in 0..cycles {
        map.integrate(&cycle(&Scene::room(), index, &rig_at(0.0, 0.0), None)).unwrap();
    }
    map
}

#[test]
fn walls_are_occupied_what_is_before_them_free_and_the_rest_unknown() {
    let grid = room(band(), 5).occupancy_grid().unwrap();
    assert_eq!((grid.frame_id.as_str(), grid.resolution_m), ("map", 0.05));
    for y in -20..=20 {
        let y_m = f64::from(y) * 0.05 + 0.01;
        let wall_m = 2.8 + 0.05 * y_m;
        // The wall is a little askew: it is in one of two cells.
        let wall = [at(&grid, wall_m, y_m), at(&grid, wall_m + 0.03, y_m)];
        assert!(wall.contains(&Occupied), "{y_m}");
        assert_eq!(at(&grid, wall_m - 0.15, y_m), Free, "{y_m}");
        assert_eq!(at(&grid, wall_m + 0.15, y_m), Unknown, "{y_m}");
    }
    assert_eq!(at(&grid, 1.5, 1.22), Unknown, "the side wall is not in view there");
    assert_eq!(at(&grid, 2.75, 1.22), Occupied);
    // The camera is 0.9 m up and looks down by 24.5 degrees: no nearer than 1.1 m it sees 0.4 m.
    assert_eq!((at(&grid, 1.0, 0.0), at(&grid, 1.3, 0.0)), (Unknown, Free));
    assert_eq!(beside_walls(&grid, &Scene::room(), 0.06), []);
}

#[test]
fn any_height_of_the_band_is_enough_where_it_is_asked_for() {
    let any = GridConfig { grid_free_below_m: 1.5, ..band() };
    let grid = room(any, 5).occupancy_grid().unwrap();
    assert_eq!((at(&grid, 0.5, 0.0), at(&grid, 1.3, 0.0)), (Free, Free));
}

#[test]
fn a_band_above_the_walls_things_has_none_of_them() {
    let scene = Scene::room().with_person(0.0);
    let rig = rig_at(0.0, 0.0);
    let occupied = |grid: GridConfig| {
        let mut map = map_with(grid);
        for index in 0..5 {
            map.integrate(&cycle(&scene, index, &rig, None)).unwrap();
        }
        beside_walls(&map.occupancy_grid().unwrap(), &scene, 0.06).len()
    };
    // The ball is from 0.6 m to 1.2 m above the floor.
    assert!(occupied(band()) > 5);
    assert_eq!(occupied(GridConfig { grid_max_height_m: 0.55, ..band() }), 0);
}

#[test]
fn what_moves_is_in_no_cell_and_its_way_is_free() {
    let rig = rig_at(0.0, 0.0);
    let mut map = map_with(band());
    for index in 0..20 {
        let scene = Scene::room().with_person(-1.0 + 0.1 * f64::from(index));
        map.integrate(&masked(&scene, cycle(&scene, index, &rig, None), &rig)).unwrap();
    }
    let grid = map.occupancy_grid().unwrap();
    assert_eq!(beside_walls(&grid, &Scene::room(), 0.06), []);
    assert_eq!((at(&grid, 1.8, 0.0), at(&grid, 2.3, 0.0)), (Free, Free));
}

#[test]
fn what_stood_and_left_is_cleared() {
    let rig = rig_at(0.0, 0.0);
    let person = Scene::room().with_person(0.0);
    let mut map = map_with(band());
    for index in 0..5 {
        map.integrate(&cycle(&person, index, &rig, None)).unwrap();
    }
    let grid = map.occupancy_grid().unwrap();
    assert_eq!((at(&grid, 1.55, 0.0), at(&grid, 2.3, 0.0)), (Occupied, Unknown));
    for index in 5..150 {
        map.integrate(&cycle(&Scene::room(), index, &rig, None)).unwrap();
    }
    let grid = map.occupancy_grid().unwrap();
    assert_eq!(beside_walls(&grid, &Scene::room(), 0.06), []);
    assert_eq!((at(&grid, 1.55, 0.0), at(&grid, 2.3, 0.0)), (Free, Free));
}

fn path(shift_m: [f64; 2]) -> MapPath {
    let vertices = (0..3).map(|second| PathVertex {
        stamp: Stamp::from_nanos(1).plus_seconds(f64::from(second)),
        map_from_rig: Isometry3::from_parts(
            Translation3::new(shift_m[0], shift_m[1], 0.0),
            nalgebra::UnitQuaternion::identity(),
        ),
    });
    MapPath::new(Stamp::from_nanos(1).plus_seconds(5.0), "map", vertices.collect()).unwrap()
}

#[test]
fn a_corrected_map_takes_its_grid_along() {
    for source in [band(), GridConfig { grid: GridSource::Scan, ..band() }] {
        let mut map = map_with(source);
        for index in 0..5 {
            let mut cycle = cycle(&Scene::room(), index, &rig_at(0.0, 0.0), None);
            cycle.scan_rays = std::sync::Arc::new(rays());
            map.integrate(&cycle).unwrap();
        }
        let before = map.occupancy_grid().unwrap();
        map.follow_path(&path([0.0, 0.0])).unwrap();
        map.follow_path(&path([0.5, -0.3])).unwrap();
        let after = map.occupancy_grid().unwrap();
        let (mut same, mut known) = (0, 0);
        for (index, cell) in before.cells.iter().enumerate().filter(|(_, cell)| **cell != Unknown) {
            let x = before.least[0] + (index % before.width) as i32 + 10;
            let y = before.least[1] + (index / before.width) as i32 - 6;
            known += 1;
            same += usize::from(after.at([x, y]) == *cell);
        }
        assert!(known > 400 && same as f64 > 0.98 * f64::from(known), "{same} of {known}");
        assert_eq!(at(&before, 1.8, 0.0), Free);
    }
}

/// A scan of a wall at x = 2.02 m, of which one beam hits a person.
pub(crate) fn rays() -> Vec<ScanRay> {
    let ray = |degree: i32| {
        let azimuth_rad = f64::from(degree).to_radians();
        let is_moving = (10..15).contains(&degree);
        let range_m = if is_moving { 1.2 } else { 2.02 / azimuth_rad.cos() };
        let to = Point3::new(range_m * azimuth_rad.cos(), range_m * azimuth_rad.sin(), -0.05);
        let from_m = Point3::new(0.0, 0.0, -0.05);
        ScanRay { from_m, to_m: to.cast(), is_moving, joins_next: degree < 30 }
    };
    (-30..=30).map(ray).collect()
}

#[test]
fn a_grid_of_scans_needs_no_floor_and_has_nothing_that_moves() {
    let mut map = map_with(GridConfig { grid: GridSource::Scan, ..GridConfig::default() });
    for index in 0..5 {
        let mut cycle = cycle(&Scene::room(), index, &rig_at(0.0, 0.0), None);
        cycle.scan_rays = std::sync::Arc::new(rays());
        map.integrate(&cycle).unwrap();
    }
    let grid = map.occupancy_grid().unwrap();
    assert_eq!(
        (at(&grid, 2.02, 0.0), at(&grid, 1.9, 0.0), at(&grid, 2.8, 0.0)),
        (Occupied, Free, Unknown)
    );
    let person_rad = 12.0_f64.to_radians();
    let on_way = |range_m: f64| at(&grid, range_m * person_rad.cos(), range_m * person_rad.sin());
    assert_eq!((on_way(1.0), on_way(1.3), on_way(1.6)), (Free, Unknown, Unknown));
}

#[test]
fn the_border_is_at_multiples_and_stays_while_the_map_grows() {
    let mut map = room(band(), 4);
    let before = map.occupancy_grid().unwrap();
    for index in 4..12 {
        map.integrate(&cycle(&Scene::corridor(4.0), index, &rig_at(0.3, 0.0), None)).unwrap();
    }
    let after = map.occupancy_grid().unwrap();
    for grid in [&before, &after] {
        assert!(
            grid.least.iter().all(|cell| cell.rem_euclid(BORDER_CELLS) == 0),
            "{:?}",
            grid.least
        );
        assert!([grid.width, grid.height].iter().all(|size| size % BORDER_CELLS as usize == 0));
    }
    assert!(after.least[0] <= before.least[0] && after.least[1] <= before.least[1]);
    let edge = |grid: &OccupancyGrid| grid.least[0] + grid.width as i32;
    assert!(edge(&after) > edge(&before));
}

/// Regression: the floor of the first image stayed until somebody asked for the grid, and then that of the map was taken.
#[test]
fn what_a_grid_has_does_not_depend_on_when_it_was_asked_for() {
    // A table alone at first, then the floor below it.
    let table = Scene::room_with_floor_at(-0.45);
    let grid_of = |asks: bool| {
        let mut map = map_with(band());
        for index in 0..12 {
            let scene = if index < 3 { &table } else { &Scene::room() };
            map.integrate(&cycle(scene, index, &rig_at(0.0, 0.0), None)).unwrap();
            if asks {
                let _ = map.occupancy_grid();
            }
        }
        map.occupancy_grid().unwrap()
    };
    assert_eq!(grid_of(true), grid_of(false));
}

/// Regression: after each correction the floor was looked for anew, and a table before the camera was one: the grid was emptied
/// twice.
#[test]
fn a_correction_that_lifts_nothing_keeps_the_floor() {
    let known = |map: &mut Map| {
        let grid = map.occupancy_grid().unwrap();
        grid.cells.iter().filter(|cell| **cell != Unknown).count()
    };
    let mut map = room(band(), 5);
    map.follow_path(&path_at(0.0)).unwrap();
    let before = known(&mut map);
    map.follow_path(&path_at(0.5)).unwrap();
    map.integrate(&cycle(&Scene::room_with_floor_at(-0.45), 5, &rig_at(0.0, 0.0), None)).unwrap();
    let after = known(&mut map);
    assert!(after * 10 > before * 9, "{after} of {before}");
}

#[test]
fn a_loaded_map_is_free_where_it_has_floor() {
    let seen = room(band(), 10);
    let whole = seen.whole();
    let mut map = map_with(band());
    map.replace(&whole.points.points_m, &whole.points.normals, "map").unwrap();
    let grid = map.occupancy_grid().unwrap();
    assert_eq!((at(&grid, 2.6, 0.0), at(&grid, 2.81, 0.0)), (Free, Occupied));
    // Of points alone as well.
    let points = GridPoints { points_m: &whole.points.points_m, normals: &[] };
    let alone = grid_of_points(&band(), points, ("map", Stamp::default())).unwrap();
    assert_eq!((at(&alone, 2.6, 0.0), at(&alone, 2.81, 0.0)), (Free, Occupied));
}

#[test]
fn where_there_is_no_grid_the_reason_is_said() {
    let mut off = map_with(GridConfig::default());
    assert_eq!(off.occupancy_grid(), Err(GridError::Off));
    let of = |source| map_with(GridConfig { grid: source, ..GridConfig::default() });
    assert_eq!(of(GridSource::HeightBand).occupancy_grid(), Err(GridError::EmptyMap));
    // Of a map of 276,245 voxels that was loaded it was said that it is empty.
    let mut loaded = of(GridSource::Scan);
    loaded.replace(&[Point3::new(1.0, 2.0, 0.5)], &[Vector3::z()], "map").unwrap();
    assert!(!loaded.is_empty());
    assert_eq!(loaded.occupancy_grid(), Err(GridError::NoScan));
    // A wall and no floor.
    let mut map = map_with(band());
    let wall: Vec<Point3<f32>> = (0..2500)
        .map(|cell| Point3::new(2.0, (cell % 50) as f32 * 0.03, (cell / 50) as f32 * 0.03))
        .collect();
    map.replace(&wall, &vec![-Vector3::x(); wall.len()], "map").unwrap();
    assert!(matches!(map.occupancy_grid(), Err(GridError::NoFloor { points }) if points > 1000));
    let mut large = room(GridConfig { grid_max_cells: 100, ..band() }, 4);
    let error = large.occupancy_grid().unwrap_err().to_string();
    assert!(error.contains("32 x 96") && error.contains("grid_max_cells is 100"), "{error}");
    let mut of_means = ReconstructionConfig { grid: band(), ..ReconstructionConfig::default() };
    of_means.pipeline.method = geometry::Method::RecHv;
    assert!(Map::new(of_means.clone(), None).is_ok());
    of_means.grid.grid = GridSource::Scan;
    let error = Map::new(of_means, None).unwrap_err().to_string();
    assert!(error.contains("grid") && error.contains("rec_hv"), "{error}");
}

#[test]
fn a_floor_is_level_large_and_has_nothing_below() {
    let patch = |height_m: f32, cells: i32| {
        (0..cells * cells).map(move |cell| {
            Point3::new((cell % cells) as f32 * 0.05, (cell / cells) as f32 * 0.05, height_m)
        })
    };
    let found = |points_m: Vec<Point3<f32>>| {
        let normals = vec![Vector3::z(); points_m.len()];
        find_floor_m(GridPoints { points_m: &points_m, normals: &normals })
    };
    let near =
        |found: Option<f64>, height_m: f64| found.is_some_and(|m| (m - height_m).abs() < 0.01);
    assert!(near(found(patch(-1.2, 40).collect()), -1.2));
    assert!(
        near(found(patch(-1.2, 20).chain(patch(-0.45, 40)).collect()), -1.2),
        "a table over it"
    );
    assert_eq!(found(patch(-0.45, 8).collect()), None, "a seat");
    let table_and_leg =
        patch(-0.45, 40).chain((0..40).map(|z| Point3::new(0.0, 0.0, -1.2 + 0.01 * z as f32)));
    assert_eq!(found(table_and_leg.collect()), None, "what is below says it is a table");
    assert_eq!(found(Vec::new()), None);
    let odd = [f32::NAN, f32::INFINITY, 1e30, -1e30].map(|z| Point3::new(z, z, z)).to_vec();
    assert_eq!(found(odd), None);
}
