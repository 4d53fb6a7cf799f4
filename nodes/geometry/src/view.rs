//! The view of a camera, by direction: its borders, and the depths that it measured in each direction.
//!
//! Directions are slopes in the rig frame: how far to the left and up a ray goes for each metre forward.

#[cfg(test)]
mod tests;

use nalgebra::{Point3, Vector2};

/// A point nearer to the camera's plane than this has no slope that means anything.
pub const MIN_SLOPE_DEPTH_M: f64 = 0.1;

/// Sideways and upward slope of the ray from the camera to a point of the rig frame; `None` beside or behind the
/// camera, and for points that are not finite.
#[must_use]
pub fn slopes_from(
    camera_in_rig_m: &Point3<f64>,
    point_in_rig_m: &Point3<f64>,
) -> Option<Vector2<f64>> {
    let ray_m = point_in_rig_m - camera_in_rig_m;
    let finite = ray_m.iter().all(|value| value.is_finite());
    (finite && ray_m.x > MIN_SLOPE_DEPTH_M).then(|| Vector2::new(ray_m.y, ray_m.z) / ray_m.x)
}

/// The borders of a camera's view. Only the points themselves show them, so it is the widest that was ever
/// seen.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct View {
    /// The slopes of its right and lower borders.
    pub least: Vector2<f64>,
    /// The slopes of its left and upper borders.
    pub most: Vector2<f64>,
}

impl Default for View {
    fn default() -> Self {
        Self { least: Vector2::repeat(f64::INFINITY), most: Vector2::repeat(f64::NEG_INFINITY) }
    }
}

impl View {
    /// Takes in the direction of something that was seen.
    pub fn widen(&mut self, slopes: &Vector2<f64>) {
        self.least = self.least.inf(slopes);
        self.most = self.most.sup(slopes);
    }

    /// Whether a direction lies within all its borders.
    #[must_use]
    pub fn contains(&self, slopes: &Vector2<f64>) -> bool {
        *slopes >= self.least && *slopes <= self.most
    }
}

/// A depth for each direction in which a surface was hit, in squares of 1.5 degrees: the nearest or the farthest.
#[derive(Clone, Debug)]
pub struct DepthByDirection {
    /// Row by row from the lower right; NaN where nothing was hit.
    depth_m: Vec<f32>,
}

impl Default for DepthByDirection {
    fn default() -> Self {
        Self { depth_m: vec![f32::NAN; Self::SQUARES * Self::SQUARES] }
    }
}

impl DepthByDirection {
    /// The squares in which directions are gathered are this wide: a voxel of the thesis at 3 m.
    pub const SQUARE_SLOPE: f64 = 0.027;
    /// Squares along a side: a view of 120 degrees.
    pub const SQUARES: usize = 128;
    /// Directions beyond this slope to a side count as those at the border.
    pub const WIDEST_SLOPE: f64 = 0.5 * Self::SQUARES as f64 * Self::SQUARE_SLOPE;

    /// The square of a slope to the left or up, counted from the right or lower border; the nearest one where there is none.
    #[must_use]
    pub fn square_of(slope: f64) -> usize {
        let from_border = slope / Self::SQUARE_SLOPE + 0.5 * Self::SQUARES as f64;
        // The cast saturates at 0.
        (from_border as usize).min(Self::SQUARES - 1)
    }

    /// Forgets all hits.
    pub fn clear(&mut self) {
        self.depth_m.fill(f32::NAN);
    }

    /// A surface was hit at `depth_m` in each direction that differs from `slopes` by no more than `reach`: keeps the
    /// nearest.
    pub fn keep_nearest(&mut self, slopes: &Vector2<f64>, reach: &Vector2<f64>, depth_m: f64) {
        self.for_each_within(slopes, reach, |kept_m| *kept_m = kept_m.min(depth_m as f32));
    }

    /// The same, but keeps the farthest.
    pub fn keep_farthest(&mut self, slopes: &Vector2<f64>, reach: &Vector2<f64>, depth_m: f64) {
        self.for_each_within(slopes, reach, |kept_m| *kept_m = kept_m.max(depth_m as f32));
    }

    fn for_each_within(
        &mut self,
        slopes: &Vector2<f64>,
        reach: &Vector2<f64>,
        mut keep: impl FnMut(&mut f32),
    ) {
        let [least_column, least_row] = Self::column_and_row(&(slopes - reach));
        let [most_column, most_row] = Self::column_and_row(&(slopes + reach));
        for row in least_row..=most_row {
            let columns = row * Self::SQUARES + least_column..=row * Self::SQUARES + most_column;
            self.depth_m.get_mut(columns).into_iter().flatten().for_each(&mut keep);
        }
    }

    /// The depth kept in a direction, in metres; `None` where nothing was hit.
    #[must_use]
    pub fn depth_m(&self, slopes: &Vector2<f64>) -> Option<f64> {
        let [column, row] = Self::column_and_row(slopes);
        let depth_m = self.depth_m.get(row * Self::SQUARES + column).copied().map(f64::from);
        depth_m.filter(|depth_m| !depth_m.is_nan())
    }

    fn column_and_row(slopes: &Vector2<f64>) -> [usize; 2] {
        [slopes.x, slopes.y].map(Self::square_of)
    }

    /// The memory taken, in bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        self.depth_m.capacity() * size_of::<f32>()
    }
}
