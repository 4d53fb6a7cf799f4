mod accuracy;
mod bounds;
mod colours;
mod corrections;
mod forget;
mod plain;
mod rules;
mod spilling;
mod storing;

use nalgebra::{Isometry3, Point3};

use super::*;
use crate::testing::{self, Scene};
use estimation::executor::{ScopedThreads, Serial};

fn config(edge_m: f64) -> SurfaceConfig {
    SurfaceConfig { edge_m, ..SurfaceConfig::default() }
}

fn surface(edge_m: f64) -> Surface {
    Surface::new(config(edge_m)).unwrap()
}

fn points(surface: &Surface) -> Vec<SurfacePoint> {
    surface.points(PointRules::default())
}

/// Everything that is known, in bits.
fn contents(surface: &Surface) -> Vec<(BlockKey, SurfaceBlock)> {
    let keys = surface.block_keys();
    keys.into_iter().map(|key| (key, surface.block(key).unwrap().clone())).collect()
}

/// The same but for when it was seen.
fn nodes(surface: &Surface) -> Vec<(BlockKey, [i16; 512], [u16; 512])> {
    contents(surface).into_iter().map(|(key, block)| (key, block.distance, block.weight)).collect()
}

/// Points within a distance of a place.
fn near(surface: &Surface, place: Point3<f32>, radius_m: f32) -> usize {
    let is_near = |point: &&SurfacePoint| (point.position_m - place).norm() < radius_m;
    points(surface).iter().filter(is_near).count()
}
