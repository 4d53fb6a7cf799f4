//! The direction to the centroid of intensity.

use multiversion::multiversion;

use super::levels::MARGIN_PX;
use crate::image::GrayImage;

/// The radius of the disc that the centroid is taken of, in pixels of the level: half of the patch of 31 pixels
/// (Rublee et al. 2011).
pub(super) const PATCH_RADIUS_PX: usize = 15;
/// A row of the disc is read as this many pixels.
const READ_PX: usize = 32;

/// A direction in the image, as a unit vector: x right, y down.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Direction {
    pub(super) x: f32,
    pub(super) y: f32,
}

/// The direction from a pixel to the centroid of intensity of the disc around it, on a level of the pyramid; to the
/// right where the disc is of one brightness. None within [`MARGIN_PX`] of the edge.
pub(super) fn direction(level: &GrayImage, column: usize, row: usize) -> Option<Direction> {
    let start = column.checked_sub(PATCH_RADIUS_PX)?;
    let first = row.checked_sub(PATCH_RADIUS_PX)?;
    let mut rows = [&[0; READ_PX]; 2 * PATCH_RADIUS_PX + 1];
    for (offset, read) in rows.iter_mut().enumerate() {
        *read = level.row(first + offset).get(start..start + READ_PX)?.try_into().ok()?;
    }
    const { assert!(MARGIN_PX > PATCH_RADIUS_PX && READ_PX <= 2 * MARGIN_PX) }
    let [x, y] = moments(&rows);
    let length = f64::from(x).hypot(f64::from(y));
    if length == 0.0 {
        return Some(Direction { x: 1.0, y: 0.0 });
    }
    let part = |moment: i32| (f64::from(moment) / length) as f32;
    Some(Direction { x: part(x), y: part(y) })
}

/// All bits of the pixels of a row, by its distance from the middle row, that lie on the disc.
const DISC: [[i16; READ_PX]; PATCH_RADIUS_PX + 1] = disc();

const fn disc() -> [[i16; READ_PX]; PATCH_RADIUS_PX + 1] {
    let mut disc = [[0; READ_PX]; PATCH_RADIUS_PX + 1];
    let mut y = 0;
    while y <= PATCH_RADIUS_PX {
        let mut x = 0;
        while x <= 2 * PATCH_RADIUS_PX {
            let across = x.abs_diff(PATCH_RADIUS_PX);
            // A pixel lies on the disc when its centre is within half a pixel of the radius: x^2 + y^2 < (r + 1/2)^2.
            if across * across + y * y <= PATCH_RADIUS_PX * PATCH_RADIUS_PX + PATCH_RADIUS_PX {
                disc[y][x] = -1;
            }
            x += 1;
        }
        y += 1;
    }
    disc
}

/// The first moments of intensity about the middle, `sum x I` and `sum y I`. In 16 bits nothing overflows: a column
/// adds up to 31 * 255, and the differences of rows, weighted by their distances, to 120 * 255 = 30,600.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2"))]
fn moments(rows: &[&[u8; READ_PX]; 2 * PATCH_RADIUS_PX + 1]) -> [i32; 2] {
    let mut of_column = [0_i16; READ_PX];
    let mut across_rows = [0_i16; READ_PX];
    for i in 0..READ_PX {
        of_column[i] = i16::from(rows[PATCH_RADIUS_PX][i]) & DISC[0][i];
    }
    for y in 1..=PATCH_RADIUS_PX {
        let (above, below) = (rows[PATCH_RADIUS_PX - y], rows[PATCH_RADIUS_PX + y]);
        for i in 0..READ_PX {
            let (above, below) =
                (i16::from(above[i]) & DISC[y][i], i16::from(below[i]) & DISC[y][i]);
            of_column[i] += above + below;
            across_rows[i] += (below - above) * y as i16;
        }
    }
    let mut moments = [0, 0];
    for i in 0..READ_PX {
        moments[0] += i32::from(of_column[i]) * (i as i32 - PATCH_RADIUS_PX as i32);
        moments[1] += i32::from(across_rows[i]);
    }
    moments
}
