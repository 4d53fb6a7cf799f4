//! An image made smaller.

use multiversion::multiversion;

use super::GrayImage;

/// Weights are in parts of 256: a position in the larger image is exact to 1/512 pixel.
const PARTS: u16 = 1 << PARTS_BITS;
const PARTS_BITS: u32 = 8;

/// Makes images of one size smaller, to one other size, by bilinear interpolation with the images' outer edges
/// aligned. For factors below 2; beyond, pixels would be left out.
#[derive(Clone, Debug)]
pub(crate) struct Resampler {
    columns: Vec<Tap>,
    rows: Vec<Tap>,
    /// A row interpolated between two rows of the larger image, in parts of 256.
    between: Vec<u16>,
}

/// Which two pixels lie around a position, and how near it is to the second.
#[derive(Clone, Copy, Debug)]
struct Tap {
    first: u16,
    second_parts: u16,
}

/// The taps along one side.
fn taps(from_px: usize, to_px: usize) -> Vec<Tap> {
    let scale = from_px as f64 / to_px as f64;
    (0..to_px)
        .map(|pixel| {
            let position = ((pixel as f64 + 0.5) * scale - 0.5).clamp(0.0, (from_px - 1) as f64);
            let first = (position.floor() as usize).min(from_px.saturating_sub(2));
            let second_parts = ((position - first as f64) * f64::from(PARTS)).round() as u16;
            Tap { first: first as u16, second_parts }
        })
        .collect()
}

impl Resampler {
    /// From images of one size (columns, rows) to images of another. None for images without pixels, or of more
    /// columns or rows than 65,535.
    pub(crate) fn new(from_px: (usize, usize), to_px: (usize, usize)) -> Option<Self> {
        let sides = [from_px.0, from_px.1, to_px.0, to_px.1];
        sides.iter().all(|side| (2..=usize::from(u16::MAX)).contains(side)).then(|| Self {
            columns: taps(from_px.0, to_px.0),
            rows: taps(from_px.1, to_px.1),
            between: vec![0; from_px.0],
        })
    }

    /// Makes `image` smaller; both images have the sizes of [`new`](Self::new).
    pub(crate) fn resample(&mut self, image: &GrayImage, output: &mut GrayImage) {
        let width_px = output.width_px();
        for (row, output) in self.rows.iter().zip(output.pixels_mut().chunks_exact_mut(width_px)) {
            let first = usize::from(row.first);
            interpolate_rows(
                image.row(first),
                image.row(first + 1),
                row.second_parts,
                &mut self.between,
            );
            interpolate_columns(&self.between, &self.columns, output);
        }
    }
}

/// A row between two rows, in parts of 256.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2"))]
fn interpolate_rows(first: &[u8], second: &[u8], second_parts: u16, output: &mut [u16]) {
    let first_parts = PARTS - second_parts;
    for ((output, &first), &second) in output.iter_mut().zip(first).zip(second) {
        *output = u16::from(first) * first_parts + u16::from(second) * second_parts;
    }
}

/// The pixels between the columns of a row.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2"))]
fn interpolate_columns(row: &[u16], taps: &[Tap], output: &mut [u8]) {
    for (output, tap) in output.iter_mut().zip(taps) {
        let first = usize::from(tap.first);
        let Some(&[first, second]) = row.get(first..first + 2) else { continue };
        let (first, second) = (i32::from(first), i32::from(second));
        // first * (256 - parts) + second * parts, with one product less.
        let sum = (first << PARTS_BITS) + (second - first) * i32::from(tap.second_parts);
        *output = ((sum + (1 << 15)) >> 16) as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ramp stays the ramp that it was: the outer edges of both images lie upon each other.
    #[test]
    fn a_smaller_image_shows_the_same_at_the_same_place() {
        let brightness = |x: f64, y: f64| 20.0 + 150.0 * x + 60.0 * y;
        let make = |width: usize, height: usize| {
            let places = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
            let pixels = places.map(|(column, row)| {
                let (x, y) =
                    ((column as f64 + 0.5) / width as f64, (row as f64 + 0.5) / height as f64);
                brightness(x, y).round() as u8
            });
            GrayImage::new(width, height, pixels.collect()).unwrap()
        };
        for (from, to) in [((120, 90), (100, 75)), ((64, 48), (53, 40)), ((64, 48), (33, 25))] {
            let mut smaller = GrayImage::black(to.0, to.1).unwrap();
            Resampler::new(from, to).unwrap().resample(&make(from.0, from.1), &mut smaller);
            let expected = make(to.0, to.1);
            for (found, expected) in smaller.pixels().iter().zip(expected.pixels()) {
                assert!(found.abs_diff(*expected) <= 1);
            }
        }
        assert!(
            Resampler::new((1, 9), (1, 8)).is_none()
                && Resampler::new((70_000, 9), (9, 8)).is_none()
        );
    }
}
