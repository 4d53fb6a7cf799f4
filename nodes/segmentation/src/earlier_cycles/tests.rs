use geometry::VoxelGrid;
use nalgebra::Isometry3;

use super::*;
use crate::recent_views::tests::view_of;

const EDGE_M: f64 = 0.08;

/// A column of 0.3 by 0.3 by 0.8 m, a point in each voxel.
fn column(x_m: f64, y_m: f64) -> Vec<StaticPoint> {
    let grid = VoxelGrid::new(EDGE_M).unwrap();
    let along = |from_m: f64, count: u32| (0..count).map(move |i| from_m + EDGE_M * f64::from(i));
    let points = along(x_m - 0.12, 4)
        .flat_map(|x| along(y_m - 0.12, 4).map(move |y| (x, y)))
        .flat_map(|(x, y)| along(-0.4, 10).map(move |z| Point3::new(x, y, z).cast::<f32>()));
    points.map(|in_map_m| StaticPoint { voxel: grid.key(&in_map_m), in_map_m }).collect()
}

/// A cycle that shows these in unknown places.
fn cycle(of_unknown: Vec<StaticPoint>) -> StaticPoints {
    let above_floor = of_unknown.iter().map(|point| point.voxel).collect();
    StaticPoints { of_unknown, above_floor }
}

fn voxels(points: &[StaticPoint]) -> impl Iterator<Item = VoxelKey> {
    points.iter().map(|point| point.voxel)
}

/// A walker went from 1 m on by 8 cm a cycle, and nobody knew.
fn cycles(count: u32, and: &[StaticPoint]) -> EarlierCycles {
    let mut cycles = EarlierCycles::default();
    for index in 0..count {
        let all = column(place_m(index), 0.0).into_iter().chain(and.iter().copied());
        cycles.remember(cycle(all.collect()));
    }
    cycles
}

fn place_m(cycle: u32) -> f64 {
    1.0 + 0.08 * f64::from(cycle)
}

/// Far behind all.
fn wall() -> Vec<Point3<f64>> {
    let along = || (-30..30).map(|step| 0.078 * f64::from(step));
    along().flat_map(|y_m| along().map(move |z_m| Point3::new(3.9, y_m, z_m))).collect()
}

/// A camera that looks along x from there, and sees the wall.
fn sees_from(x_m: f64) -> TiledView {
    TiledView::of(&view_of(&wall(), &Isometry3::translation(x_m, 0.0, 0.0), 1.0))
}

fn retracted(cycles: &mut EarlierCycles, found_m: f64, view: &TiledView) -> Vec<Point3<f64>> {
    let object = column(found_m, 0.0);
    let seen = (view, &StaticPoints::default());
    cycles.of_objects(std::iter::once(voxels(&object)), &Voxels::default(), seen, EDGE_M)
}

#[test]
fn what_a_walker_left_behind_the_camera_is_retracted_when_he_is_found() {
    let mut cycles = cycles(6, &[]);
    // The camera stands where he was at first.
    let left = retracted(&mut cycles, place_m(6), &sees_from(1.5));
    let of_all: Vec<_> = (0..6).flat_map(|index| column(place_m(index), 0.0)).collect();
    let behind = of_all.iter().filter(|point| point.in_map_m.x < 1.5).count();
    assert!(left.len() >= behind && behind > 500, "{} of {behind}", left.len());
    // Once.
    assert_eq!(retracted(&mut cycles, place_m(6), &sees_from(1.5)), []);
}

/// In a hall whose end is out of reach nothing is ever seen behind him.
#[test]
fn what_a_walker_left_is_retracted_where_nothing_returns_any_more() {
    let mut cycles = cycles(6, &[]);
    let below_him: Vec<_> = wall().into_iter().filter(|point| point.z < -2.0).collect();
    let view = TiledView::of(&view_of(&below_him, &Isometry3::translation(-1.5, 0.0, 0.0), 1.0));
    let first = column(place_m(0), 0.0)[0].in_map_m.cast();
    assert_eq!(view.sight(&first, EDGE_M), Sight::NoReturn);
    let left = retracted(&mut cycles, place_m(6), &view).len();
    assert!(left > 900, "{left}");
}

#[test]
fn what_is_seen_where_it_was_stays() {
    let mut cycles = cycles(6, &[]);
    let of_him = (0..7).flat_map(|index| column(place_m(index), 0.0));
    let things: Vec<Point3<f64>> =
        of_him.map(|point| point.in_map_m.cast()).chain(wall()).collect();
    let view = view_of(&things, &Isometry3::identity(), 1.0);
    let left = retracted(&mut cycles, place_m(6), &TiledView::of(&view));
    assert_eq!(left, []);
}

#[test]
fn an_object_that_moved_a_cycle_ago_left_nothing() {
    let mut cycles = cycles(6, &[]);
    let before = voxels(&column(place_m(6), 0.0)).collect();
    let object = column(place_m(7), 0.0);
    let objects = std::iter::once(voxels(&object));
    let seen = (&sees_from(1.5), &StaticPoints::default());
    assert_eq!(cycles.of_objects(objects, &before, seen, EDGE_M), []);
}

#[test]
fn what_stands_beside_farther_than_a_body_reaches_stays() {
    // A wall of columns from 0.2 m beside him on, which touches him.
    let wall: Vec<_> = (0..8).flat_map(|i| column(1.2, 0.3 + 0.3 * f64::from(i))).collect();
    let mut cycles = cycles(6, &wall);
    let left = retracted(&mut cycles, place_m(6), &sees_from(1.9));
    assert!(
        left.iter().all(|point| point.y <= 0.85),
        "{:?}",
        left.iter().map(|p| p.y).fold(0.0, f64::max)
    );
    // Of another object far away nothing was seen.
    let elsewhere = column(3.0, 1.5);
    let none = cycles.of_objects(
        std::iter::once(voxels(&elsewhere)),
        &Voxels::default(),
        (&sees_from(1.9), &StaticPoints::default()),
        EDGE_M,
    );
    assert_eq!(none, []);
}

/// Regression: a map that was loaded lost both walls of a corridor where somebody had walked before he was found.
#[test]
fn a_wall_that_he_walked_along_stays() {
    let wall: Vec<_> = (0..8).flat_map(|i| column(0.9 + 0.3 * f64::from(i), 0.3)).collect();
    // From behind the walker: what is retracted is out of view.
    let retracted = |now: StaticPoints| {
        let (mut cycles, object) = (cycles(6, &wall), column(place_m(6), 0.0));
        let objects = std::iter::once(voxels(&object));
        let left = cycles.of_objects(objects, &Voxels::default(), (&sees_from(2.5), &now), EDGE_M);
        let of_wall = left.iter().filter(|point| point.y > 0.17).count();
        (left.len() - of_wall, of_wall)
    };
    let (of_him, of_wall) = retracted(cycle(wall.clone()));
    assert!(of_him > 300 && of_wall == 0, "{of_him} of him, {of_wall} of the wall");
    // Of a wall that nothing has shown since, nobody can tell.
    assert!(retracted(StaticPoints::default()).1 > 300);
}

#[test]
fn what_is_longer_ago_is_forgotten() {
    let mut cycles = cycles(3, &[]);
    for _ in 0..CYCLES {
        cycles.remember(StaticPoints::default());
    }
    assert_eq!(retracted(&mut cycles, place_m(1), &sees_from(1.9)), []);
    assert_eq!(cycles.cycles.len(), CYCLES);
}
