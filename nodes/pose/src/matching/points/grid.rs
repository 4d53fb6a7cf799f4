//! Corners by where they are in the image.

use nalgebra::Point2;

use crate::feature::points::Corner;

/// The side of a bucket: a few corners each, with a thousand in an image of 640 x 480 pixels.
const BUCKET_PX: f32 = 32.0;
/// An image wider or higher has buckets only up to here; positions beyond are in the last ones.
const MOST_BUCKETS: usize = 256;

/// Corners in square buckets over the image, so that those near a position are found without looking at all.
#[derive(Clone, Debug)]
pub struct CornerGrid<'a> {
    corners: &'a [Corner],
    columns: usize,
    rows: usize,
    /// Where the corners of each bucket begin in `order`; one more at the end.
    starts: Vec<usize>,
    /// The corners' indices, bucket by bucket.
    order: Vec<u32>,
}

/// The bucket of a coordinate among this many.
fn bucket(coordinate_px: f32, buckets: usize) -> usize {
    // A negative coordinate, or none, becomes 0.
    ((coordinate_px / BUCKET_PX) as usize).min(buckets.saturating_sub(1))
}

impl<'a> CornerGrid<'a> {
    /// Puts corners into buckets.
    #[must_use]
    pub fn new(corners: &'a [Corner]) -> Self {
        let side = |coordinate: fn(&Corner) -> f32| {
            let most = corners.iter().map(coordinate).fold(0.0, f32::max);
            bucket(most, MOST_BUCKETS) + 1
        };
        let (columns, rows) = (side(|corner| corner.pixel.x), side(|corner| corner.pixel.y));
        let place = |corner: &Corner| {
            bucket(corner.pixel.y, rows) * columns + bucket(corner.pixel.x, columns)
        };
        let mut order: Vec<u32> = (0..corners.len() as u32).collect();
        order.sort_by_key(|&index| place(&corners[index as usize]));
        let mut starts = vec![0; columns * rows + 1];
        for corner in corners {
            starts[place(corner) + 1] += 1;
        }
        for index in 1..starts.len() {
            starts[index] += starts[index - 1];
        }
        Self { corners, columns, rows, starts, order }
    }

    /// All of them, in the order they were given in.
    #[must_use]
    pub fn corners(&self) -> &'a [Corner] {
        self.corners
    }

    /// The corners within a distance of a position, with their indices; in no order that means anything, but always
    /// the same.
    pub fn near(
        &self,
        pixel: Point2<f32>,
        radius_px: f32,
    ) -> impl Iterator<Item = (usize, &'a Corner)> + '_ {
        let span = |coordinate: f32, buckets: usize| {
            bucket(coordinate - radius_px, buckets)..bucket(coordinate + radius_px, buckets) + 1
        };
        let columns = span(pixel.x, self.columns);
        span(pixel.y, self.rows)
            .flat_map(move |row| {
                let row_start = row * self.columns;
                let from = self.starts.get(row_start + columns.start).copied();
                let to = self.starts.get(row_start + columns.end).copied();
                from.zip(to).and_then(|(from, to)| self.order.get(from..to)).unwrap_or_default()
            })
            .filter_map(move |&index| {
                let corner = self.corners.get(index as usize)?;
                let is_near = (corner.pixel - pixel).norm_squared() <= radius_px * radius_px;
                is_near.then_some((index as usize, corner))
            })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::feature::points::Descriptor;

    fn corner(x: f32, y: f32) -> Corner {
        let descriptor = Descriptor::default();
        Corner { pixel: Point2::new(x, y), level: 0, angle_rad: 0.0, response: 1.0, descriptor }
    }

    proptest! {
        #[test]
        fn the_grid_finds_what_looking_at_all_finds(
            places in prop::collection::vec((-5.0_f32..700.0, -5.0_f32..500.0), 0..200),
            (x, y) in (-100.0_f32..800.0, -100.0_f32..600.0),
            radius_px in 0.0_f32..200.0,
        ) {
            let corners: Vec<Corner> = places.iter().map(|&(x, y)| corner(x, y)).collect();
            let pixel = Point2::new(x, y);
            let mut found: Vec<usize> =
                CornerGrid::new(&corners).near(pixel, radius_px).map(|(index, _)| index).collect();
            found.sort_unstable();
            let expected: Vec<usize> = (0..corners.len())
                .filter(|&index| (corners[index].pixel - pixel).norm_squared() <= radius_px * radius_px)
                .collect();
            prop_assert_eq!(found, expected);
        }
    }

    #[test]
    fn positions_that_are_no_numbers_or_far_off_find_nothing() {
        let corners = [corner(10.0, 10.0), corner(1e30, 5.0), corner(f32::NAN, 2.0)];
        let grid = CornerGrid::new(&corners);
        for pixel in
            [Point2::new(f32::NAN, 0.0), Point2::new(f32::INFINITY, 0.0), Point2::new(-1e9, 1e9)]
        {
            assert_eq!(grid.near(pixel, 5.0).count(), 0);
        }
        assert_eq!(
            grid.near(Point2::new(12.0, 10.0), 5.0).map(|(index, _)| index).collect::<Vec<_>>(),
            [0]
        );
        assert_eq!(CornerGrid::new(&[]).near(Point2::origin(), 9.0).count(), 0);
    }
}
