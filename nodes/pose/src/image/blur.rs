//! The Gaussian blur that descriptors are taken from.

use multiversion::multiversion;

use super::GrayImage;

/// How far the kernel reaches to each side: 7 x 7 pixels, as ORB has it (Rublee et al. 2011 take box means of 5 x 5;
/// the implementations that followed take this).
pub(crate) const BLUR_RADIUS_PX: usize = 3;

/// The weights of a Gaussian of 2 pixels at the distances 0 .. 3, in parts of 256: `exp(-d^2 / 8)`, scaled and
/// rounded so that all seven add up to 256.
const WEIGHTS: [u16; BLUR_RADIUS_PX + 1] = [56, 49, 33, 18];

/// Half of the parts: what makes a division round.
const HALF: u16 = 128;
const PARTS_BITS: u32 = 8;

/// The image under a Gaussian of 7 x 7 pixels with a standard deviation of 2. Beyond the edges the image is mirrored,
/// the outermost pixel not repeated. Nothing for an image narrower or lower than 4 pixels, which has no mirror image
/// so wide.
#[must_use]
pub fn blurred(image: &GrayImage) -> Option<GrayImage> {
    let mut output = GrayImage::black(image.width_px(), image.height_px())?;
    let mut blur = Blur::default();
    blur_rows(image, 0, output.pixels_mut(), &mut blur)?;
    Some(output)
}

/// The memory of a blur between its two passes.
#[derive(Clone, Default, Debug)]
pub(crate) struct Blur {
    /// A row blurred along its column, mirrored at both ends.
    row: Vec<u8>,
}

/// Blurs some rows of an image, from `first_row` on, into `output`, which holds whole rows. None where the image is
/// smaller than the kernel's half.
pub(crate) fn blur_rows(
    image: &GrayImage,
    first_row: usize,
    output: &mut [u8],
    blur: &mut Blur,
) -> Option<()> {
    let (width_px, height_px) = (image.width_px(), image.height_px());
    if width_px <= BLUR_RADIUS_PX || height_px <= BLUR_RADIUS_PX {
        return None;
    }
    blur.row.resize(width_px + 2 * BLUR_RADIUS_PX, 0);
    for (row, output) in (first_row..height_px).zip(output.chunks_exact_mut(width_px)) {
        let rows: [&[u8]; 2 * BLUR_RADIUS_PX + 1] = std::array::from_fn(|tap| {
            image.row(mirrored(row as isize + tap as isize - BLUR_RADIUS_PX as isize, height_px))
        });
        blur_row(rows, &mut blur.row, output);
    }
    Some(())
}

/// The pixel that a mirror at the image's edge shows beyond it.
fn mirrored(index: isize, size: usize) -> usize {
    let last = size as isize - 1;
    let inside = if index < 0 { -index } else { index.min(2 * last - index) };
    inside.clamp(0, last) as usize
}

/// One row: along the columns, then along the row.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2"))]
fn blur_row(rows: [&[u8]; 7], mirrored: &mut [u8], output: &mut [u8]) {
    let width = output.len();
    let Some(middle) = mirrored.get_mut(BLUR_RADIUS_PX..BLUR_RADIUS_PX + width) else { return };
    // The lengths are equal; said here, so that the loop needs to check none.
    let [r0, r1, r2, r3, r4, r5, r6] = rows.map(|row| row.get(..width).unwrap_or_default());
    if r0.len() != width || r1.len() != width || r2.len() != width || r3.len() != width {
        return;
    }
    if r4.len() != width || r5.len() != width || r6.len() != width {
        return;
    }
    for column in 0..width {
        middle[column] = weighted([
            r0[column], r1[column], r2[column], r3[column], r4[column], r5[column], r6[column],
        ]);
    }
    for side in 1..=BLUR_RADIUS_PX {
        mirrored[BLUR_RADIUS_PX - side] = mirrored[BLUR_RADIUS_PX + side];
        mirrored[BLUR_RADIUS_PX + width - 1 + side] = mirrored[BLUR_RADIUS_PX + width - 1 - side];
    }
    let Some(taps) = mirrored.get(..width + 2 * BLUR_RADIUS_PX) else { return };
    for (column, output) in output.iter_mut().enumerate() {
        *output = weighted([
            taps[column],
            taps[column + 1],
            taps[column + 2],
            taps[column + 3],
            taps[column + 4],
            taps[column + 5],
            taps[column + 6],
        ]);
    }
}

/// The weighted mean of seven values. Nothing overflows: 255 * 256 + 128 has 16 bits.
#[inline(always)]
fn weighted(values: [u8; 7]) -> u8 {
    let [a, b, c, middle, d, e, f] = values;
    let sum = u16::from(middle) * WEIGHTS[0]
        + (u16::from(c) + u16::from(d)) * WEIGHTS[1]
        + (u16::from(b) + u16::from(e)) * WEIGHTS[2]
        + (u16::from(a) + u16::from(f)) * WEIGHTS[3];
    ((sum + HALF) >> PARTS_BITS) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    /// The same, pixel by pixel.
    fn plain(image: &GrayImage) -> Vec<u8> {
        let (width, height) = (image.width_px(), image.height_px());
        let tap = |offset: isize| u32::from(WEIGHTS[offset.unsigned_abs()]);
        let pass = |pixels: &[u8], right: isize, down: isize| -> Vec<u8> {
            let places =
                (0..height as isize).flat_map(|y| (0..width as isize).map(move |x| (x, y)));
            let value = |(x, y): (isize, isize)| {
                let at = |offset: isize| {
                    let column = mirrored(x + offset * right, width);
                    u32::from(pixels[mirrored(y + offset * down, height) * width + column])
                };
                (((-3..=3).map(|offset| tap(offset) * at(offset)).sum::<u32>() + 128) / 256) as u8
            };
            places.map(value).collect()
        };
        pass(&pass(image.pixels(), 0, 1), 1, 0)
    }

    #[test]
    fn the_fast_blur_is_the_plain_one() {
        let mut random = Random::new(3);
        for (width, height) in [(4, 4), (5, 9), (40, 7), (131, 33)] {
            let pixels = (0..width * height).map(|_| random.bits() as u8).collect();
            let image = GrayImage::new(width, height, pixels).unwrap();
            assert_eq!(blurred(&image).unwrap().pixels(), plain(&image));
        }
        assert_eq!(blurred(&GrayImage::black(3, 9).unwrap()), None);
    }

    #[test]
    fn a_point_becomes_a_gaussian_of_two_pixels() {
        let mut image = GrayImage::black(15, 15).unwrap();
        image.pixels_mut()[7 * 15 + 7] = 255;
        let blurred = blurred(&image).unwrap();
        let weight = |d: usize| (-((d * d) as f64) / 8.0).exp();
        let sum: f64 = (0..7).map(|d: usize| weight(d.abs_diff(3))).sum();
        for (row, column) in (4..11).flat_map(|row| (4..11).map(move |column| (row, column))) {
            let expected = 255.0 * weight(7_usize.abs_diff(row)) * weight(7_usize.abs_diff(column))
                / (sum * sum);
            let found = f64::from(blurred.pixel(column, row).unwrap());
            assert!((found - expected).abs() < 1.0, "{column} {row}: {found} {expected}");
        }
        assert_eq!(blurred.pixel(3, 7), Some(0));
    }
}
