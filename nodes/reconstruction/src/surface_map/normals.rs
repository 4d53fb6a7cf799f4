//! How far apart the points of a file are, and the normals of points that have none.
//!
//! A normal is that of the plane through the points around (principal component analysis: Hoppe et al., "Surface reconstruction
//! from unorganized points", SIGGRAPH 1992, section 3.1). The points of a cell have one normal, from the sums of its points and of
//! those of the cells around: the cost does not depend on how many points are in one place.
//!
//! Normals are turned to one place above the middle of the points, as if all had been seen from there. Of a surface that is seen
//! from its other side the normals are wrong until it is seen, and its points are right.

#[cfg(test)]
mod tests;

use std::collections::HashMap;

use geometry::{BuildVoxelHasher, VoxelGrid, VoxelKey};
use nalgebra::{Matrix3, Point3, SymmetricEigen, Vector3};

/// On a square lattice four points are one spacing away.
const NEIGHBOURS: usize = 4;
/// The median is taken of about so many points.
const SAMPLED: usize = 2_000;
/// Cells so far away along each axis count to a normal: what a lattice makes of a tilted plane are steps of a few cells.
const AROUND_CELLS: i32 = 2;
/// The points are seen from so far above their middle: a floor and what stands on it, without a ceiling, from above.
const SEEN_FROM_ABOVE_M: f64 = 1.0;
/// Points whose second variance is less than this share of the first are a line, as a pole.
const LINE_SHARE: f64 = 0.02;
/// Steps of the eigenvalue iteration, which needs some ten.
const MOST_STEPS: usize = 100;

/// How far apart neighbouring points are, in metres: the median distance to the fourth nearest. Points are at most one in each
/// cell of this edge. `None` where they are farther apart than `most_m`.
pub(crate) fn spacing_m(points_m: &[Point3<f32>], edge_m: f64, most_m: f64) -> Option<f64> {
    let sampled: Vec<&Point3<f32>> =
        points_m.iter().step_by(points_m.len().div_ceil(SAMPLED).max(1)).collect();
    let mut cell_m = 2.0 * edge_m;
    while cell_m < 2.0 * most_m {
        // The others are farther away than all of these.
        let distances = distances_m(points_m, &sampled, cell_m);
        if let Some(median_m) = distances.get(sampled.len() / 2) {
            return Some(*median_m).filter(|median_m| *median_m <= most_m);
        }
        cell_m *= 2.0;
    }
    None
}

/// The distances from points to their fourth nearest that are no longer than the edge of a cell, ascending.
fn distances_m(points_m: &[Point3<f32>], of: &[&Point3<f32>], cell_m: f64) -> Vec<f64> {
    let Ok(grid) = VoxelGrid::new(cell_m) else { return Vec::new() };
    let cells = Cells::of(points_m.iter().map(|point| (grid.key(point), *point)).collect());
    let to_fourth = |point: &&Point3<f32>| {
        let mut nearest = [f64::INFINITY; NEIGHBOURS + 1];
        for (_, other) in cells.around(grid.key(point), 1) {
            let squared = (other.cast::<f64>() - point.cast::<f64>()).norm_squared();
            if let Some(farthest) = nearest.last_mut().filter(|farthest| squared < **farthest) {
                *farthest = squared;
                nearest.sort_by(f64::total_cmp);
            }
        }
        // The nearest is the point itself.
        nearest[NEIGHBOURS].sqrt()
    };
    let mut distances: Vec<f64> = of.iter().map(to_fourth).filter(|far| *far <= cell_m).collect();
    distances.sort_by(f64::total_cmp);
    distances
}

/// Estimates the normals that are missing, which are 0, of points that are so far apart: to the side to which those around them point,
/// where there are some.
pub(super) fn fill(points_m: &[Point3<f32>], of_points: &mut [Vector3<f32>], spacing_m: f64) {
    let lacks = |normal: &Vector3<f32>| normal.try_normalize(f32::EPSILON).is_none();
    let Ok(grid) = VoxelGrid::new(spacing_m) else { return };
    if !of_points.iter().any(lacks) {
        return;
    }
    let mut known: HashMap<VoxelKey, Vector3<f32>, BuildVoxelHasher> = HashMap::default();
    for (point_m, normal) in points_m.iter().zip(&*of_points) {
        if let Some(normal) = normal.try_normalize(f32::EPSILON) {
            *known.entry(grid.key(point_m)).or_insert_with(Vector3::zeros) += normal;
        }
    }
    let estimated = normals(points_m, spacing_m);
    for ((point_m, normal), estimated) in points_m.iter().zip(of_points).zip(estimated) {
        if lacks(normal) {
            let around = grid.key(point_m).with_neighbours();
            let sum: Vector3<f32> = around.filter_map(|key| known.get(&key)).sum();
            *normal = if estimated.dot(&sum) < 0.0 { -estimated } else { estimated };
        }
    }
}

/// The normals of points that are so far apart, of length 1; 0 for a point with a number that is not finite, or beyond the grid.
#[must_use]
pub fn normals(points_m: &[Point3<f32>], spacing_m: f64) -> Vec<Vector3<f32>> {
    let nothing = vec![Vector3::zeros(); points_m.len()];
    let Ok(grid) = VoxelGrid::new(spacing_m) else { return nothing };
    let mut keyed: Vec<(VoxelKey, usize)> = points_m
        .iter()
        .enumerate()
        .filter(|(_, point)| geometry::is_finite(point) && is_in_reach(point, &grid))
        .map(|(index, point)| (grid.key(point), index))
        .collect();
    keyed.sort_unstable();
    let sums_of = |points: &[(VoxelKey, usize)]| {
        let key = points.first()?.0;
        let middle_m = grid.middle_m(key);
        let points = points.iter().filter_map(|(_, index)| points_m.get(*index));
        Some((key, Sums::of(points.map(|point| point.cast::<f64>() - middle_m))))
    };
    let of_cells: Vec<&[(VoxelKey, usize)]> = keyed.chunk_by(|a, b| a.0 == b.0).collect();
    let cells = Cells::of(of_cells.iter().filter_map(|points| sums_of(points)).collect());
    let seen_from_m = middle_m(points_m, &keyed) + SEEN_FROM_ABOVE_M * Vector3::z();

    let mut normals = nothing;
    for points in of_cells {
        let Some((key, _)) = points.first() else { continue };
        let own_m = grid.middle_m(*key);
        let sums = cells.around(*key, AROUND_CELLS).fold(Sums::default(), |sums, (cell, other)| {
            sums.plus(&other.moved(&(grid.middle_m(*cell) - own_m)))
        });
        let normal = sums.normal(&(seen_from_m - own_m)).cast();
        for (_, index) in points {
            if let Some(of_point) = normals.get_mut(*index) {
                *of_point = normal;
            }
        }
    }
    normals
}

/// Whether a point is in the cell of its key: keys end somewhere.
fn is_in_reach(point: &Point3<f32>, grid: &VoxelGrid) -> bool {
    let from_middle = point.cast::<f64>() - grid.middle_m(grid.key(point));
    from_middle.amax() <= grid.edge_m()
}

fn middle_m(points_m: &[Point3<f32>], keyed: &[(VoxelKey, usize)]) -> Point3<f64> {
    let points = keyed.iter().filter_map(|(_, index)| points_m.get(*index));
    let sum = points.fold(Vector3::zeros(), |sum, point| sum + point.coords.cast::<f64>());
    (sum / keyed.len().max(1) as f64).into()
}

/// Something at cells, found by their keys.
struct Cells<T>(Vec<(VoxelKey, T)>);

impl<T> Cells<T> {
    fn of(mut cells: Vec<(VoxelKey, T)>) -> Self {
        cells.sort_by_key(|(key, _)| *key);
        Self(cells)
    }

    /// What is in the cells around one, no more than so many away along each axis, in a fixed order.
    fn around(&self, key: VoxelKey, cells: i32) -> impl Iterator<Item = &(VoxelKey, T)> {
        let along = move |cell: i32| cell.saturating_sub(cells)..=cell.saturating_add(cells);
        let VoxelKey { x, y, z } = key;
        along(x).flat_map(move |x| along(y).map(move |y| (x, y))).flat_map(move |(x, y)| {
            let least = VoxelKey { x, y, z: z.saturating_sub(cells) };
            let most = VoxelKey { x, y, z: z.saturating_add(cells) };
            let first = self.0.partition_point(|(key, _)| *key < least);
            self.0.iter().skip(first).take_while(move |(key, _)| *key <= most)
        })
    }
}

/// The sums of some points, about an origin.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    points: f64,
    sum: Vector3<f64>,
    squares: Matrix3<f64>,
}

impl Sums {
    fn of(points: impl Iterator<Item = Vector3<f64>>) -> Self {
        points.fold(Self::default(), |sums, point| {
            let squares = point * point.transpose();
            sums.plus(&Self { points: 1.0, sum: point, squares })
        })
    }

    fn plus(&self, other: &Self) -> Self {
        Self {
            points: self.points + other.points,
            sum: self.sum + other.sum,
            squares: self.squares + other.squares,
        }
    }

    /// About an origin that is `by` before the present one.
    fn moved(&self, by: &Vector3<f64>) -> Self {
        let Self { points, sum, squares } = *self;
        let mixed = sum * by.transpose();
        let squares = squares + mixed + mixed.transpose() + points * by * by.transpose();
        Self { points, sum: sum + points * by, squares }
    }

    /// The normal of the points, on the side of a place. Of a line, and of one point, what of the direction to there is
    /// perpendicular to it.
    fn normal(&self, seen_from: &Vector3<f64>) -> Vector3<f64> {
        let mean = self.sum / self.points;
        let to_camera = (seen_from - mean).try_normalize(f64::EPSILON).unwrap_or_else(Vector3::z);
        let variance = self.squares / self.points - mean * mean.transpose();
        let Some(axes) = SymmetricEigen::try_new(variance, f64::EPSILON, MOST_STEPS) else {
            return to_camera;
        };
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| axes.eigenvalues[*a].total_cmp(&axes.eigenvalues[*b]));
        let [least, middle, most] = order;
        let axis = |index: usize| axes.eigenvectors.column(index).into_owned();
        let normal = if axes.eigenvalues[middle] > LINE_SHARE * axes.eigenvalues[most] {
            axis(least)
        } else {
            to_camera - to_camera.dot(&axis(most)) * axis(most)
        };
        let side = if normal.dot(&to_camera) < 0.0 { -1.0 } else { 1.0 };
        normal.try_normalize(f64::EPSILON).map_or(to_camera, |normal| side * normal)
    }
}
