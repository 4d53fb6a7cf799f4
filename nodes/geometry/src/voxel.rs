//! The voxel grid: space cut into cubes whose corners lie at multiples of the edge.

mod accumulator;
mod hash;
mod order;
#[cfg(test)]
mod tests;

use nalgebra::{Point3, Scalar};

pub use accumulator::VoxelAccumulator;
pub use hash::{BuildVoxelHasher, VoxelHasher};

/// The cell of a point: its coordinates divided by the edge, rounded down.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub struct VoxelKey {
    /// Along x.
    pub x: i32,
    /// Along y.
    pub y: i32,
    /// Along z.
    pub z: i32,
}

impl VoxelKey {
    /// The 27 voxels around this one and itself, by ascending key. A step beyond the outermost voxel is none, so that
    /// there some come twice.
    pub fn with_neighbours(self) -> impl Iterator<Item = Self> + Clone {
        self.within(1)
    }

    /// The voxels that are no more than `steps` away along each axis, by ascending key; beyond the outermost as above.
    pub fn within(self, steps: i32) -> impl Iterator<Item = Self> + Clone {
        let along = move |cell: i32| (-steps..=steps).map(move |step| cell.saturating_add(step));
        let Self { x, y, z } = self;
        along(x)
            .flat_map(move |x| along(y).flat_map(move |y| along(z).map(move |z| Self { x, y, z })))
    }
}

/// The voxels between two, along each axis.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct VoxelBox {
    /// The least along each axis.
    pub least: VoxelKey,
    /// The greatest along each axis.
    pub most: VoxelKey,
}

impl VoxelBox {
    /// Whether a voxel is in it.
    #[must_use]
    pub fn contains(&self, key: VoxelKey) -> bool {
        let Self { least, most } = self;
        (least.x..=most.x).contains(&key.x)
            && (least.y..=most.y).contains(&key.y)
            && (least.z..=most.z).contains(&key.z)
    }

    /// The smallest box with these voxels; `None` without any.
    #[must_use]
    pub fn around<'a>(keys: impl IntoIterator<Item = &'a VoxelKey>) -> Option<Self> {
        let mut keys = keys.into_iter();
        let first = *keys.next()?;
        let alone = Self { least: first, most: first };
        Some(keys.fold(alone, |Self { least, most }, key| Self {
            least: VoxelKey { x: least.x.min(key.x), y: least.y.min(key.y), z: least.z.min(key.z) },
            most: VoxelKey { x: most.x.max(key.x), y: most.y.max(key.y), z: most.z.max(key.z) },
        }))
    }
}

/// The edge of a voxel is not a positive number.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
#[error("the edge of a voxel must be a positive number of metres, not {edge_m}")]
pub struct VoxelEdgeError {
    /// The edge that was requested.
    pub edge_m: f64,
}

/// A grid of cubes of one edge, its origin at zero.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct VoxelGrid {
    edge_m: f64,
}

impl VoxelGrid {
    /// A grid of cubes of `edge_m`.
    ///
    /// # Errors
    /// When the edge is not a positive finite number.
    pub fn new(edge_m: f64) -> Result<Self, VoxelEdgeError> {
        if edge_m.is_finite() && edge_m > 0.0 {
            Ok(Self { edge_m })
        } else {
            Err(VoxelEdgeError { edge_m })
        }
    }

    /// The edge of a cube.
    #[must_use]
    pub fn edge_m(&self) -> f64 {
        self.edge_m
    }

    /// The middle of a cell.
    #[must_use]
    pub fn middle_m(&self, key: VoxelKey) -> Point3<f64> {
        let VoxelKey { x, y, z } = key;
        Point3::from([x, y, z].map(|cell| (f64::from(cell) + 0.5) * self.edge_m))
    }

    /// The cell of a point whose coordinates are finite.
    ///
    /// The key grows with each coordinate and never falls, so a mean of points of one cell lies in
    /// that cell. A point beyond the reach of 32 bits is put into the outermost cells.
    #[must_use]
    pub fn key<T: Scalar + Copy + Into<f64>>(&self, point: &Point3<T>) -> VoxelKey {
        let cell = |value: T| whole_below(value.into() / self.edge_m);
        VoxelKey { x: cell(point.x), y: cell(point.y), z: cell(point.z) }
    }

    /// The mean of the points of each occupied cell (Rec-HV 3.2.3), in ascending order of the cells'
    /// keys. Each mean lies in the cell that it represents.
    ///
    /// Sums are taken in 64 bits in the order of the input: the same points in the same order give the
    /// same bytes. A point with a coordinate that is not finite has no cell and is left out. Memory
    /// goes with the number of occupied cells, not with the volume that they span. To reduce frame
    /// after frame, keep a [`VoxelAccumulator`].
    #[must_use]
    pub fn reduce(&self, points_m: &[Point3<f32>]) -> Vec<Point3<f32>> {
        let mut accumulator = VoxelAccumulator::new(*self);
        accumulator.push_all(points_m);
        accumulator.finish()
    }
}

/// `value.floor() as i32`, without the call that `floor` is where the processor may be older than its instruction.
#[inline]
fn whole_below(value: f64) -> i32 {
    // The cast saturates, and takes NaN to 0.
    let truncated = value as i32;
    truncated.saturating_sub(i32::from(f64::from(truncated) > value))
}
