//! A corner of an image.

use nalgebra::Point2;

/// The bits of a descriptor.
pub const DESCRIPTOR_BITS: usize = 256;

/// The descriptor of a corner: 256 comparisons of brightness of its surroundings. Two views of one thing differ in few.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct Descriptor(pub [u64; DESCRIPTOR_BITS / u64::BITS as usize]);

impl Descriptor {
    /// In how many bits two descriptors differ (the Hamming distance).
    #[must_use]
    #[inline(always)]
    pub fn distance(&self, other: &Self) -> u32 {
        self.0.iter().zip(other.0).map(|(bits, other)| (bits ^ other).count_ones()).sum()
    }
}

/// A corner: where it is in the image, at which scale it was found, and what its surroundings look like.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Corner {
    /// Column and row in the image itself, whatever the level; a pixel's centre has whole coordinates.
    pub pixel: Point2<f32>,
    /// The level of the pyramid, 0 for the image itself.
    pub level: u8,
    /// The direction from the corner to the centroid of intensity around it, from the image's x (right) towards its y
    /// (down), in (-pi, pi].
    pub angle_rad: f32,
    /// The largest threshold below which the segment test finds this corner, in gray levels.
    pub response: f32,
    /// The descriptor of its surroundings, rotated by `angle_rad`.
    pub descriptor: Descriptor,
}
