//! BRIEF, turned with the corner.

use multiversion::multiversion;

use super::{
    corner::Descriptor,
    orientation::{Direction, PATCH_RADIUS_PX},
    pattern::{PATTERN, TESTS},
};
use crate::image::GrayImage;

/// The rows of a patch.
const PATCH_ROWS: usize = 2 * PATCH_RADIUS_PX + 1;
/// Pixels of a patch's row, the last unused: a power of two, so that an index needs no check.
const PATCH_COLUMNS: usize = 32;
/// The same with a last row that is not used.
const PATCH_PIXELS: usize = PATCH_COLUMNS * PATCH_COLUMNS;

/// The descriptor of a pixel of a level: which of two pixels around it is brighter, 256 times. `blurred` is the level
/// under the blur. None within 16 pixels of the edge.
pub(super) fn describe(
    blurred: &GrayImage,
    column: usize,
    row: usize,
    direction: Direction,
) -> Option<Descriptor> {
    let start = column.checked_sub(PATCH_RADIUS_PX)?;
    let first = row.checked_sub(PATCH_RADIUS_PX)?;
    let mut patch = [0; PATCH_PIXELS];
    for (row, patch) in (first..first + PATCH_ROWS).zip(patch.chunks_exact_mut(PATCH_COLUMNS)) {
        patch.copy_from_slice(blurred.row(row).get(start..start + PATCH_COLUMNS)?);
    }
    Some(compare(&patch, direction))
}

/// The tests' pixels as the arithmetic below needs them: x and y of the first, then of the second.
static COORDINATES: [[f32; TESTS]; 4] = coordinates();

const fn coordinates() -> [[f32; TESTS]; 4] {
    let mut coordinates = [[0.0; TESTS]; 4];
    let mut test = 0;
    while test < TESTS {
        let mut coordinate = 0;
        while coordinate < 4 {
            coordinates[coordinate][test] = PATTERN[test][coordinate] as f32;
            coordinate += 1;
        }
        test += 1;
    }
    coordinates
}

/// Compares the pixels of all tests, turned from the x axis to `direction`.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2"))]
fn compare(patch: &[u8; PATCH_PIXELS], direction: Direction) -> Descriptor {
    let [first_x, first_y, second_x, second_y] = &COORDINATES;
    let mut first = [0_u16; TESTS];
    let mut second = [0_u16; TESTS];
    for test in 0..TESTS {
        first[test] = turned_index(first_x[test], first_y[test], direction);
        second[test] = turned_index(second_x[test], second_y[test], direction);
    }
    let mut words = [0; TESTS / 64];
    for (word, (first, second)) in
        words.iter_mut().zip(first.chunks_exact(64).zip(second.chunks_exact(64)))
    {
        let mut bits = 0_u64;
        for (bit, (&first, &second)) in first.iter().zip(second).enumerate() {
            let is_darker = patch[usize::from(first) % PATCH_PIXELS]
                < patch[usize::from(second) % PATCH_PIXELS];
            bits |= u64::from(is_darker) << bit;
        }
        *word = bits;
    }
    Descriptor(words)
}

/// Adding this to a number of a few digits leaves the number, rounded to a whole one, in the last bits of the float:
/// 1.5 * 2^23. The patch's middle is added in the same step.
const ROUNDING: f32 = 12_582_912.0 + PATCH_RADIUS_PX as f32;

/// Where a pixel of the pattern lies in the patch after the turn.
#[inline(always)]
fn turned_index(x: f32, y: f32, direction: Direction) -> u16 {
    let column = (x * direction.x - y * direction.y + ROUNDING).to_bits();
    let row = (x * direction.y + y * direction.x + ROUNDING).to_bits();
    ((row << PATCH_COLUMNS.trailing_zeros()).wrapping_add(column & (PATCH_COLUMNS as u32 - 1)))
        as u16
        % PATCH_PIXELS as u16
}
