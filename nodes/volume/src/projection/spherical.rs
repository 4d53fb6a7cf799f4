//! The panorama of a turning LiDAR: columns by azimuth, rows by elevation, depth is range.

use std::f32::consts::PI;

use nalgebra::Point3;

use super::{
    CameraBox, Covered, Extent, LANES, Project, Row, depths_between, nearest, pixels_between, whole,
};

/// Nearer points have no well-defined direction.
const NEAREST_M: f32 = 0.05;

/// A panorama around the sensor's z axis: x forward, y left, z up.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SphericalModel {
    /// Columns over the whole turn, clockwise as seen from above, beginning behind the sensor.
    pub columns: usize,
    /// Rows, from the highest elevation down.
    pub rows: usize,
    /// The elevation of the lower border of the lowest row, in radians.
    pub least_elevation_rad: f64,
    /// The elevation of the upper border of the highest row, in radians.
    pub most_elevation_rad: f64,
}

/// The model is invalid.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
#[error(
    "a panorama of {} x {} pixels from {} to {} rad: it must have between 1 and {} of them, and elevations must \
     rise within a quarter turn of the horizon",
    model.columns, model.rows, model.least_elevation_rad, model.most_elevation_rad,
    geometry::CameraModel::MAX_PIXELS
)]
pub struct SphericalModelError {
    /// The model.
    pub model: SphericalModel,
}

impl SphericalModel {
    /// Checks the numbers.
    ///
    /// # Errors
    /// When there are no pixels or too many, or the elevations do not rise.
    pub fn validate(&self) -> Result<(), SphericalModelError> {
        let pixels = self.columns.checked_mul(self.rows);
        let quarter = std::f64::consts::FRAC_PI_2;
        let is_model = pixels
            .is_some_and(|pixels| (1..=geometry::CameraModel::MAX_PIXELS).contains(&pixels))
            && (-quarter..=quarter).contains(&self.least_elevation_rad)
            && (-quarter..=quarter).contains(&self.most_elevation_rad)
            && self.least_elevation_rad < self.most_elevation_rad;
        if is_model { Ok(()) } else { Err(SphericalModelError { model: *self }) }
    }
}

/// A panorama in single precision.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Spherical {
    columns: u32,
    rows: u32,
    columns_per_rad: f32,
    rows_per_rad: f32,
    /// The elevation of the upper border.
    top_rad: f32,
}

impl Spherical {
    pub(crate) fn of(model: &SphericalModel) -> Self {
        let height_rad = model.most_elevation_rad - model.least_elevation_rad;
        Self {
            columns: model.columns as u32,
            rows: model.rows as u32,
            columns_per_rad: model.columns as f32 / (2.0 * PI),
            rows_per_rad: (model.rows as f64 / height_rad) as f32,
            top_rad: model.most_elevation_rad as f32,
        }
    }

    /// The pixel and the range of a point of the sensor's frame.
    pub(crate) fn pixel(&self, point_m: &Point3<f32>) -> Option<(u32, f32)> {
        let row = self.row(point_m.coords.into(), [0.0; 3]);
        (row.pixel[0] < self.columns * self.rows).then_some((row.pixel[0], row.depth_m[0]))
    }

    fn column(&self, azimuth_rad: f32) -> f32 {
        (PI - azimuth_rad) * self.columns_per_rad - 0.5
    }

    fn line(&self, elevation_rad: f32) -> f32 {
        (self.top_rad - elevation_rad) * self.rows_per_rad - 0.5
    }
}

impl Project for Spherical {
    #[inline(always)]
    fn row(&self, start_m: [f32; 3], step_m: [f32; 3]) -> Row {
        let none = self.columns * self.rows;
        let mut row =
            Row { depth_m: [0.0; LANES], pixel: [none; LANES], in_pixel_px: [[0.0; LANES]; 2] };
        for lane in 0..LANES {
            let along = lane as f32;
            let [x_m, y_m, z_m] = [0, 1, 2].map(|axis: usize| start_m[axis] + along * step_m[axis]);
            let aside_m = (x_m * x_m + y_m * y_m).sqrt();
            let range_m = (aside_m * aside_m + z_m * z_m).sqrt();
            let column = self.column(y_m.atan2(x_m)).max(-0.5);
            let line = self.line(z_m.atan2(aside_m));
            let is_inside = (range_m > NEAREST_M)
                & (column >= -0.5)
                & (line >= -0.5)
                & (line < self.rows as f32 - 0.5);
            // The seam is at both ends.
            let pixel_column = nearest(column).min(self.columns - 1);
            let pixel = nearest(line).wrapping_mul(self.columns).wrapping_add(pixel_column);
            row.depth_m[lane] = range_m;
            row.pixel[lane] = if is_inside { pixel } else { none };
            row.in_pixel_px[0][lane] = column - whole(column);
            row.in_pixel_px[1][lane] = line - whole(line);
        }
        row
    }

    fn extent(&self, of: &CameraBox) -> Extent {
        let [x, y, z] = of.middle_m;
        let radius_m = of.half_m.iter().map(|half| half * half).sum::<f32>().sqrt();
        let aside_m = x.hypot(y);
        let range_m = aside_m.hypot(z);
        if range_m - radius_m <= NEAREST_M || aside_m <= radius_m {
            return Extent::Undecided;
        }
        let (azimuth, spread) = (y.atan2(x), (radius_m / aside_m).asin());
        let (elevation, rise) = (z.atan2(aside_m), (radius_m / range_m).asin());
        if azimuth.abs() + spread >= PI {
            return Extent::Undecided;
        }
        let [left, right] = [azimuth + spread, azimuth - spread].map(|angle| self.column(angle));
        let [top, bottom] = [elevation + rise, elevation - rise].map(|angle| self.line(angle));
        let Some((columns, _)) = pixels_between(left, right, self.columns) else {
            return Extent::Undecided;
        };
        let Some((rows, is_cut)) = pixels_between(top, bottom, self.rows) else {
            return Extent::Outside;
        };
        let [nearest_m, farthest_m] = depths_between(range_m - radius_m, range_m + radius_m);
        Extent::Within(Covered { nearest_m, farthest_m, columns, rows, is_cut })
    }

    fn pixel_slope(&self) -> f32 {
        1.0 / self.columns_per_rad.max(self.rows_per_rad)
    }

    #[cfg(test)]
    fn point_m(&self, column: usize, row: usize, depth_m: f32) -> [f32; 3] {
        let azimuth = PI - (column as f32 + 0.5) / self.columns_per_rad;
        let elevation = self.top_rad - (row as f32 + 0.5) / self.rows_per_rad;
        let (up, aside) = elevation.sin_cos();
        let (left, ahead) = azimuth.sin_cos();
        [ahead * aside * depth_m, left * aside * depth_m, up * depth_m]
    }

    fn hull_m(&self, depth_m: f32) -> [[f32; 3]; 8] {
        let mut hull_m = [[0.0; 3]; 8];
        for (corner, place) in hull_m.iter_mut().enumerate() {
            *place = [0, 1, 2].map(|axis| if corner >> axis & 1 == 0 { -depth_m } else { depth_m });
        }
        hull_m
    }

    fn coarser(&self, level: u32) -> Self {
        let share = 1.0 / (1_u32 << level) as f32;
        Self {
            columns: self.columns.div_ceil(1 << level),
            rows: self.rows.div_ceil(1 << level),
            columns_per_rad: self.columns_per_rad * share,
            rows_per_rad: self.rows_per_rad * share,
            top_rad: self.top_rad,
        }
    }
}
