//! The descriptor of a line segment.

use super::detector::LineDetector;
use super::gradient::GradientField;
use super::segment::LineSegment;

/// Bands beside each other along the segment (Zhang and Koch 2013: m).
const BANDS: usize = 9;
/// Rows of pixels in a band (there: w).
const BAND_ROWS: usize = 7;
/// Rows in all: the middle one is the segment itself.
const ROWS: usize = BANDS * BAND_ROWS;
/// A band's numbers come from its own rows and those of the bands beside it.
const REACH_ROWS: usize = BAND_ROWS + BAND_ROWS / 2;
/// A row counts the less the farther it is from the segment: the deviation of the weight (there: sigma_g).
const FAR_SIGMA_ROWS: f32 = 0.5 * (ROWS - 1) as f32;
/// And the less the farther it is from the middle of the band (there: sigma_l).
const BAND_SIGMA_ROWS: f32 = BAND_ROWS as f32;
/// Pixels between two samples of a row: a smoothed image holds no more.
const SAMPLE_STEP_PX: f32 = 2.0;
/// More samples of a row than this say nothing new about a mean.
const MOST_SAMPLES: usize = 24;
/// The values of each band: the mean and the deviation, over rows, of the sums of gradients to the left, to the
/// right, ahead and back.
const NUMBERS: usize = 8;
/// Pairs of bands that are compared: all 36 but the four that lie farthest apart.
const PAIRS: usize = 32;
/// Positions within a pixel, as fractions of this many bits.
const FRACTION_BITS: u32 = 16;

/// The descriptor of a segment's surroundings: a binary line band descriptor, of 256 bits.
///
/// Each bit says whether one band along the segment has more of some gradient than another band has. It does not depend
/// on brightness or contrast, nor on where the segment lies or how it is turned, within what pixels allow; of two scales
/// it does.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Debug)]
pub struct LineDescriptor(pub [u64; 4]);

impl LineDescriptor {
    /// How many bits it has.
    pub const BITS: u32 = (PAIRS * NUMBERS) as u32;

    /// How many bits of two descriptors differ (Hamming): 0 for the same look, about 128 for any two.
    #[must_use]
    pub fn distance_bits(&self, other: &Self) -> u32 {
        self.0.iter().zip(&other.0).map(|(one, other)| (one ^ other).count_ones()).sum()
    }
}

/// A line segment, and what it looks like.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LineFeature {
    /// Where it is.
    pub segment: LineSegment,
    /// Its descriptor.
    pub descriptor: LineDescriptor,
}

impl LineDetector {
    /// The descriptors of these segments in the image that was last given to [`detect`](Self::detect).
    #[must_use]
    pub fn describe(&self, segments: &[LineSegment]) -> Vec<LineFeature> {
        let weights = Weights::new();
        let describe = |segment: &LineSegment| LineFeature {
            segment: *segment,
            descriptor: descriptor(self.field(), segment, &weights),
        };
        segments.iter().map(describe).collect()
    }
}

/// How much a row counts.
struct Weights {
    /// For its distance from the segment.
    of_row: [f32; ROWS],
    /// For its distance from the middle of the band.
    in_band: [f32; 2 * REACH_ROWS + 1],
}

impl Weights {
    fn new() -> Self {
        let gauss = |place: usize, middle: usize, sigma: f32| {
            let off = (place as f32 - middle as f32) / sigma;
            (-0.5 * off * off).exp()
        };
        Self {
            of_row: std::array::from_fn(|row| gauss(row, ROWS / 2, FAR_SIGMA_ROWS)),
            in_band: std::array::from_fn(|row| gauss(row, REACH_ROWS, BAND_SIGMA_ROWS)),
        }
    }
}

/// Sums over the samples of a row: of what points to the left of the segment, to the right, ahead and back.
type RowSums = [f32; 4];

fn descriptor(field: &GradientField, segment: &LineSegment, weights: &Weights) -> LineDescriptor {
    let rows = row_sums(field, segment);
    let bands: [[f32; NUMBERS]; BANDS] =
        std::array::from_fn(|band| band_numbers(&rows, band, weights));
    let mut words = [0; 4];
    for (pair, (one, other)) in compared_bands().enumerate() {
        for (number, (one, other)) in bands[one].iter().zip(&bands[other]).enumerate() {
            let bit = pair * NUMBERS + number;
            words[bit / 64] |= u64::from(one > other) << (bit % 64);
        }
    }
    LineDescriptor(words)
}

/// All pairs of bands but those of the outer two on one side with the outer two on the other.
fn compared_bands() -> impl Iterator<Item = (usize, usize)> {
    let is_near = |&(one, other): &(usize, usize)| !(one <= 1 && other >= BANDS - 2);
    (0..BANDS).flat_map(|one| (one + 1..BANDS).map(move |other| (one, other))).filter(is_near)
}

/// Means and deviations over the rows in and beside a band, by turns.
fn band_numbers(rows: &[RowSums; ROWS], band: usize, weights: &Weights) -> [f32; NUMBERS] {
    let middle = band * BAND_ROWS + BAND_ROWS / 2;
    let (mut sums, mut squares, mut count) = ([0.0; 4], [0.0; 4], 0.0_f32);
    for (place, in_band) in weights.in_band.iter().enumerate() {
        // Of the outer bands a part lies beyond the rows.
        let Some(row) = (middle + place).checked_sub(REACH_ROWS).filter(|&row| row < ROWS) else {
            continue;
        };
        let weight = weights.of_row[row] * in_band;
        for (kind, &sum) in rows[row].iter().enumerate() {
            sums[kind] += weight * sum;
            squares[kind] += (weight * sum) * (weight * sum);
        }
        count += 1.0;
    }
    std::array::from_fn(|number| {
        let kind = number / 2;
        let mean = sums[kind] / count;
        if number % 2 == 0 { mean } else { (squares[kind] / count - mean * mean).max(0.0).sqrt() }
    })
}

/// The sums of each row, from the leftmost to the rightmost.
fn row_sums(field: &GradientField, segment: &LineSegment) -> [RowSums; ROWS] {
    let length_px = segment.length_px();
    let mut rows = [[0.0; 4]; ROWS];
    if field.gradients.is_empty() || length_px.is_nan() || length_px <= 0.0 {
        return rows;
    }
    let along = segment.along_px().map(|part| part / length_px);
    let samples = ((length_px / SAMPLE_STEP_PX) as usize).clamp(1, MOST_SAMPLES);
    let step_px = length_px / samples as f32;
    let fixed = |px: f32| (px * (1_u32 << FRACTION_BITS) as f32) as i64;
    let step = along.map(|part| fixed(part * step_px));
    for (row, sums) in rows.iter_mut().enumerate() {
        let right_px = row as f32 - (ROWS / 2) as f32;
        // Half a pixel more, since the nearest is sought.
        let first = [
            segment.start_px[0] + 0.5 * step_px * along[0] - right_px * along[1] + 0.5,
            segment.start_px[1] + 0.5 * step_px * along[1] + right_px * along[0] + 0.5,
        ];
        *sums = samples_of_row(field, first.map(fixed), step, samples, along);
    }
    rows
}

/// The sums over samples from `at` on, `step` apart, in fractions of a pixel. Beyond the image nothing is seen.
fn samples_of_row(
    field: &GradientField,
    mut at: [i64; 2],
    step: [i64; 2],
    samples: usize,
    along: [f32; 2],
) -> RowSums {
    let mut sums = [0.0; 4];
    for _ in 0..samples {
        // A negative number becomes one that is larger than any image.
        let [column, row] = at.map(|part| (part >> FRACTION_BITS) as usize);
        if column < field.width_px && row < field.height_px {
            let gradient = field.gradients[row * field.width_px + column];
            let [x, y] = [gradient.x, gradient.y].map(f32::from);
            let left = x * along[1] - y * along[0];
            let ahead = x * along[0] + y * along[1];
            sums[0] += left.max(0.0);
            sums[1] += (-left).max(0.0);
            sums[2] += ahead.max(0.0);
            sums[3] += (-ahead).max(0.0);
        }
        at = [at[0] + step[0], at[1] + step[1]];
    }
    sums
}
