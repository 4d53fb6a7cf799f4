//! The corners of one level, by cell above the higher or the lower threshold.

use std::ops::Range;

use multiversion::multiversion;

use super::{
    levels::MARGIN_PX,
    segment_test::{self, RING_RADIUS_PX},
};
use crate::image::GrayImage;

/// A pixel that is a corner.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Candidate {
    /// In pixels of its level.
    pub(super) column: u16,
    /// In pixels of its level.
    pub(super) row: u16,
    /// The largest threshold below which it is a corner.
    pub(super) strength: u8,
    /// The strengths of the pixels to its left and right.
    pub(super) beside: [u8; 2],
    /// The strengths of the pixels above and below.
    pub(super) above_below: [u8; 2],
}

impl Candidate {
    /// Where the strength is largest, to parts of a pixel of the level: the vertex of the parabola through the
    /// strengths of the pixel and its neighbours, in each direction of its own.
    pub(super) fn refined(&self) -> [f32; 2] {
        let vertex = |[before, after]: [u8; 2]| {
            let (before, after) = (f32::from(before), f32::from(after));
            let bend = 2.0 * f32::from(self.strength) - before - after;
            if bend > 0.0 { 0.5 * (after - before) / bend } else { 0.0 }
        };
        [
            f32::from(self.column) + vertex(self.beside),
            f32::from(self.row) + vertex(self.above_below),
        ]
    }
}

/// The scratch memory of a thread.
#[derive(Clone, Default, Debug)]
pub(super) struct Scratch {
    /// Strengths of the band's rows and of one above and below.
    strengths: Vec<u8>,
    /// Strengths where they are largest among their eight neighbours, else 0.
    peaks: Vec<u8>,
    /// The largest peak of each row and cell.
    most: Vec<u8>,
    /// The threshold of each cell.
    thresholds: Vec<u8>,
}

/// How a level is searched; the thresholds of the configuration.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search {
    pub(super) threshold: u8,
    pub(super) low_threshold: u8,
    pub(super) cell_px: usize,
}

/// The corners in a band of rows of a level, row by row. A cell is `cell_px` columns of the band.
pub(super) fn detect(
    image: &GrayImage,
    band: Range<usize>,
    search: &Search,
    scratch: &mut Scratch,
) -> Vec<Candidate> {
    let (width, height) = (image.width_px(), image.height_px());
    let rows = band.start.max(MARGIN_PX)..band.end.min(height.saturating_sub(MARGIN_PX));
    let columns = MARGIN_PX..width.saturating_sub(MARGIN_PX);
    if rows.is_empty() || columns.is_empty() {
        return Vec::new();
    }
    scratch.find_peaks(image, &rows, search.low_threshold);
    scratch.choose_thresholds(width, &columns, search);
    scratch.collect(width, rows.start, &columns, search.cell_px)
}

impl Scratch {
    /// Strengths and peaks of all rows.
    fn find_peaks(&mut self, image: &GrayImage, rows: &Range<usize>, threshold: u8) {
        let width = image.width_px();
        self.strengths.resize((rows.len() + 2) * width, 0);
        self.peaks.resize(rows.len() * width, 0);
        let with_neighbours = rows.start - 1..rows.end + 1;
        for (row, strengths) in with_neighbours.zip(self.strengths.chunks_exact_mut(width)) {
            let ring_rows = std::array::from_fn(|offset| image.row(row + offset - RING_RADIUS_PX));
            segment_test::row_strengths(ring_rows, threshold, strengths);
        }
        for (row, peaks) in self.peaks.chunks_exact_mut(width).enumerate() {
            let start = row * width;
            if let Some(three) = self.strengths.get(start..start + 3 * width) {
                row_peaks(three, peaks);
            }
        }
    }

    /// The higher threshold for the cells that hold a corner above it, the lower for the others.
    fn choose_thresholds(&mut self, width: usize, columns: &Range<usize>, search: &Search) {
        let cells = columns.len().div_ceil(search.cell_px);
        self.most.clear();
        self.thresholds.clear();
        self.thresholds.resize(cells, search.low_threshold);
        for peaks in self.peaks.chunks_exact(width) {
            let Some(peaks) = peaks.get(columns.clone()) else { continue };
            for (peaks, threshold) in peaks.chunks(search.cell_px).zip(&mut self.thresholds) {
                let most = largest(peaks);
                self.most.push(most);
                if most > search.threshold {
                    *threshold = search.threshold;
                }
            }
        }
    }

    /// The peaks above the thresholds of their cells.
    fn collect(
        &self,
        width: usize,
        first_row: usize,
        columns: &Range<usize>,
        cell_px: usize,
    ) -> Vec<Candidate> {
        let mut candidates = Vec::new();
        let rows =
            self.peaks.chunks_exact(width).zip(self.most.chunks_exact(self.thresholds.len()));
        for (row, (peaks, most)) in rows.enumerate() {
            for (cell, (&most, &threshold)) in most.iter().zip(&self.thresholds).enumerate() {
                if most <= threshold {
                    continue;
                }
                let start = columns.start + cell * cell_px;
                let peaks =
                    peaks.get(start..(start + cell_px).min(columns.end)).unwrap_or_default();
                for (offset, &strength) in peaks.iter().enumerate() {
                    if strength > threshold {
                        candidates.extend(self.candidate(width, start + offset, row, first_row));
                    }
                }
            }
        }
        candidates
    }

    /// The candidate at a column and a row of the band.
    fn candidate(
        &self,
        width: usize,
        column: usize,
        row: usize,
        first_row: usize,
    ) -> Option<Candidate> {
        // The strengths begin a row above the band.
        let middle = (row + 1) * width + column;
        let at = |index: usize| self.strengths.get(index).copied();
        Some(Candidate {
            column: column as u16,
            row: (first_row + row) as u16,
            strength: at(middle)?,
            beside: [at(middle - 1)?, at(middle + 1)?],
            above_below: [at(middle - width)?, at(middle + width)?],
        })
    }
}

/// The strengths of the middle of `three` rows where no neighbour is stronger; of equal neighbours the first counts.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2"))]
fn row_peaks(three: &[u8], peaks: &mut [u8]) {
    let width = peaks.len();
    if width < 3 || three.len() != 3 * width {
        return;
    }
    let (above, rest) = three.split_at(width);
    let (middle, below) = rest.split_at(width);
    let inner = width - 2;
    let (above_left, above_mid, above_right) = (&above[..inner], &above[1..=inner], &above[2..]);
    let (left, mid, right) = (&middle[..inner], &middle[1..=inner], &middle[2..]);
    let (below_left, below_mid, below_right) = (&below[..inner], &below[1..=inner], &below[2..]);
    let peaks = &mut peaks[1..=inner];
    for i in 0..inner {
        let before = above_left[i].max(above_mid[i]).max(above_right[i]).max(left[i]);
        let after = below_left[i].max(below_mid[i]).max(below_right[i]).max(right[i]);
        let is_peak = (mid[i] > before) & (mid[i] >= after);
        peaks[i] = if is_peak { mid[i] } else { 0 };
    }
}

/// The largest of some values.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2"))]
fn largest(values: &[u8]) -> u8 {
    let mut largest = 0;
    for &value in values {
        largest = value.max(largest);
    }
    largest
}
