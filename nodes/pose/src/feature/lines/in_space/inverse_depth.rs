//! A straight line through inverse depths.

/// Pairs that lines are fitted through are taken from this many samples, evenly spread.
const MOST_ENDS: usize = 8;
/// A line is judged by this many samples, evenly spread.
const MOST_JUDGES: usize = 32;
/// Rounds of least squares over what is on the line: the set hardly ever changes after the second.
const ROUNDS: usize = 3;
/// An arc is searched for among the samples within this many times the tolerance: the ends of an arc are off its line.
const ARC_REACH: f64 = 3.0;

/// An inverse depth at a place along a segment.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Sample {
    /// From the segment's start.
    pub(super) along_px: f64,
    /// One over metres.
    pub(super) inverse_depth: f64,
}

/// A straight line through most samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Straight {
    mean_px: f64,
    mean: f64,
    slope: f64,
    /// The mean squared distance of samples on the line from their mean.
    spread_px2: f64,
    /// How many samples are on the line.
    pub(super) count: usize,
}

impl Straight {
    /// The line that most samples lie on within a tolerance, by least squares over these. `None` where no two samples
    /// are apart, or where the line passes behind the camera.
    pub(super) fn through(samples: &[Sample], tolerance: f64) -> Option<Self> {
        let mut straight = Self::agreed(samples, tolerance)?;
        for _ in 0..ROUNDS {
            straight = Self::least_squares(
                samples.iter().filter(|sample| straight.residual(sample).abs() <= tolerance),
            )?;
        }
        let on_line = |sample: &&Sample| straight.residual(sample).abs() <= tolerance;
        let count = samples.iter().filter(on_line).count();
        let is_ahead =
            samples.iter().filter(on_line).all(|sample| straight.at(sample.along_px) > 0.0);
        is_ahead.then_some(Self { count, ..straight })
    }

    /// Of the lines through pairs that lie apart the one that most samples agree with; of equals the first.
    fn agreed(samples: &[Sample], tolerance: f64) -> Option<Self> {
        let ends: Vec<&Sample> = evenly(samples, MOST_ENDS).collect();
        let judges: Vec<&Sample> = evenly(samples, MOST_JUDGES).collect();
        let apart = (ends.len() / 4).max(1);
        let mut best: Option<Self> = None;
        for (index, &one) in ends.iter().enumerate() {
            for &other in ends.get(index + apart..).unwrap_or_default() {
                let Some(mut line) = Self::least_squares([one, other].into_iter()) else {
                    continue;
                };
                let agrees = |sample: &&&Sample| line.residual(sample).abs() <= tolerance;
                line.count = judges.iter().filter(agrees).count();
                if best.is_none_or(|best| line.count > best.count) {
                    best = Some(line);
                }
            }
        }
        best
    }

    fn least_squares<'a>(samples: impl Iterator<Item = &'a Sample> + Clone) -> Option<Self> {
        let count = samples.clone().count();
        let share = 1.0 / count as f64;
        let mean_px = share * samples.clone().map(|sample| sample.along_px).sum::<f64>();
        let mean = share * samples.clone().map(|sample| sample.inverse_depth).sum::<f64>();
        let (mut spread_px2, mut product) = (0.0, 0.0);
        for sample in samples {
            let off_px = sample.along_px - mean_px;
            spread_px2 += share * off_px * off_px;
            product += share * off_px * (sample.inverse_depth - mean);
        }
        let slope = product / spread_px2;
        slope.is_finite().then_some(Self { mean_px, mean, slope, spread_px2, count })
    }

    /// The inverse depth of the line at a place.
    pub(super) fn at(&self, along_px: f64) -> f64 {
        self.mean + self.slope * (along_px - self.mean_px)
    }

    /// How much larger a sample's inverse depth is than the line's.
    pub(super) fn residual(&self, sample: &Sample) -> f64 {
        sample.inverse_depth - self.at(sample.along_px)
    }

    /// Standard deviation of the line at a place, when that of a sample is given and samples are independent.
    pub(super) fn std_dev(&self, along_px: f64, of_sample: f64) -> f64 {
        let off_px = along_px - self.mean_px;
        of_sample * ((1.0 + off_px * off_px / self.spread_px2) / self.count as f64).sqrt()
    }

    /// How far the middle of the samples near the line is off the line through its ends: the arc, by a parabola
    /// through the residuals.
    pub(super) fn bend(&self, samples: &[Sample], tolerance: f64) -> f64 {
        let near: Vec<&Sample> = samples
            .iter()
            .filter(|sample| self.residual(sample).abs() <= ARC_REACH * tolerance)
            .collect();
        let (Some(first), Some(last)) = (near.first(), near.last()) else { return 0.0 };
        let half_px = 0.5 * (last.along_px - first.along_px);
        let middle_px = 0.5 * (last.along_px + first.along_px);
        // Least squares for r = a + b t + c t^2 with t from -1 to 1, by the normal equations.
        let mut normal = nalgebra::Matrix3::zeros();
        let mut right = nalgebra::Vector3::zeros();
        for sample in near {
            let t = (sample.along_px - middle_px) / half_px;
            let row = nalgebra::Vector3::new(1.0, t, t * t);
            normal += row * row.transpose();
            right += row * self.residual(sample);
        }
        normal.cholesky().map_or(0.0, |normal| normal.solve(&right).z.abs())
    }
}

/// At most this many of them, evenly spread, the first and the last among them.
fn evenly(samples: &[Sample], most: usize) -> impl Iterator<Item = &Sample> {
    let count = samples.len().min(most);
    let last = samples.len().saturating_sub(1);
    (0..count).filter_map(move |index| samples.get(index * last / count.saturating_sub(1).max(1)))
}
