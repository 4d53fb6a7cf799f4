//! From a point of the camera frame to a pixel, eight points at a time, and from a box to the pixels that it covers.

mod pinhole;
mod spherical;

pub(crate) use pinhole::Pinhole;
pub(crate) use spherical::Spherical;
pub use spherical::{SphericalModel, SphericalModelError};

use crate::block::BLOCK_EDGE;

/// Points that are projected at once: a row of a block.
pub(crate) const LANES: usize = BLOCK_EDGE;

/// A pixel's border may be computed off by so much in single precision.
const ROUNDING_PX: f32 = 0.05;
/// The same of a depth, relative.
const ROUNDING_OF_DEPTH: f32 = 1e-4;

/// The depths and pixels of a row of points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    /// What the image would show if the point were seen: along the optical axis, or the range, in metres.
    pub(crate) depth_m: [f32; LANES],
    /// Indices of pixels; one beyond the last where the image does not show the point.
    pub(crate) pixel: [u32; LANES],
}

/// A box of the camera frame: its middle, and half its edges along the camera's axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraBox {
    pub(crate) middle_m: [f32; 3],
    pub(crate) half_m: [f32; 3],
}

/// What a box covers of the image.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Extent {
    /// The image shows no point of it.
    Outside,
    /// It reaches to where projection means nothing: to the camera, or over the seam of a panorama.
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
    /// Whether a part may be beside the image.
    pub(crate) is_cut: bool,
}

/// A kind of image.
pub(crate) trait Project: Copy + Sync {
    /// Projects `start + lane * step` for each lane.
    fn row(&self, start_m: [f32; 3], step_m: [f32; 3]) -> Row;

    /// What a box covers.
    fn extent(&self, of: &CameraBox) -> Extent;

    /// The length that a pixel spans at a depth of 1 m.
    fn pixel_slope(&self) -> f32;

    /// The point of the camera frame that a pixel shows at a depth.
    #[cfg(test)]
    fn point_m(&self, column: usize, row: usize, depth_m: f32) -> [f32; 3];

    /// Points of the camera frame whose hull holds all that the image shows up to a depth.
    fn hull_m(&self, depth_m: f32) -> [[f32; 3]; 8];

    /// The same image with pixels of `2^level` by `2^level` of these.
    fn coarser(&self, level: u32) -> Self;
}

/// Rounds to the nearest whole number, for numbers from 0 to 4 million. Others give something.
///
/// A cast from a float saturates, which costs more than the projection itself; to add this number leaves the whole part
/// in the low bits.
#[inline(always)]
pub(crate) fn nearest(value: f32) -> u32 {
    /// 1.5 * 2^23.
    const SHIFT: f32 = 12_582_912.0;
    (value + SHIFT).to_bits().wrapping_sub(SHIFT.to_bits())
}

/// Bounds along one side of the image, in whole pixels; `None` where they are all outside.
#[inline]
pub(crate) fn pixels_between(
    least_px: f32,
    most_px: f32,
    size_px: u32,
) -> Option<([u32; 2], bool)> {
    let (least, most) = (least_px - ROUNDING_PX + 0.5, most_px + ROUNDING_PX + 0.5);
    let size = size_px as f32;
    // A NaN is not outside, and its casts give 0.
    if most < 0.0 || least >= size {
        return None;
    }
    let last = size_px.saturating_sub(1);
    // The casts saturate at 0.
    let bounds = [(least as u32).min(last), (most as u32).min(last)];
    Some((bounds, least < 0.0 || most >= size))
}

/// Depths between these, rounding included.
#[inline]
pub(crate) fn depths_between(nearest_m: f32, farthest_m: f32) -> [f32; 2] {
    [nearest_m * (1.0 - ROUNDING_OF_DEPTH), farthest_m * (1.0 + ROUNDING_OF_DEPTH)]
}

#[cfg(test)]
mod tests;
