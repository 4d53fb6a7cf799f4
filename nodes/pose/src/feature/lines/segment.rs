//! A line segment of an image.

use std::f32::consts::TAU;

/// A straight piece of an edge.
///
/// It is directed: seen from its start to its end the brighter side is on the left (with columns to the right
/// and rows downwards, as an image is looked at).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LineSegment {
    /// Column and row of one end, between pixels. The centre of a pixel has whole coordinates. It may lie a pixel or
    /// two outside the image.
    pub start_px: [f32; 2],
    /// Column and row of the other.
    pub end_px: [f32; 2],
    /// How meaningful it is: minus the decimal logarithm of how many such segments an image of noise would have.
    pub response: f32,
}

impl LineSegment {
    /// How long it is.
    #[must_use]
    pub fn length_px(&self) -> f32 {
        let [x, y] = self.along_px();
        x.hypot(y)
    }

    /// From its start to its end.
    #[must_use]
    pub fn along_px(&self) -> [f32; 2] {
        [self.end_px[0] - self.start_px[0], self.end_px[1] - self.start_px[1]]
    }

    /// Its direction, in `[0, 2 pi)`: 0 along the row to larger columns, and a quarter of a turn to larger rows.
    #[must_use]
    pub fn direction_rad(&self) -> f32 {
        let [x, y] = self.along_px();
        let direction_rad = y.atan2(x).rem_euclid(TAU);
        // What is a hair less than 0 is rounded to a whole turn.
        if direction_rad < TAU { direction_rad } else { 0.0 }
    }

    /// The point halfway.
    #[must_use]
    pub fn middle_px(&self) -> [f32; 2] {
        [0.5 * (self.start_px[0] + self.end_px[0]), 0.5 * (self.start_px[1] + self.end_px[1])]
    }

    /// The reversed segment.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self { start_px: self.end_px, end_px: self.start_px, ..*self }
    }
}
