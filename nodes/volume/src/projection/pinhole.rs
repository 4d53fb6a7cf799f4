//! The image of a pinhole camera without distortion.

use geometry::CameraModel;
use multiversion::multiversion;

use super::{
    CameraBox, CameraBoxes, Covered, Extent, LANES, Project, ROUNDING_PX, Row, depths_between,
    nearest, pixels_between, whole,
};

/// The smallest depth that is projected. No depth camera measures so near.
const NEAREST_M: f32 = 0.05;

/// A pinhole camera in single precision. Depth is along the optical axis.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Pinhole {
    width_px: u32,
    height_px: u32,
    fx_px: f32,
    fy_px: f32,
    cx_px: f32,
    cy_px: f32,
}

impl Pinhole {
    /// The camera without its distortion.
    pub(crate) fn of(camera: &CameraModel) -> Self {
        Self {
            width_px: camera.width_px as u32,
            height_px: camera.height_px as u32,
            fx_px: camera.fx_px as f32,
            fy_px: camera.fy_px as f32,
            cx_px: camera.cx_px as f32,
            cy_px: camera.cy_px as f32,
        }
    }
}

impl Project for Pinhole {
    #[inline(always)]
    fn row(&self, start_m: [f32; 3], step_m: [f32; 3]) -> Row {
        let (right_px, bottom_px) = (self.width_px as f32 - 0.5, self.height_px as f32 - 0.5);
        let none = self.width_px * self.height_px;
        let mut row =
            Row { depth_m: [0.0; LANES], pixel: [0; LANES], in_pixel_px: [[0.0; LANES]; 2] };
        for lane in 0..LANES {
            let along = lane as f32;
            let x_m = start_m[0] + along * step_m[0];
            let y_m = start_m[1] + along * step_m[1];
            let z_m = start_m[2] + along * step_m[2];
            let inverse = 1.0 / z_m;
            let column = x_m * inverse * self.fx_px + self.cx_px;
            let line = y_m * inverse * self.fy_px + self.cy_px;
            let is_inside = (z_m > NEAREST_M)
                & (column >= -0.5)
                & (column < right_px)
                & (line >= -0.5)
                & (line < bottom_px);
            let pixel = nearest(line).wrapping_mul(self.width_px).wrapping_add(nearest(column));
            row.depth_m[lane] = z_m;
            row.pixel[lane] = if is_inside { pixel } else { none };
            row.in_pixel_px[0][lane] = column - whole(column);
            row.in_pixel_px[1][lane] = line - whole(line);
        }
        row
    }

    #[inline]
    fn extent(&self, of: &CameraBox) -> Extent {
        let CameraBox { middle_m: [x, y, z], half_m: [half_x, half_y, half_z] } = *of;
        let [near_m, far_m] = [z - half_z, z + half_z];
        if far_m <= NEAREST_M {
            return Extent::Outside;
        }
        if near_m <= NEAREST_M {
            return Extent::Undecided;
        }
        let inverse = [1.0 / near_m, 1.0 / far_m];
        let [left, right] =
            slopes([x, half_x], inverse).map(|slope| slope * self.fx_px + self.cx_px);
        let [top, bottom] =
            slopes([y, half_y], inverse).map(|slope| slope * self.fy_px + self.cy_px);
        let Some((columns, is_cut_aside)) = pixels_between(left, right, self.width_px) else {
            return Extent::Outside;
        };
        let Some((rows, is_cut_above)) = pixels_between(top, bottom, self.height_px) else {
            return Extent::Outside;
        };
        let [nearest_m, farthest_m] = depths_between(near_m, far_m);
        let is_cut = is_cut_aside || is_cut_above;
        Extent::Within(Covered { nearest_m, farthest_m, columns, rows, is_cut })
    }

    #[inline]
    fn for_each_extent(&self, of: &CameraBoxes, mut take: impl FnMut(usize, Extent)) {
        let mut bounds = Bounds::default();
        bounds_of(self, of, &mut bounds);
        for lane in 0..LANES {
            take(lane, bounds.extent(lane));
        }
    }

    fn pixel_slope(&self) -> f32 {
        1.0 / self.fx_px.max(self.fy_px)
    }

    #[inline]
    #[cfg(test)]
    fn point_m(&self, column: usize, row: usize, depth_m: f32) -> [f32; 3] {
        let x = (column as f32 - self.cx_px) / self.fx_px;
        let y = (row as f32 - self.cy_px) / self.fy_px;
        [x * depth_m, y * depth_m, depth_m]
    }

    fn hull_m(&self, depth_m: f32) -> [[f32; 3]; 8] {
        let left = (-0.5 - self.cx_px) / self.fx_px * depth_m;
        let right = (self.width_px as f32 - 0.5 - self.cx_px) / self.fx_px * depth_m;
        let top = (-0.5 - self.cy_px) / self.fy_px * depth_m;
        let bottom = (self.height_px as f32 - 0.5 - self.cy_px) / self.fy_px * depth_m;
        let far = [[left, top], [right, top], [left, bottom], [right, bottom]];
        let mut hull_m = [[0.0; 3]; 8];
        for (corner, [x, y]) in hull_m.iter_mut().zip(far) {
            *corner = [x, y, depth_m];
        }
        hull_m
    }

    fn coarser(&self, level: u32) -> Self {
        let share = 1.0 / (1_u32 << level) as f32;
        Self {
            width_px: self.width_px.div_ceil(1 << level),
            height_px: self.height_px.div_ceil(1 << level),
            fx_px: self.fx_px * share,
            fy_px: self.fy_px * share,
            // The centre of a pixel has integer coordinates.
            cx_px: (self.cx_px + 0.5) * share - 0.5,
            cy_px: (self.cy_px + 0.5) * share - 0.5,
        }
    }
}

/// The bounds of several boxes in the image, as [`Covered`] has them.
#[derive(Clone, Copy, Default)]
struct Bounds {
    near_m: [f32; LANES],
    far_m: [f32; LANES],
    left: [u32; LANES],
    right: [u32; LANES],
    top: [u32; LANES],
    bottom: [u32; LANES],
    is_outside: [bool; LANES],
    is_cut: [bool; LANES],
}

impl Bounds {
    #[inline]
    fn extent(&self, lane: usize) -> Extent {
        let (near_m, far_m) = (self.near_m[lane], self.far_m[lane]);
        if far_m <= NEAREST_M {
            return Extent::Outside;
        }
        if near_m <= NEAREST_M {
            return Extent::Undecided;
        }
        if self.is_outside[lane] {
            return Extent::Outside;
        }
        let [nearest_m, farthest_m] = depths_between(near_m, far_m);
        Extent::Within(Covered {
            nearest_m,
            farthest_m,
            columns: [self.left[lane], self.right[lane]],
            rows: [self.top[lane], self.bottom[lane]],
            is_cut: self.is_cut[lane],
        })
    }
}

/// [`Pinhole::extent`] of several boxes, with the same operations.
#[multiversion(targets("x86_64+avx2"))]
fn bounds_of(camera: &Pinhole, of: &CameraBoxes, bounds: &mut Bounds) {
    let CameraBoxes { middle_m: [x, y, z], half_m: [half_x, half_y, half_z] } = of;
    let (width, height) = (camera.width_px as f32, camera.height_px as f32);
    let last = |size_px: u32| size_px.saturating_sub(1) as f32;
    let (last_column, last_row) = (last(camera.width_px), last(camera.height_px));
    for lane in 0..LANES {
        let [near_m, far_m] = [z[lane] - half_z, z[lane] + half_z];
        let inverse = [1.0 / near_m, 1.0 / far_m];
        let [left, right] =
            slopes([x[lane], *half_x], inverse).map(|slope| slope * camera.fx_px + camera.cx_px);
        let [top, bottom] =
            slopes([y[lane], *half_y], inverse).map(|slope| slope * camera.fy_px + camera.cy_px);
        let [left, right] = [left - ROUNDING_PX + 0.5, right + ROUNDING_PX + 0.5];
        let [top, bottom] = [top - ROUNDING_PX + 0.5, bottom + ROUNDING_PX + 0.5];
        bounds.near_m[lane] = near_m;
        bounds.far_m[lane] = far_m;
        bounds.is_outside[lane] =
            (right < 0.0) | (left >= width) | (bottom < 0.0) | (top >= height);
        bounds.is_cut[lane] = (left < 0.0) | (right >= width) | (top < 0.0) | (bottom >= height);
        bounds.left[lane] = whole_up_to(left, last_column);
        bounds.right[lane] = whole_up_to(right, last_column);
        bounds.top[lane] = whole_up_to(top, last_row);
        bounds.bottom[lane] = whole_up_to(bottom, last_row);
    }
}

/// The least and the greatest slope of a box along an axis, by its centre, half its edge, and the inverse of its least and greatest
/// depth: the least is at its near side where it is negative, and at its far side where it is positive.
#[inline(always)]
fn slopes([middle, half]: [f32; 2], [by_near, by_far]: [f32; 2]) -> [f32; 2] {
    let (least, most) = (middle - half, middle + half);
    let least = least * if least < 0.0 { by_near } else { by_far };
    let most = most * if most > 0.0 { by_near } else { by_far };
    [least, most]
}

/// `(value as u32).min(last)`, for a `last` below 4 million.
#[inline(always)]
fn whole_up_to(value: f32, last: f32) -> u32 {
    let value = value.max(0.0).min(last);
    let rounded = nearest(value);
    rounded.wrapping_sub(u32::from(rounded as f32 > value))
}
