//! A few points, coordinate by coordinate, so that the compiler can work on several at once.

use multiversion::multiversion;
use nalgebra::Point3;

use crate::VoxelKey;

/// Up to [`PointBlock::CAPACITY`] points. A point with a coordinate that is not finite is a hole: it
/// keeps its place in the block and counts for nothing.
#[derive(Clone, Debug)]
pub(crate) struct PointBlock {
    pub(crate) x_m: [f32; Self::CAPACITY],
    pub(crate) y_m: [f32; Self::CAPACITY],
    pub(crate) z_m: [f32; Self::CAPACITY],
    /// How many of the places are in use; at most `CAPACITY`.
    pub(crate) len: usize,
}

impl Default for PointBlock {
    fn default() -> Self {
        let zeros = [0.0; Self::CAPACITY];
        Self { x_m: zeros, y_m: zeros, z_m: zeros, len: 0 }
    }
}

impl PointBlock {
    /// A tenth of a depth image's row; with its keys it stays in the nearest cache.
    pub(crate) const CAPACITY: usize = 64;

    /// Takes the first `CAPACITY` of `points_m`.
    pub(crate) fn load(&mut self, points_m: &[Point3<f32>]) {
        let places = self.x_m.iter_mut().zip(&mut self.y_m).zip(&mut self.z_m);
        for (((x_m, y_m), z_m), point) in places.zip(points_m) {
            (*x_m, *y_m, *z_m) = (point.x, point.y, point.z);
        }
        self.len = points_m.len().min(Self::CAPACITY);
    }

    /// The points that are finite, in order.
    pub(crate) fn finite_points(&self) -> impl Iterator<Item = Point3<f32>> + '_ {
        let finite = self.finite_places();
        (0..self.len.min(Self::CAPACITY))
            .filter(move |&place| finite[place])
            .map(|place| Point3::new(self.x_m[place], self.y_m[place], self.z_m[place]))
    }

    /// Which places hold a finite point.
    pub(crate) fn finite_places(&self) -> [bool; Self::CAPACITY] {
        let mut finite = [false; Self::CAPACITY];
        let coordinates = self.x_m.iter().zip(&self.y_m).zip(&self.z_m);
        for (finite, ((x_m, y_m), z_m)) in finite.iter_mut().zip(coordinates) {
            // Not short-circuiting: the compiler tests several at once.
            *finite = x_m.is_finite() & y_m.is_finite() & z_m.is_finite();
        }
        finite
    }

    /// The cells of all places, of the unused ones too; meaningless for a hole.
    pub(crate) fn keys(&self, edge_m: f64) -> BlockKeys {
        let mut keys = BlockKeys::default();
        let along = [(&self.x_m, &mut keys.x), (&self.y_m, &mut keys.y), (&self.z_m, &mut keys.z)];
        for (values_m, cells) in along {
            cells_along(values_m, edge_m, cells);
        }
        keys
    }
}

/// The cells of the points of a block, coordinate by coordinate.
#[derive(Clone, Debug)]
pub(crate) struct BlockKeys {
    x: [i32; PointBlock::CAPACITY],
    y: [i32; PointBlock::CAPACITY],
    z: [i32; PointBlock::CAPACITY],
}

impl Default for BlockKeys {
    fn default() -> Self {
        let zeros = [0; PointBlock::CAPACITY];
        Self { x: zeros, y: zeros, z: zeros }
    }
}

impl BlockKeys {
    /// The cell of a place below `CAPACITY`.
    #[inline]
    pub(crate) fn at(&self, place: usize) -> VoxelKey {
        VoxelKey { x: self.x[place], y: self.y[place], z: self.z[place] }
    }
}

/// `(value_m / edge_m).floor() as i32` of each value that is finite.
///
/// A division takes several times as long as a product with the inverse, whose relative error is below `2^-51`: that is as good
/// except within this error of a whole number, where all values of the block are divided.
#[multiversion(targets("x86_64+avx2"))]
fn cells_along(
    values_m: &[f32; PointBlock::CAPACITY],
    edge_m: f64,
    cells: &mut [i32; PointBlock::CAPACITY],
) {
    const ERROR: f64 = 1.0 / (1_u64 << 50) as f64;
    let by_edge = 1.0 / edge_m;
    let mut is_close = !by_edge.is_finite();
    for (cell, &value_m) in cells.iter_mut().zip(values_m) {
        let quotient = f64::from(value_m) * by_edge;
        let Floor { floor, nearest } = floor(quotient);
        *cell = floor;
        is_close |= (quotient - nearest).abs() <= ERROR * quotient.abs();
    }
    if is_close {
        for (cell, &value_m) in cells.iter_mut().zip(values_m) {
            *cell = floor(f64::from(value_m) / edge_m).floor;
        }
    }
}

struct Floor {
    floor: i32,
    /// The nearest whole number.
    nearest: f64,
}

/// `quotient.floor() as i32` of a finite number, without a call or a branch: where the processor's baseline has no instruction
/// for `floor`, that one costs as much as all the rest.
#[inline(always)]
fn floor(quotient: f64) -> Floor {
    /// 1.5 * 2^52: a number added to it is rounded to an integer, and that integer's low 32 bits
    /// become the low bits of the sum.
    const ROUNDING: f64 = 6_755_399_441_055_744.0;
    let quotient = quotient.clamp(f64::from(i32::MIN), f64::from(i32::MAX));
    let rounded = quotient + ROUNDING;
    let nearest = rounded - ROUNDING;
    let floor = (rounded.to_bits() as i32).wrapping_sub(i32::from(nearest > quotient));
    Floor { floor, nearest }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::VoxelGrid;

    /// The cells of a value in every place, and of it beside others that are far from whole numbers.
    fn cell_index(value_m: f32, edge_m: f64) -> i32 {
        let mut cells = [0; PointBlock::CAPACITY];
        cells_along(&[value_m; PointBlock::CAPACITY], edge_m, &mut cells);
        assert!(cells.iter().all(|cell| *cell == cells[0]));
        cells[0]
    }

    proptest! {
        #[test]
        fn the_fast_cell_is_the_floor_of_the_quotient(
            value_m in proptest::num::f32::NORMAL | proptest::num::f32::SUBNORMAL | proptest::num::f32::ZERO,
            edge_m in prop_oneof![Just(0.08), Just(0.5), 1e-9..1e9_f64],
        ) {
            let grid = VoxelGrid::new(edge_m).unwrap();
            let expected = grid.key(&Point3::new(value_m, 0.0, 0.0)).x;
            prop_assert_eq!(cell_index(value_m, edge_m), expected);
        }

        #[test]
        fn the_fast_cell_is_right_around_the_corners(cell in -100_000..100_000_i32, ulps in -2..=2_i32) {
            for edge_m in [0.08, 0.05, 0.02, 0.1, 0.07, 1.0] {
                let corner = (f64::from(cell) * edge_m) as f32;
                let value_m = f32::from_bits(corner.to_bits().wrapping_add_signed(ulps));
                prop_assume!(value_m.is_finite());
                let expected = (f64::from(value_m) / edge_m).floor() as i32;
                prop_assert_eq!(cell_index(value_m, edge_m), expected);
            }
        }
    }

    #[test]
    fn values_beyond_the_grid_fall_into_the_outermost_cells() {
        assert_eq!(cell_index(f32::MAX, 0.08), i32::MAX);
        assert_eq!(cell_index(f32::MIN, 0.08), i32::MIN);
        assert_eq!(cell_index(2_147_483_520.0, 1.0), 2_147_483_520);
        assert_eq!(cell_index(f32::MAX, f64::MIN_POSITIVE), i32::MAX);
        assert_eq!(cell_index(-0.0, 0.08), 0);
    }

    #[test]
    fn a_block_takes_no_more_than_it_holds() {
        let mut block = PointBlock::default();
        let points = vec![Point3::new(1.0, 2.0, 3.0); PointBlock::CAPACITY + 1];
        block.load(&points);
        assert_eq!(block.finite_points().count(), PointBlock::CAPACITY);
        block.load(&points[..3]);
        assert_eq!(block.finite_points().count(), 3);
    }
}
