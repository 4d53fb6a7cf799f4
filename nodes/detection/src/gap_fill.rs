//! Replaces the beams without a return (Rec-HV 3.2.1.1, 3.3.2.1).

use crate::aperture::Beam;

/// The least and the largest range that a scanner can measure.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct RangeLimits {
    /// `range_min` of the scan.
    pub min_m: f32,
    /// `range_max` of the scan.
    pub max_m: f32,
}

/// The thesis' vector r without inconsistent values.
#[derive(Clone, PartialEq, Debug)]
pub struct FilledRanges {
    /// A finite range for every beam.
    pub ranges_m: Vec<f32>,
    /// Whether the range was filled in rather than measured.
    pub is_filled: Vec<bool>,
}

impl FilledRanges {
    /// How many beams were filled in.
    #[must_use]
    pub fn filled_beams(&self) -> usize {
        self.is_filled.iter().filter(|filled| **filled).count()
    }
}

/// No line can be laid through fewer than two returns.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error(
    "a scan with {returns} returns in the aperture has no line to fill its gaps by; two are needed"
)]
pub struct TooFewReturns {
    /// How many returns there are: 0 or 1.
    pub returns: usize,
}

/// Gives every beam a range: between two returns by the line through them, range over azimuth; at
/// either end of the vector by the line through the two returns nearest to that end (Rec-HV 3.3.2.1;
/// the text's "consecutive" returns are consecutive among the returns, gaps between them or not).
///
/// `beams` are in the order of their azimuths; a beam whose range is `None` is a gap. Not specified by the
/// text:
/// - an extrapolated range is kept within `limits`, since a steep line soon leaves them (and even turns
///   negative);
/// - two returns of one azimuth, as of a scanner that repeats its first beam, give the level line at
///   their mean;
/// - a filled range counts as a range in all that follows, as published. A beam that is filled in one
///   scan and measured in the next therefore varies although nothing has moved: `is_filled` is for
///   methods that exclude such beams.
///
/// # Errors
/// With fewer than two returns.
pub fn fill_gaps(beams: &[Beam], limits: RangeLimits) -> Result<FilledRanges, TooFewReturns> {
    let returns: Vec<(usize, Return)> = beams
        .iter()
        .enumerate()
        .filter_map(|(index, beam)| {
            let range_m = f64::from(beam.range_m?);
            Some((index, Return { azimuth_rad: beam.azimuth_rad, range_m }))
        })
        .collect();
    let ([first, second, ..], [.., last_but_one, last]) = (&*returns, &*returns) else {
        return Err(TooFewReturns { returns: returns.len() });
    };

    let mut ranges_m: Vec<f32> =
        beams.iter().map(|beam| beam.range_m.unwrap_or(limits.max_m)).collect();
    let within_limits = |range_m: f32| range_m.max(limits.min_m).min(limits.max_m);

    let start = Line::through(first.1, second.1);
    for index in 0..first.0 {
        ranges_m[index] = within_limits(start.range_m(beams[index].azimuth_rad));
    }
    for pair in returns.windows(2) {
        let line = Line::through(pair[0].1, pair[1].1);
        for index in pair[0].0 + 1..pair[1].0 {
            ranges_m[index] = line.range_m(beams[index].azimuth_rad);
        }
    }
    let end = Line::through(last.1, last_but_one.1);
    for index in last.0 + 1..beams.len() {
        ranges_m[index] = within_limits(end.range_m(beams[index].azimuth_rad));
    }

    let is_filled = beams.iter().map(|beam| beam.range_m.is_none()).collect();
    Ok(FilledRanges { ranges_m, is_filled })
}

#[derive(Clone, Copy)]
struct Return {
    azimuth_rad: f64,
    range_m: f64,
}

/// The trend of the range over the azimuth.
struct Line {
    anchor: Return,
    slope_m_per_rad: f64,
}

impl Line {
    fn through(anchor: Return, other: Return) -> Self {
        let slope = (other.range_m - anchor.range_m) / (other.azimuth_rad - anchor.azimuth_rad);
        if slope.is_finite() {
            Self { anchor, slope_m_per_rad: slope }
        } else {
            let range_m = f64::midpoint(anchor.range_m, other.range_m);
            Self { anchor: Return { range_m, ..anchor }, slope_m_per_rad: 0.0 }
        }
    }

    fn range_m(&self, azimuth_rad: f64) -> f32 {
        let along_rad = azimuth_rad - self.anchor.azimuth_rad;
        // The cast saturates at the largest f32 instead of leaving the finite numbers.
        let range_m = self.anchor.range_m + along_rad * self.slope_m_per_rad;
        range_m.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
    }
}

#[cfg(test)]
mod tests;
