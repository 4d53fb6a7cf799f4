//! Where the pixels of a picture lie in the map.

use geometry::{VoxelGrid, VoxelKey};
use nalgebra::Point3;

/// A picture is never wider or higher than this: beyond it several voxels share a pixel.
const MAX_SIDE_PX: i64 = 1200;
/// A small map is drawn with voxels so large that its longer side is about this.
const WANTED_SIDE_PX: i64 = 960;
/// A voxel is never drawn larger than this.
const MAX_VOXEL_PX: i64 = 16;
/// Empty voxels around the map.
const MARGIN_VOXELS: i64 = 3;
/// Share of the points at each end of an axis that do not decide about the frame: a few flying pixels must
/// not shrink the room to a dot.
const OUTLIER_SHARE: f64 = 0.005;
/// Share of the extent that is added at each end after that, where there are points at all.
const WIDENING_SHARE: f64 = 0.5;
/// The bar of scale is at least this long.
const MIN_SCALE_BAR_PX: f64 = 24.0;

/// The direction of a view.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum View {
    /// From above: x to the right, y up.
    Top,
    /// From the right-hand side: x to the right, z up.
    Side,
}

/// The part of the map that a picture shows, and at what scale.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PictureFrame {
    view: View,
    grid: VoxelGrid,
    across: Extent,
    up: Extent,
    heights: Extent,
    /// Pixels of a voxel's edge; 1 where several voxels share a pixel.
    px_per_voxel: i64,
    /// Voxels that share a pixel's edge; 1 where a voxel is a pixel or more.
    voxels_per_px: i64,
    outside: usize,
}

/// Voxels along an axis, both ends included.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Extent {
    first: i64,
    last: i64,
}

/// The voxels of a pixel's column, from the eye to the far end.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Column {
    pub(super) points: u32,
    height_sum_m: f64,
}

impl PictureFrame {
    /// The frame that shows the rig's path and all of the point sets, but for a few far outliers, at a scale
    /// that all views of these share.
    #[must_use]
    pub fn fit(
        view: View,
        point_sets_m: &[&[Point3<f32>]],
        path_m: &[Point3<f32>],
        grid: &VoxelGrid,
    ) -> Self {
        let points = || point_sets_m.iter().flat_map(|points| points.iter());
        let cells =
            |point: &Point3<f32>, axis: fn(&VoxelKey) -> i32| i64::from(axis(&grid.key(point)));
        let with_path = |axis| {
            let of_points = Extent::of(points().map(|point| cells(point, axis)).collect());
            let of_path = Extent::of(path_m.iter().map(|point| cells(point, axis)).collect());
            Extent::joined(of_points, of_path)
        };
        let (x, y, z) = (with_path(|key| key.x), with_path(|key| key.y), with_path(|key| key.z));
        let heights = Extent::of(points().map(|point| cells(point, |key| key.z)).collect());
        let longest = [x, y, z].map(|axis| axis.padded().length()).into_iter().max().unwrap_or(1);
        let voxels_per_px = (longest as u64).div_ceil(MAX_SIDE_PX as u64) as i64;
        let px_per_voxel = (WANTED_SIDE_PX / longest).clamp(1, MAX_VOXEL_PX);
        let mut frame = Self {
            view,
            grid: *grid,
            across: x.padded(),
            up: if view == View::Top { y.padded() } else { z.padded() },
            heights: heights.unwrap_or(Extent::AT_ZERO),
            px_per_voxel,
            voxels_per_px,
            outside: 0,
        };
        frame.outside = points().filter(|point| frame.column_of(point).is_none()).count();
        frame
    }

    /// The view.
    #[must_use]
    pub fn view(&self) -> View {
        self.view
    }

    /// Width and height of the picture.
    #[must_use]
    pub fn size_px(&self) -> (u32, u32) {
        let (columns, rows) = self.size_columns();
        ((columns as i64 * self.px_per_voxel) as u32, (rows as i64 * self.px_per_voxel) as u32)
    }

    /// Pixels of a metre.
    #[must_use]
    pub fn px_per_m(&self) -> f64 {
        self.px_per_voxel as f64 / (self.voxels_per_px as f64 * self.grid.edge_m())
    }

    /// The length of the bar of scale: the least power of ten that can be seen well.
    #[must_use]
    pub fn scale_bar_m(&self) -> f64 {
        10_f64.powf((MIN_SCALE_BAR_PX / self.px_per_m()).log10().ceil())
    }

    /// The heights of the lowest and the highest colour, in the map frame.
    #[must_use]
    pub fn height_range_m(&self) -> (f64, f64) {
        let edge_m = self.grid.edge_m();
        (self.heights.first as f64 * edge_m, (self.heights.last + 1) as f64 * edge_m)
    }

    /// Points of the sets that lie outside of the picture.
    #[must_use]
    pub fn points_outside(&self) -> usize {
        self.outside
    }

    /// Where a height lies between the lowest and the highest colour, from 0 to 1.
    pub(super) fn relative_height(&self, height_m: f64) -> f64 {
        let (low_m, high_m) = self.height_range_m();
        ((height_m - low_m) / (high_m - low_m)).clamp(0.0, 1.0)
    }

    /// Pixels of a column's edge.
    pub(super) fn column_px(&self) -> u32 {
        self.px_per_voxel as u32
    }

    /// How many columns lie beside and above each other.
    pub(super) fn size_columns(&self) -> (usize, usize) {
        let columns = |extent: Extent| {
            (extent.length() as u64).div_ceil(self.voxels_per_px as u64).max(1) as usize
        };
        (columns(self.across), columns(self.up))
    }

    /// The column that a point is in, counted from the upper left corner; none outside of the picture.
    pub(super) fn column_of(&self, point: &Point3<f32>) -> Option<(usize, usize)> {
        let key = self.grid.key(point);
        let vertical = if self.view == View::Top { key.y } else { key.z };
        let (columns, rows) = self.size_columns();
        let cell = |value: i32, extent: Extent, count: usize| {
            let offset = i64::from(value) - extent.first;
            let cell = usize::try_from(offset.div_euclid(self.voxels_per_px)).ok()?;
            (cell < count).then_some(cell)
        };
        let column = cell(key.x, self.across, columns)?;
        let row = cell(vertical, self.up, rows)?;
        Some((column, rows - 1 - row))
    }

    /// The pixel that a point is in, to the pixel and also outside of the picture.
    pub(super) fn pixel_of(&self, point: &Point3<f32>) -> (i64, i64) {
        let vertical = if self.view == View::Top { point.y } else { point.z };
        let px_per_m = self.px_per_m();
        let px = |value_m: f32, extent: Extent| {
            let first_m = extent.first as f64 * self.grid.edge_m();
            // The cast saturates.
            ((f64::from(value_m) - first_m) * px_per_m).floor() as i64
        };
        let height_px = i64::from(self.size_px().1);
        (px(point.x, self.across), (height_px - 1).saturating_sub(px(vertical, self.up)))
    }

    /// The voxels of each column, row by row from the upper left corner.
    pub(super) fn columns(&self, points: &[Point3<f32>]) -> Vec<Column> {
        let (columns, rows) = self.size_columns();
        let mut cells = vec![Column::default(); columns * rows];
        for point in points {
            let cell = self.column_of(point).and_then(|(c, r)| cells.get_mut(r * columns + c));
            if let Some(cell) = cell {
                cell.points = cell.points.saturating_add(1);
                cell.height_sum_m += f64::from(point.z);
            }
        }
        cells
    }
}

impl Column {
    pub(super) fn mean_height_m(&self) -> f64 {
        self.height_sum_m / f64::from(self.points.max(1))
    }
}

impl Extent {
    const AT_ZERO: Self = Self { first: 0, last: 0 };

    /// The voxels that hold all but a few outliers; none when there are none.
    fn of(mut cells: Vec<i64>) -> Option<Self> {
        cells.sort_unstable();
        let (&lowest, &highest) = (cells.first()?, cells.last()?);
        let skipped = (cells.len() as f64 * OUTLIER_SHARE) as usize;
        let low = cells.get(skipped).copied().unwrap_or(lowest);
        let high = cells.get(cells.len() - 1 - skipped).copied().unwrap_or(highest);
        let widening = ((high - low) as f64 * WIDENING_SHARE).ceil() as i64;
        Some(Self { first: (low - widening).max(lowest), last: (high + widening).min(highest) })
    }

    /// The voxels from the first of either to the last of either; the one at zero when there is neither.
    fn joined(one: Option<Self>, other: Option<Self>) -> Self {
        match (one, other) {
            (Some(one), Some(other)) => {
                Self { first: one.first.min(other.first), last: one.last.max(other.last) }
            }
            (one, other) => one.or(other).unwrap_or(Self::AT_ZERO),
        }
    }

    fn padded(self) -> Self {
        Self { first: self.first - MARGIN_VOXELS, last: self.last + MARGIN_VOXELS }
    }

    fn length(self) -> i64 {
        self.last - self.first + 1
    }
}
