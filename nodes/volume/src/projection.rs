//! Projection of points of the camera frame to pixels, eight at a time, and of boxes to the pixels that they cover.

mod pinhole;
mod spherical;

pub(crate) use pinhole::Pinhole;
pub(crate) use spherical::Spherical;
pub use spherical::{SphericalModel, SphericalModelError};

use crate::block::BLOCK_EDGE;

/// The number of points that are projected at once: a row of a block.
pub(crate) const LANES: usize = BLOCK_EDGE;

/// The rounding error of a pixel's border in single precision.
const ROUNDING_PX: f32 = 0.05;
/// The relative rounding error of a depth.
const ROUNDING_OF_DEPTH: f32 = 1e-4;

/// The depths and pixels of a row of points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    /// The depth of the point as the image has it: along the optical axis, or the range, in metres.
    pub(crate) depth_m: [f32; LANES],
    /// Indices of pixels; one beyond the last where the point is outside of the image.
    pub(crate) pixel: [u32; LANES],
    /// Where in its pixel the point is: columns and rows from the pixel's centre, -0.5 to 0.5.
    pub(crate) in_pixel_px: [[f32; LANES]; 2],
}

/// A box in the camera frame: its centre, and half its edges along the camera's axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraBox {
    pub(crate) middle_m: [f32; 3],
    pub(crate) half_m: [f32; 3],
}

/// Boxes of one size in the camera frame: their centres, coordinate by coordinate, and half their edges along the camera's axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraBoxes {
    pub(crate) middle_m: [[f32; LANES]; 3],
    pub(crate) half_m: [f32; 3],
}

/// The part of the image that a box covers.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Extent {
    /// All of it is outside of the image.
    Outside,
    /// It extends to where projection is undefined: to the camera, or across the seam of a panorama.
    Undecided,
    /// All its points have depths and pixels within these bounds.
    Within(Covered),
}

/// The bounds of a box in the image.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Covered {
    pub(crate) nearest_m: f32,
    pub(crate) farthest_m: f32,
    /// First and last column, within the image.
    pub(crate) columns: [u32; 2],
    /// First and last row, within the image.
    pub(crate) rows: [u32; 2],
    /// Whether a part may be outside of the image.
    pub(crate) is_cut: bool,
}

/// A projection.
pub(crate) trait Project: Copy + Sync {
    /// Projects `start + lane * step` for each lane.
    fn row(&self, start_m: [f32; 3], step_m: [f32; 3]) -> Row;

    /// The part of the image that a box covers.
    fn extent(&self, of: &CameraBox) -> Extent;

    /// Calls `take` with each of several boxes' number and the part of the image that it covers.
    fn for_each_extent(&self, of: &CameraBoxes, mut take: impl FnMut(usize, Extent)) {
        let CameraBoxes { middle_m: [x, y, z], half_m } = *of;
        for (lane, ((x, y), z)) in x.into_iter().zip(y).zip(z).enumerate() {
            take(lane, self.extent(&CameraBox { middle_m: [x, y, z], half_m }));
        }
    }

    /// The length that a pixel spans at a depth of 1 m.
    fn pixel_slope(&self) -> f32;

    /// The point of the camera frame at a pixel and a depth.
    #[cfg(test)]
    fn point_m(&self, column: usize, row: usize, depth_m: f32) -> [f32; 3];

    /// Points of the camera frame whose hull contains the view up to a depth.
    fn hull_m(&self, depth_m: f32) -> [[f32; 3]; 8];

    /// The projection of the coarser level, whose pixels are `2^level` by `2^level` of these.
    fn coarser(&self, level: u32) -> Self;
}

/// 1.5 * 2^23: a number of single precision to which this is added has its integer part, rounded, in its low bits.
const SHIFT: f32 = 12_582_912.0;

/// Rounds to the nearest whole number, for numbers from 0 to 4 million. For others the result is arbitrary.
///
/// A saturating cast from a float would take longer than the projection itself.
#[inline(always)]
pub(crate) fn nearest(value: f32) -> u32 {
    (value + SHIFT).to_bits().wrapping_sub(SHIFT.to_bits())
}

/// The nearest whole number as a float, for magnitudes below 4 million.
#[inline(always)]
pub(crate) fn whole(value: f32) -> f32 {
    (value + SHIFT) - SHIFT
}

/// Bounds along one side of the image, in whole pixels; `None` if they are all outside.
#[inline]
pub(crate) fn pixels_between(
    least_px: f32,
    most_px: f32,
    size_px: u32,
) -> Option<([u32; 2], bool)> {
    let (least, most) = (least_px - ROUNDING_PX + 0.5, most_px + ROUNDING_PX + 0.5);
    let size = size_px as f32;
    // NaN does not count as outside; its cast gives 0.
    if most < 0.0 || least >= size {
        return None;
    }
    let last = size_px.saturating_sub(1);
    // The casts saturate at 0.
    let bounds = [(least as u32).min(last), (most as u32).min(last)];
    Some((bounds, least < 0.0 || most >= size))
}

/// The bounds of the depths, with the rounding error.
#[inline]
pub(crate) fn depths_between(nearest_m: f32, farthest_m: f32) -> [f32; 2] {
    [nearest_m * (1.0 - ROUNDING_OF_DEPTH), farthest_m * (1.0 + ROUNDING_OF_DEPTH)]
}

#[cfg(test)]
mod tests;
