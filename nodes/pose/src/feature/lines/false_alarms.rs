//! Whether a straight edge may be a chance of noise (Desolneux, Moisan and Morel 2000; EDLines).

use nalgebra::{Point2, Vector2};

use super::gradient::GradientField;
use super::growing::StraightEdge;

/// A gradient of noise points anywhere; it is aligned with a line's normal within 22.5 degrees by one chance in eight.
const ALIGNED_BY_CHANCE: f64 = 0.125;
/// Positions within a pixel, as fractions of this many bits.
const FRACTION_BITS: u32 = 32;
/// tan(22.5 degrees).
const ALIGNED_TAN: f32 = 0.414_213_57;

/// How many segments as well aligned as one are expected in an image of noise.
#[derive(Clone, Copy, Debug)]
pub(super) struct FalseAlarms<'a> {
    field: &'a GradientField,
    log_tests: f64,
}

impl<'a> FalseAlarms<'a> {
    /// A segment goes from any pixel to any other: that many are tested.
    pub(super) fn new(field: &'a GradientField) -> Self {
        let pixels = field.gradients.len().max(1) as f64;
        Self { field, log_tests: 2.0 * pixels.ln() }
    }

    /// The natural logarithm of the number expected.
    ///
    /// The tail of the binomial distribution is replaced by its bound (Chernoff; Hoeffding 1963, theorem 1), which is
    /// not smaller and needs no sum: `exp(-n d)`, `d` being the divergence of the share of aligned pixels from chance.
    pub(super) fn log_expected(&self, edge: &StraightEdge) -> f64 {
        let (start, end) = (edge.start_px(), edge.end_px());
        let count = edge.length_px().round().max(1.0);
        let step = (end - start) / count;
        let direction = edge.line.direction;
        let pixels = count as usize + 1;
        let aligned = self.aligned(start, step, direction, pixels) as f64;
        let pixels = pixels as f64;
        self.log_tests - pixels * divergence(aligned / pixels)
    }

    /// How many of the pixels along a line have gradients that point to its left.
    fn aligned(
        &self,
        start_px: Point2<f64>,
        step_px: Vector2<f64>,
        direction: Vector2<f64>,
        pixels: usize,
    ) -> usize {
        let GradientField { width_px, height_px, gradients } = self.field;
        let [x, y] = [direction.x as f32, direction.y as f32];
        // Fixed point, and no branches: the outcome of a pixel is hard to guess. Half a pixel more, since the nearest
        // is sought.
        let fixed = |px: f64| (px * (1_u64 << FRACTION_BITS) as f64) as i64;
        let mut at = [start_px.x + 0.5, start_px.y + 0.5].map(fixed);
        let step = [step_px.x, step_px.y].map(fixed);
        let mut count = 0;
        for _ in 0..pixels {
            // What is negative becomes larger than any image.
            let [column, row] = at.map(|part| (part >> FRACTION_BITS) as usize);
            let index = if column < *width_px && row < *height_px {
                row.wrapping_mul(*width_px).wrapping_add(column)
            } else {
                usize::MAX
            };
            let gradient = gradients.get(index).copied().unwrap_or_default();
            let [gx, gy] = [gradient.x, gradient.y].map(f32::from);
            let (left, along) = (gx * y - gy * x, gx * x + gy * y);
            count += usize::from((left > 0.0) & (along.abs() <= ALIGNED_TAN * left));
            at = [at[0] + step[0], at[1] + step[1]];
        }
        count
    }
}

/// The Kullback-Leibler divergence of a share from that by chance; 0 where the share is no larger.
pub(super) fn divergence(share: f64) -> f64 {
    let chance = ALIGNED_BY_CHANCE;
    if share <= chance {
        0.0
    } else if share < 1.0 {
        share * (share / chance).ln() + (1.0 - share) * ((1.0 - share) / (1.0 - chance)).ln()
    } else {
        -chance.ln()
    }
}
