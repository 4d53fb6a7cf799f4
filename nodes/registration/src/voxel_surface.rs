//! Surfaces as the means of the points of voxels (Koide et al. 2021, "Voxelized GICP for Fast and Accurate 3D Point Cloud
//! Registration").

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use estimation::Symmetric3;
use geometry::VoxelKey;
use nalgebra::Vector3;

use super::surface::{Surface, SurfaceElement};

/// The neighbours of a voxel that share a face with it.
const FACES: [[i32; 3]; 6] = [[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]];

/// Occupied voxels of space, each with the mean of its points and of their normals. Grows as points come in.
#[derive(Clone, Debug)]
pub struct VoxelSurface {
    edge_m: f64,
    voxels: Vec<Voxel>,
    numbers: HashMap<VoxelKey, u32, BuildHasherDefault<CellHasher>>,
}

#[derive(Clone, Copy, Debug)]
struct Voxel {
    key: VoxelKey,
    mean: SurfaceElement,
    points: u32,
    /// When a point came in last.
    seen: u64,
}

impl VoxelSurface {
    /// Empty space cut into cubes of `edge_m`, a positive number.
    #[must_use]
    pub fn new(edge_m: f64) -> Self {
        Self { edge_m, voxels: Vec::new(), numbers: HashMap::default() }
    }

    /// How many voxels are occupied.
    #[must_use]
    pub fn len(&self) -> usize {
        self.voxels.len()
    }

    /// Whether no voxel is occupied.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.voxels.is_empty()
    }

    /// The means of the voxels, in the order in which they were occupied.
    pub fn places_m(&self) -> impl Iterator<Item = Vector3<f64>> {
        self.voxels.iter().map(|voxel| voxel.mean.place_m)
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.voxels.clear();
        self.numbers.clear();
    }

    /// Takes in a point with its normal (or zero). A voxel's mean is over its last `memory` points, as a running mean.
    pub fn add(&mut self, place_m: &Vector3<f64>, normal: &Vector3<f64>, memory: u32, now: u64) {
        let key = self.key(place_m);
        let voxels = &mut self.voxels;
        let number = *self.numbers.entry(key).or_insert_with(|| {
            let mean = SurfaceElement::default();
            voxels.push(Voxel { key, mean, points: 0, seen: now });
            // Memory ends long before the numbers do.
            (voxels.len() - 1) as u32
        });
        let Some(voxel) = self.voxels.get_mut(number as usize) else { return };
        voxel.points = voxel.points.saturating_add(1).min(memory.max(1));
        voxel.seen = now;
        let share = f64::from(voxel.points).recip();
        let SurfaceElement { place_m: mean_m, normals } = &mut voxel.mean;
        *mean_m += share * (place_m - *mean_m);
        *normals = normals.plus(-share, normals).plus(share, &Symmetric3::outer(normal));
    }

    /// Keeps the voxels whose mean lies within `reach_m` of a place and, of these, the `most` that were seen last (of those
    /// seen at once, the nearest).
    pub fn keep_near(&mut self, place_m: &Vector3<f64>, reach_m: f64, most: usize) {
        let square_m2 = |voxel: &Voxel| (voxel.mean.place_m - place_m).norm_squared();
        self.voxels.retain(|voxel| square_m2(voxel) <= reach_m * reach_m);
        if self.voxels.len() > most {
            self.voxels.sort_by(|a, b| {
                b.seen
                    .cmp(&a.seen)
                    .then(square_m2(a).total_cmp(&square_m2(b)))
                    .then(a.key.cmp(&b.key))
            });
            self.voxels.truncate(most);
        }
        self.numbers.clear();
        self.numbers.extend(self.voxels.iter().map(|voxel| voxel.key).zip(0..));
    }

    #[inline]
    fn key(&self, place_m: &Vector3<f64>) -> VoxelKey {
        // The float-to-int cast saturates.
        let cell = |value_m: f64| (value_m / self.edge_m).floor() as i32;
        VoxelKey { x: cell(place_m.x), y: cell(place_m.y), z: cell(place_m.z) }
    }
}

impl Surface for VoxelSurface {
    /// The voxel of the place; where it is empty, that of its six neighbours whose mean is nearest.
    #[inline]
    fn corresponding(
        &self,
        place_m: &Vector3<f64>,
        limit_m: f64,
        _before: Option<u32>,
    ) -> Option<u32> {
        let key = self.key(place_m);
        let square_m2 = |number: u32| (self.element(number).place_m - place_m).norm_squared();
        let near = |number: &u32| square_m2(*number) < limit_m * limit_m;
        if let Some(own) = self.numbers.get(&key) {
            return Some(*own).filter(near);
        }
        FACES
            .iter()
            .filter_map(|[x, y, z]| {
                let key = VoxelKey {
                    x: key.x.saturating_add(*x),
                    y: key.y.saturating_add(*y),
                    z: key.z.saturating_add(*z),
                };
                self.numbers.get(&key).copied()
            })
            .filter(near)
            .min_by(|a, b| square_m2(*a).total_cmp(&square_m2(*b)))
    }

    #[inline]
    fn element(&self, number: u32) -> SurfaceElement {
        self.voxels.get(number as usize).map(|voxel| voxel.mean).unwrap_or_default()
    }
}

/// Spreads neighbouring cells over the table. Fixed, not seeded; and nothing is ever read in the table's order.
#[derive(Clone, Copy, Default)]
struct CellHasher {
    mixed: u64,
}

impl Hasher for CellHasher {
    #[inline]
    fn write_i32(&mut self, value: i32) {
        const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;
        self.mixed = (self.mixed.rotate_left(21) ^ u64::from(value as u32)).wrapping_mul(FACTOR);
    }

    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.write_i32(i32::from(*byte));
        }
    }

    #[inline]
    fn finish(&self) -> u64 {
        self.mixed ^ (self.mixed >> 32)
    }
}

#[cfg(test)]
mod tests;
