//! Finds the dynamic zone in the deviations of the beams (Rec-HV 3.2.2, 3.3.2.2, eq. 5).

mod runs;

use geometry::{DynamicZone, ZoneSource};

use crate::config::{DetectionConfig, RunBound};
use runs::{Run, high_variability_runs, largest_two};

/// A single run bounds a zone by its own ends only if two of its beams are not adjacent.
const MIN_BEAMS_OF_A_LONE_RUN: usize = 3;

/// Why a cycle has no measured zone.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum Unmeasured {
    /// The scan could not be filled, so that it has no deviations.
    #[error("the scan has {returns} returns in the aperture, and two are needed")]
    TooFewReturns {
        /// How many returns there are.
        returns: usize,
    },
    /// The window is not full yet.
    #[error("the window holds {scans} scans of {window_scans}")]
    WindowFilling {
        /// Scans in the window.
        scans: usize,
        /// n.
        window_scans: usize,
    },
    /// Nothing moves.
    #[error("the largest deviation is {max_std_dev_m} m, not above {min_std_dev_m} m")]
    Quiet {
        /// The largest deviation of the cycle.
        max_std_dev_m: f32,
        /// What it had to exceed.
        min_std_dev_m: f32,
    },
    /// No object is in observed free space (the method `free_space`).
    #[error("none of the {returns} returns is an object in space seen free")]
    NothingInFreeSpace {
        /// Returns in the aperture.
        returns: usize,
    },
    /// The beams of high variability are one, or two side by side: they bound nothing.
    #[error("the {beams} beams of high variability lie side by side and bound nothing")]
    Unbounded {
        /// How many beams there are.
        beams: usize,
    },
}

/// The result of one cycle's deviations.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ZoneSearch {
    /// The zone, measured or held.
    pub zone: Option<DynamicZone>,
    /// Why it was not measured, if it was not.
    pub unmeasured: Option<Unmeasured>,
    /// The largest deviation, if there are deviations.
    pub max_std_dev_m: Option<f32>,
    /// Beams of high variability.
    pub high_variability_beams: usize,
}

/// Finds the dynamic zone of each cycle, and remembers the last one.
#[derive(Clone, Debug)]
pub struct ZoneFinder {
    half_aperture_rad: f64,
    min_std_dev_m: f32,
    high_variability_share: f32,
    run_bound: RunBound,
    tolerance_rad: f64,
    max_held_cycles: u32,
    previous: Option<DynamicZone>,
}

impl ZoneFinder {
    /// A finder without a previous zone; `config` has been validated.
    #[must_use]
    pub fn new(config: &DetectionConfig) -> Self {
        Self {
            half_aperture_rad: 0.5 * config.aperture_rad,
            min_std_dev_m: config.min_std_dev_m as f32,
            high_variability_share: config.rec_hv.high_variability_share as f32,
            run_bound: config.rec_hv.run_bound,
            tolerance_rad: config.zone_tolerance_rad,
            max_held_cycles: config.max_held_cycles,
            previous: None,
        }
    }

    /// Forgets the previous zone.
    pub fn clear(&mut self) {
        self.previous = None;
    }

    /// The zone of a cycle whose beams at `azimuths_rad` (ascending) have the deviations `std_dev_m`, one
    /// each.
    ///
    /// 1. Only if the largest deviation exceeds the minimum is anything moving.
    /// 2. A beam is of high variability above half of the largest deviation. Consecutive ones make a
    ///    run, which collapses to its largest.
    /// 3. The two runs with the largest deviations bound the zone. Runs between them divide it into
    ///    several candidates: the one nearest to the previous zone is taken; without a previous zone
    ///    the one that the longest run bounds.
    /// 4. The zone is widened by the tolerance at each side.
    /// 5. If nothing was found, the previous zone is held: see [`ZoneFinder::hold`].
    ///
    /// Not specified by the text:
    /// - One run alone, of three beams or more, bounds the zone by its own ends: it has two beams
    ///   that are not adjacent, and an object that moves by more than its own
    ///   width in a window, or that is just becoming visible, has one run.
    /// - Of equal peaks the outer one bounds, of equally near candidates the one with the larger
    ///   deviations, then the right-hand one.
    /// - Only the cycle's largest deviation must exceed the minimum. A candidate near the previous zone may
    ///   have smaller ones, as long as they are above half of the largest.
    /// - No zone leaves the aperture.
    pub fn find(&mut self, azimuths_rad: &[f64], std_dev_m: &[f32]) -> ZoneSearch {
        let beams = azimuths_rad.len().min(std_dev_m.len());
        let (azimuths_rad, std_dev_m) = (&azimuths_rad[..beams], &std_dev_m[..beams]);
        let max_std_dev_m = std_dev_m.iter().copied().fold(0.0, f32::max);
        if max_std_dev_m <= self.min_std_dev_m {
            let min_std_dev_m = self.min_std_dev_m;
            let quiet = Unmeasured::Quiet { max_std_dev_m, min_std_dev_m };
            return ZoneSearch { max_std_dev_m: Some(max_std_dev_m), ..self.hold(quiet, 0.0) };
        }

        let runs = high_variability_runs(std_dev_m, self.high_variability_share * max_std_dev_m);
        let high_variability_beams = runs.iter().map(Run::beams).sum();
        let bounds = match &*runs {
            [lone] if lone.beams() < MIN_BEAMS_OF_A_LONE_RUN => None,
            [lone] => Some((lone.first, lone.last)),
            runs => self.bounds_between(runs, azimuths_rad),
        };
        let found = bounds.map(|(right, left)| DynamicZone {
            azimuth_min_rad: self.within_aperture(azimuths_rad[right] - self.tolerance_rad),
            azimuth_max_rad: self.within_aperture(azimuths_rad[left] + self.tolerance_rad),
            peak_std_dev_m: std_dev_m[right..=left].iter().copied().fold(0.0, f32::max),
            source: ZoneSource::Measured,
            returns: None,
        });
        let search = if found.is_some() {
            self.previous = found;
            ZoneSearch {
                zone: found,
                unmeasured: None,
                max_std_dev_m: None,
                high_variability_beams,
            }
        } else {
            let longest = runs.iter().map(Run::beams).max().unwrap_or(0);
            let widening_rad = longest as f64 * spacing_rad(azimuths_rad);
            self.hold(Unmeasured::Unbounded { beams: high_variability_beams }, widening_rad)
        };
        ZoneSearch { max_std_dev_m: Some(max_std_dev_m), high_variability_beams, ..search }
    }

    /// The search of a cycle in which no zone was measured, because of `why`: the previous zone, widened
    /// by `widening_rad`, the width of this cycle's largest run, at each side, for as long as that is
    /// plausible. Without a run nothing has moved, and the zone keeps its width.
    ///
    /// Plausible means: measured at most `max_held_cycles` cycles ago, and within the aperture, to which
    /// the zone is cut. A scan without deviations holds the zone too, since it does not show that the
    /// object has left.
    pub fn hold(&mut self, why: Unmeasured, widening_rad: f64) -> ZoneSearch {
        self.previous = self.previous.and_then(|previous| {
            let cycles = match previous.source {
                ZoneSource::Measured => 1,
                ZoneSource::Held { cycles } => cycles.saturating_add(1),
            };
            (cycles <= self.max_held_cycles).then(|| DynamicZone {
                azimuth_min_rad: self.within_aperture(previous.azimuth_min_rad - widening_rad),
                azimuth_max_rad: self.within_aperture(previous.azimuth_max_rad + widening_rad),
                peak_std_dev_m: previous.peak_std_dev_m,
                source: ZoneSource::Held { cycles },
                returns: None,
            })
        });
        ZoneSearch {
            zone: self.previous,
            unmeasured: Some(why),
            max_std_dev_m: None,
            high_variability_beams: 0,
        }
    }

    /// The indices of the beams that bound the zone among two runs or more.
    fn bounds_between(&self, runs: &[Run], azimuths_rad: &[f64]) -> Option<(usize, usize)> {
        let (right, left) = largest_two(runs)?;
        let candidates = runs.get(right..=left)?.windows(2);
        let bounds = |pair: &[Run]| match self.run_bound {
            RunBound::Peak => (pair[0].first_peak, pair[1].last_peak),
            RunBound::OuterEnd => (pair[0].first, pair[1].last),
        };
        let distance_rad = |pair: &[Run]| match self.previous {
            Some(previous) => {
                let (right, left) = bounds(pair);
                let middle_rad = f64::midpoint(azimuths_rad[right], azimuths_rad[left]);
                (middle_rad - previous.middle_rad()).abs()
            }
            None => 0.0,
        };
        let longest_run = |pair: &[Run]| match self.previous {
            Some(_) => 0,
            None => pair[0].beams().max(pair[1].beams()),
        };
        let deviation_m = |pair: &[Run]| pair[0].peak_m + pair[1].peak_m;
        candidates
            // `min_by` keeps the first of equals: the right-hand one.
            .min_by(|a, b| {
                distance_rad(a)
                    .total_cmp(&distance_rad(b))
                    .then_with(|| longest_run(b).cmp(&longest_run(a)))
                    .then_with(|| deviation_m(b).total_cmp(&deviation_m(a)))
            })
            .map(bounds)
    }

    fn within_aperture(&self, azimuth_rad: f64) -> f64 {
        azimuth_rad.max(-self.half_aperture_rad).min(self.half_aperture_rad)
    }
}

/// The mean angle from a beam to the next.
fn spacing_rad(azimuths_rad: &[f64]) -> f64 {
    match azimuths_rad {
        [first, .., last] => (last - first) / (azimuths_rad.len() - 1) as f64,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests;
