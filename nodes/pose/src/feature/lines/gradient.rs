//! The gradient of a smoothed image.

use estimation::Executor;
use estimation::executor::for_each;

use crate::image::GrayImage;

/// The kernel weighs 256 in all. A shift of 3 leaves 32 units to a gray level, the most with which a sum of the Sobel
/// operator fits 16 bits.
const SMOOTHED_SHIFT: u32 = 3;
/// A gradient of one gray level in the units of a [`Gradient`].
pub(super) const UNITS_PER_LEVEL: f64 = 32.0;
/// Pixels that the smoothing looks at to each side.
const REACH_PX: usize = 2;
/// The least image that has gradients: the Sobel operator looks at 3 x 3 pixels.
pub(super) const LEAST_SIDE_PX: usize = 3;

/// The Sobel operator at a pixel, [`UNITS_PER_LEVEL`] to a gray level. It points to the brighter side.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub(super) struct Gradient {
    /// Along the row, to larger columns.
    pub(super) x: i16,
    /// Along the column, to larger rows.
    pub(super) y: i16,
}

impl Gradient {
    /// `|x| + |y|`, at most 48960.
    pub(super) fn magnitude(self) -> u16 {
        self.x.unsigned_abs().wrapping_add(self.y.unsigned_abs())
    }

    /// Whether the edge through the pixel runs rather along the row than along the column.
    pub(super) fn edge_runs_along_row(self) -> bool {
        self.y.unsigned_abs() >= self.x.unsigned_abs()
    }

    /// Whether two gradients point to the same side: the product of the one with the other is positive.
    pub(super) fn agrees(self, other: Self) -> bool {
        // 2 * 32640^2 is less than 2^31.
        let product = |a: i16, b: i16| i32::from(a) * i32::from(b);
        product(self.x, other.x) + product(self.y, other.y) > 0
    }
}

/// The gradients of all pixels, row by row. Those of the outermost pixels are 0: a walk along gradients stays
/// off the border, where a pixel lacks neighbours.
#[derive(Clone, Default, Debug)]
pub(super) struct GradientField {
    pub(super) width_px: usize,
    pub(super) height_px: usize,
    pub(super) gradients: Vec<Gradient>,
}

impl GradientField {
    /// Smooths an image by the 5 x 5 binomial kernel (1 4 6 4 1, whose standard deviation is exactly 1 pixel), and
    /// differentiates it by the Sobel operator. Only the smoothed pixel is rounded, to 1/32 of a gray level.
    pub(super) fn compute(&mut self, image: &GrayImage, executor: &dyn Executor) {
        let (width_px, height_px) = (image.width_px(), image.height_px());
        (self.width_px, self.height_px) = (width_px, height_px);
        self.gradients.clear();
        self.gradients.resize(width_px * height_px, Gradient::default());
        if width_px < LEAST_SIDE_PX || height_px < LEAST_SIDE_PX {
            return;
        }
        let stripe_rows = height_px.div_ceil(executor.threads().get());
        let stripes = self.gradients.chunks_mut(stripe_rows * width_px).enumerate();
        let mut stripes: Vec<(usize, &mut [Gradient])> = stripes.collect();
        for_each(executor, &mut stripes, |(stripe, rows)| {
            fill_rows(image, *stripe * stripe_rows, rows);
        });
    }
}

/// Computes consecutive rows, from `first_row` on.
fn fill_rows(image: &GrayImage, first_row: usize, rows: &mut [Gradient]) {
    let (width_px, height_px) = (image.width_px(), image.height_px());
    let mut smoother = Smoother { image, column_sums: vec![0; width_px + 2 * REACH_PX] };
    let [mut above, mut here, mut below] = [(); 3].map(|()| vec![0; width_px]);
    smoother.smooth(first_row.saturating_sub(1), &mut above);
    smoother.smooth(first_row, &mut here);
    for (row, gradients) in (first_row..).zip(rows.chunks_exact_mut(width_px)) {
        smoother.smooth((row + 1).min(height_px - 1), &mut below);
        if row > 0 && row + 1 < height_px {
            sobel([&above, &here, &below], &mut gradients[1..width_px - 1]);
        }
        std::mem::swap(&mut above, &mut here);
        std::mem::swap(&mut here, &mut below);
    }
}

/// Smooths rows of an image whose outermost pixels go on beyond it.
struct Smoother<'a> {
    image: &'a GrayImage,
    /// The sums down the columns, with [`REACH_PX`] more to each side.
    column_sums: Vec<u16>,
}

impl Smoother<'_> {
    /// A smoothed row. Zipped slices, since the compiler turns these into vector instructions and indices not.
    fn smooth(&mut self, row: usize, smoothed: &mut [i16]) {
        let (width_px, last_row) = (self.image.width_px(), self.image.height_px() - 1);
        let [a, b, c, d, e] = [0, 1, 2, 3, 4]
            .map(|step| self.image.row((row + step).saturating_sub(REACH_PX).min(last_row)));
        let sums = &mut self.column_sums[REACH_PX..REACH_PX + width_px];
        for (((((sum, a), b), c), d), e) in sums.iter_mut().zip(a).zip(b).zip(c).zip(d).zip(e) {
            let [a, b, c, d, e] = [*a, *b, *c, *d, *e].map(u16::from);
            *sum = a + e + 4 * (b + d) + 6 * c;
        }
        let (first, last) = (sums[0], sums[width_px - 1]);
        self.column_sums[..REACH_PX].fill(first);
        self.column_sums[REACH_PX + width_px..].fill(last);

        let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(|step| &self.column_sums[step..step + width_px]);
        let half = 1 << (SMOOTHED_SHIFT - 1);
        let sums = a.iter().zip(b).zip(c).zip(d).zip(e);
        for (smoothed, ((((a, b), c), d), e)) in smoothed.iter_mut().zip(sums) {
            // 255 * 256 + 4 is less than 2^16, and after the shift less than 2^15.
            *smoothed = ((a + e + 4 * (b + d) + 6 * c + half) >> SMOOTHED_SHIFT) as i16;
        }
    }
}

/// The Sobel operator along the middle one of three rows, at all columns but the outermost.
fn sobel([above, here, below]: [&[i16]; 3], gradients: &mut [Gradient]) {
    let inner = gradients.len();
    let above = above[..inner].iter().zip(&above[1..=inner]).zip(&above[2..]);
    let here = here[..inner].iter().zip(&here[2..]);
    let below = below[..inner].iter().zip(&below[1..=inner]).zip(&below[2..]);
    let around = above.zip(here).zip(below);
    for (gradient, ((((a, b), c), (d, e)), ((f, g), h))) in gradients.iter_mut().zip(around) {
        // The eight around the pixel, row by row: a b c, d e, f g h. 4 * 8160 is less than 2^15.
        let (falling, rising) = (h - a, c - f);
        gradient.x = falling + rising + 2 * (e - d);
        gradient.y = falling - rising + 2 * (g - b);
    }
}
