//! A few points, coordinate by coordinate, so that the compiler can work on several at once.

use multiversion::multiversion;
use nalgebra::Point3;

use crate::{VoxelBox, VoxelKey};

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

    /// Computes the cells of all places, of the unused ones too; meaningless for a hole.
    pub(crate) fn find_keys(&self, edge_m: f64, keys: &mut BlockKeys) {
        let along = [(&self.x_m, &mut keys.x), (&self.y_m, &mut keys.y), (&self.z_m, &mut keys.z)];
        for (values_m, cells) in along {
            cells_along(values_m, edge_m, cells);
        }
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

    /// Which cells are within a box.
    pub(crate) fn are_within(&self, within: &VoxelBox) -> [bool; PointBlock::CAPACITY] {
        let VoxelBox { least, most } = *within;
        let mut are_within = [false; PointBlock::CAPACITY];
        let places = are_within.iter_mut().zip(&self.x).zip(&self.y).zip(&self.z);
        for (((is_within, x), y), z) in places {
            // Not short-circuiting: the compiler tests several at once.
            *is_within = (*x >= least.x)
                & (*x <= most.x)
                & (*y >= least.y)
                & (*y <= most.y)
                & (*z >= least.z)
                & (*z <= most.z);
        }
        are_within
    }

    /// The number that the lowest `BITS` of each of a cell's coordinates make: another one for each cell of a cube of
    /// `2^BITS` cells' edge.
    pub(crate) fn places<const BITS: u32>(&self) -> [u32; PointBlock::CAPACITY] {
        let low = (1 << BITS) - 1;
        let mut places = [0; PointBlock::CAPACITY];
        for (((place, x), y), z) in places.iter_mut().zip(&self.x).zip(&self.y).zip(&self.z) {
            *place = ((x & low) | (y & low) << BITS | (z & low) << (2 * BITS)) as u32;
        }
        places
    }
}

/// `(value_m / edge_m).floor() as i32` of each value that is finite.
///
/// In single precision, several at once: the product with the inverse has a relative error of less than `2^-22`, so that its floor
/// is right except within this error of a whole number. Values that near to one, and those of cells beyond `2^20`, are divided in
/// double precision.
#[multiversion(targets("x86_64+avx2"))]
fn cells_along(
    values_m: &[f32; PointBlock::CAPACITY],
    edge_m: f64,
    cells: &mut [i32; PointBlock::CAPACITY],
) {
    const ERROR: f32 = 1.0 / (1_u32 << 22) as f32;
    const MOST: f32 = (1_u32 << 20) as f32;
    /// 1.5 * 2^23: a number added to it is rounded to an integer, which becomes the low bits of the sum.
    const ROUNDING: f32 = 12_582_912.0;
    let by_edge = (1.0 / edge_m) as f32;
    let has_inverse = by_edge.is_normal();
    let mut is_close = [false; PointBlock::CAPACITY];
    for ((cell, is_close), &value_m) in cells.iter_mut().zip(&mut is_close).zip(values_m) {
        let quotient = value_m * by_edge;
        let rounded = quotient + ROUNDING;
        let nearest = rounded - ROUNDING;
        let integer = rounded.to_bits().wrapping_sub(ROUNDING.to_bits()) as i32;
        *cell = integer.wrapping_sub(i32::from(nearest > quotient));
        let is_near_whole = (quotient - nearest).abs() <= ERROR * quotient.abs();
        *is_close = is_near_whole | (quotient.abs() >= MOST) | !has_inverse;
    }
    if is_close.contains(&true) {
        for ((cell, _), &value_m) in
            cells.iter_mut().zip(is_close).zip(values_m).filter(|((_, is_close), _)| *is_close)
        {
            // The cast saturates.
            *cell = (f64::from(value_m) / edge_m).floor() as i32;
        }
    }
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
