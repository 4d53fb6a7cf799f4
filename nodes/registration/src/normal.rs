//! The normal of the surface about a point, by its nearest neighbours.

mod smallest;

use std::ops::Range;

use estimation::executor::for_each;
use estimation::{Executor, Symmetric3};
use nalgebra::Vector3;

use self::smallest::plane_normal;
use super::kd_tree::{KdTree, Neighbours};

/// Points that one thread takes at a time.
const CHUNK_POINTS: usize = 1024;
/// Fewer neighbours are a plane whatever they are.
const LEAST_NEIGHBOURS: usize = 4;

/// The normals of the points of a tree, in its order; zero where the neighbours are no surface.
pub(super) fn normals(
    tree: &KdTree,
    neighbours: usize,
    executor: &dyn Executor,
) -> Vec<Vector3<f32>> {
    let mut normals = vec![Vector3::zeros(); tree.len()];
    let mut chunks: Vec<(usize, &mut [Vector3<f32>])> =
        normals.chunks_mut(CHUNK_POINTS).enumerate().collect();
    for_each(executor, &mut chunks, |(chunk, normals)| {
        let first = *chunk * CHUNK_POINTS;
        fill(tree, neighbours, first..first + normals.len(), normals);
    });
    normals
}

fn fill(tree: &KdTree, neighbours: usize, numbers: Range<usize>, normals: &mut [Vector3<f32>]) {
    // A bound by the neighbours of the point before: they are within their distance plus the distance from it.
    let mut before: Option<([f32; 3], f32)> = None;
    for (number, normal) in numbers.zip(normals) {
        let place_m = tree.point_m(number);
        let limit_m2 = before.map_or(f32::INFINITY, |(before_m, farthest_m)| {
            let travelled_m = (Vector3::from(place_m) - Vector3::from(before_m)).norm();
            // A little more, for rounding.
            1.001 * (farthest_m + travelled_m).powi(2) + f32::MIN_POSITIVE
        });
        let mut nearest = Neighbours::new(neighbours, limit_m2);
        tree.neighbours(place_m, &mut nearest);
        before = Some((place_m, nearest.farthest_m2().sqrt()));
        *normal = normal_of(tree, place_m, nearest.numbers());
    }
}

fn normal_of(tree: &KdTree, place_m: [f32; 3], numbers: &[u32]) -> Vector3<f32> {
    if numbers.len() < LEAST_NEIGHBOURS {
        return Vector3::zeros();
    }
    // From the point on, so that no digits are lost far out.
    let (mut sum, mut squares) = (Vector3::zeros(), Symmetric3::default());
    for number in numbers {
        let [x_m, y_m, z_m] = tree.point_m(*number as usize);
        let offset = Vector3::new(
            f64::from(x_m - place_m[0]),
            f64::from(y_m - place_m[1]),
            f64::from(z_m - place_m[2]),
        );
        sum += offset;
        squares = squares.plus(1.0, &Symmetric3::outer(&offset));
    }
    let scatter = squares.plus(-1.0 / numbers.len() as f64, &Symmetric3::outer(&sum));
    plane_normal(&scatter).map_or_else(Vector3::zeros, |normal| normal.cast())
}

#[cfg(test)]
mod tests;
