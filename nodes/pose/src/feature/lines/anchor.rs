//! Where edges are drawn from.

use std::ops::Range;

use estimation::Executor;
use estimation::executor::map;

use super::gradient::{Gradient, GradientField, LEAST_SIDE_PX};

/// Anchors are sorted by strength to a quarter of a gray level: 8 units.
const STRENGTH_SHIFT: u32 = 3;

/// The pixels whose gradient is a maximum across the edge (Edge Drawing, step 3): the strongest first, and row by
/// row those that are equally strong.
///
/// Rows and columns are searched at each `interval`.
pub(super) fn anchors(
    field: &GradientField,
    least_magnitude: u16,
    interval: usize,
    executor: &dyn Executor,
) -> Vec<usize> {
    if field.width_px < LEAST_SIDE_PX || field.height_px < LEAST_SIDE_PX {
        return Vec::new();
    }
    let search =
        Search { field, least_magnitude: least_magnitude.max(1), interval: interval.max(1) };
    let rows = 1..field.height_px - 1;
    let stripe_rows = rows.len().div_ceil(executor.threads().get());
    let stripes = rows.clone().step_by(stripe_rows);
    let stripes = stripes.map(|first| first..(first + stripe_rows).min(rows.end)).collect();
    let found = map(executor, stripes, |stripe| search.stripe(stripe)).concat();
    strongest_first(&found)
}

/// A pixel and the magnitude of its gradient.
type Found = (u16, usize);

#[derive(Clone, Copy)]
struct Search<'a> {
    field: &'a GradientField,
    least_magnitude: u16,
    interval: usize,
}

/// The values by which a row's pixels are compared.
#[derive(Clone, Default)]
struct Row {
    magnitudes: Vec<u16>,
    /// All bits set where the edge runs along the row.
    along_row: Vec<u16>,
}

impl Row {
    fn fill(&mut self, gradients: &[Gradient]) {
        let into = self.magnitudes.iter_mut().zip(&mut self.along_row);
        for ((magnitude, along_row), gradient) in into.zip(gradients) {
            *magnitude = gradient.magnitude();
            *along_row = if gradient.edge_runs_along_row() { u16::MAX } else { 0 };
        }
    }
}

impl Search<'_> {
    /// The anchors of some rows, none of which is outermost.
    fn stripe(self, rows: Range<usize>) -> Vec<Found> {
        let width_px = self.field.width_px;
        let gradients = |row: usize| &self.field.gradients[row * width_px..(row + 1) * width_px];
        let empty = Row { magnitudes: vec![0; width_px], along_row: vec![0; width_px] };
        let [mut above, mut here, mut below] = [empty.clone(), empty.clone(), empty];
        above.fill(gradients(rows.start - 1));
        here.fill(gradients(rows.start));
        let mut is_anchor = vec![0; width_px];
        let mut columns = vec![0; width_px + 1];
        let mut found = Vec::new();
        for row in rows {
            below.fill(gradients(row + 1));
            self.mark([&above, &here, &below], &mut is_anchor);
            let step = if row % self.interval == 0 { 1 } else { self.interval };
            // Each column is written, and the next one over it where it is none: no branch to be guessed.
            let mut count = 0;
            for (column, &is_anchor) in is_anchor.iter().enumerate().step_by(step) {
                columns[count] = column;
                count += usize::from(is_anchor);
            }
            let first = row * width_px;
            found.extend(columns[..count].iter().map(|&at| (here.magnitudes[at], first + at)));
            std::mem::swap(&mut above, &mut here);
            std::mem::swap(&mut here, &mut below);
        }
        found
    }

    /// 1 at the columns of the middle row that are anchors.
    fn mark(self, [above, here, below]: [&Row; 3], is_anchor: &mut [u16]) {
        let inner = is_anchor.len() - 2;
        let along_row = &here.along_row[1..=inner];
        let [left, here, right] = [0, 1, 2].map(|step| &here.magnitudes[step..step + inner]);
        let [above, below] = [above, below].map(|row| &row.magnitudes[1..=inner]);
        let around = left.iter().zip(right).zip(above).zip(below);
        let pixels = here.iter().zip(along_row).zip(around);
        for (is_anchor, ((&here, &along_row), (((&left, &right), &above), &below))) in
            is_anchor[1..=inner].iter_mut().zip(pixels)
        {
            let before = (above & along_row) | (left & !along_row);
            let after = (below & along_row) | (right & !along_row);
            let short = before.saturating_sub(here)
                | after.saturating_sub(here)
                | self.least_magnitude.saturating_sub(here);
            *is_anchor = u16::from(short == 0);
        }
    }
}

/// Sorted by counting: a comparing sort costs as much as all else together.
fn strongest_first(found: &[Found]) -> Vec<usize> {
    let weakness = |magnitude: u16| usize::from((u16::MAX - magnitude) >> STRENGTH_SHIFT);
    let mut places = vec![0; (1 << (u16::BITS - STRENGTH_SHIFT)) + 1];
    for &(magnitude, _) in found {
        places[weakness(magnitude) + 1] += 1;
    }
    let mut before = 0;
    for place in &mut places {
        before += *place;
        *place = before;
    }
    let mut pixels = vec![0; found.len()];
    for &(magnitude, pixel) in found {
        let place = &mut places[weakness(magnitude)];
        pixels[*place] = pixel;
        *place += 1;
    }
    pixels
}
