mod changes;
mod places;

use nalgebra::Point3;

use super::super::block::FULL;
use super::super::*;
use super::*;
use crate::testing::Noise;

const MAP_EDGE_M: f64 = 0.03;

fn surface() -> Surface {
    Surface::new(SurfaceConfig { edge_m: MAP_EDGE_M, ..SurfaceConfig::default() }).unwrap()
}

/// A block that is free but for some nodes, around which there is a surface.
fn put(surface: &mut Surface, key: BlockKey, is_behind: impl Fn(usize) -> bool) {
    let mut block = SurfaceBlock { weight: [1; 512], ..SurfaceBlock::default() };
    for index in 0..512 {
        let share = if is_behind(index) { -0.1 } else { 0.3 };
        block.distance[index] = (share * FULL) as i16;
    }
    surface.layer.insert(key, Some(Box::new(block)));
}

fn half_diagonal_m(config: DistanceConfig) -> f64 {
    0.5 * 3.0_f64.sqrt() * config.edge_m
}

/// The twin: all points, one after the other.
fn plain_m(points: &[SurfacePoint], place: &Point3<f64>) -> f64 {
    let distances = points.iter().map(|point| (point.position_m.cast::<f64>() - place).norm());
    distances.fold(f64::INFINITY, f64::min)
}

/// By how much the answer for a place is wrong.
fn error_m(
    at: &DistanceAt,
    points: &[SurfacePoint],
    place: &Point3<f64>,
    config: DistanceConfig,
) -> f64 {
    let true_m = plain_m(points, place);
    match at.nearest {
        Some(nearest) => (f64::from(nearest.distance_m) - true_m).abs(),
        // It said that it is beyond the bound.
        None => (config.max_distance_m - true_m).max(0.0),
    }
}
