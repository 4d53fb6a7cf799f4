//! Brightness from a Bayer pattern.

use super::luma;
use crate::image::GrayImage;

/// Which colours the first two rows of a Bayer pattern begin with.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum BayerPattern {
    /// Red, green; green, blue.
    Rggb,
    /// Blue, green; green, red.
    Bggr,
    /// Green, blue; red, green.
    Gbrg,
    /// Green, red; blue, green.
    Grbg,
}

impl BayerPattern {
    /// Column and row, 0 or 1, of the red pixel.
    fn red(self) -> (usize, usize) {
        match self {
            Self::Rggb => (0, 0),
            Self::Bggr => (1, 1),
            Self::Gbrg => (0, 1),
            Self::Grbg => (1, 0),
        }
    }
}

/// The brightness of each pixel: the colours that it does not measure are the means of the neighbours that do. At the
/// edges the pattern is mirrored, the outermost pixel not repeated, so that a colour stays in its columns.
pub(super) fn interpolated(samples: &GrayImage, pattern: BayerPattern) -> GrayImage {
    let (width, height) = (samples.width_px(), samples.height_px());
    let mut output = samples.clone();
    if width < 2 || height < 2 {
        return output;
    }
    let red = pattern.red();
    let before = |index: usize| index.abs_diff(1);
    let after = |index: usize, size: usize| if index + 1 < size { index + 1 } else { index - 1 };
    for (row, output) in output.pixels_mut().chunks_exact_mut(width).enumerate() {
        let (above, own, below) =
            (samples.row(before(row)), samples.row(row), samples.row(after(row, height)));
        for (column, output) in output.iter_mut().enumerate() {
            let (left, right) = (before(column), after(column, width));
            let mean = |values: [u8; 2]| mean(&values);
            let centre = own[column];
            let (is_red_column, is_red_row) = (column % 2 == red.0, row % 2 == red.1);
            *output = if is_red_column == is_red_row {
                // Red or blue: green beside it, the other at the corners.
                let green = self::mean(&[above[column], below[column], own[left], own[right]]);
                let other = self::mean(&[above[left], above[right], below[left], below[right]]);
                if is_red_row { luma(centre, green, other) } else { luma(other, green, centre) }
            } else {
                let (across, along) =
                    (mean([above[column], below[column]]), mean([own[left], own[right]]));
                if is_red_row { luma(along, centre, across) } else { luma(across, centre, along) }
            };
        }
    }
    output
}

/// The mean of a few values, rounded.
fn mean(values: &[u8]) -> u8 {
    let sum: usize = values.iter().map(|&value| usize::from(value)).sum();
    ((sum + values.len() / 2) / values.len().max(1)) as u8
}
