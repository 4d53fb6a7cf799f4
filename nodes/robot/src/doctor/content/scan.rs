//! The content of scans of a 2D scanner.

use std::f64::consts::TAU;

use estimation::quantile::upper_median;
use msgs::sensor_msgs::LaserScan;

use super::{Check, Finding, Subject, Typical};

/// No 2D scanner of a robot sees this far: the longest reach 80 m (SICK LMS5xx).
pub(crate) const FARTHEST_M: f64 = 200.0;
/// No scanner states to reach farther.
const FARTHEST_STATED_M: f64 = 1000.0;
/// Scans go round once; beyond this the angles are in degrees.
const MOST_SPAN_RAD: f64 = 1.1 * TAU;
/// A scanner with returns on less than this share of its beams is covered, or sees nothing in its range.
const LEAST_SHARE: f64 = 0.02;
/// A turn takes no longer than so many times the time between scans.
const MOST_PERIODS: f64 = 2.0;

/// What is known of scans.
#[derive(Clone, PartialEq, Debug, Default)]
pub(in crate::doctor) struct ScanFacts {
    scans: u64,
    beams: u64,
    /// Beams with a finite range above 0.
    returned: u64,
    /// Beams with a range within the stated limits.
    within: u64,
    /// The median range of each scan.
    range_m: Typical,
    range_max_m: Typical,
    /// From the first beam to the last, by the increment.
    span_rad: Typical,
    /// The time that the beams of a scan take.
    turn_s: Typical,
}

impl ScanFacts {
    pub(super) fn take(&mut self, scan: &LaserScan) {
        self.scans += 1;
        self.beams += scan.ranges.len() as u64;
        let mut returned: Vec<f64> = scan
            .ranges
            .iter()
            .map(|range| f64::from(*range))
            .filter(|range| range.is_finite() && *range > 0.0)
            .collect();
        let limits = f64::from(scan.range_min)..=f64::from(scan.range_max);
        self.returned += returned.len() as u64;
        self.within += returned.iter().filter(|range| limits.contains(range)).count() as u64;
        if let Some(range_m) = upper_median(&mut returned) {
            self.range_m.add(range_m);
        }
        self.range_max_m.add(f64::from(scan.range_max));
        let increments = scan.ranges.len().saturating_sub(1) as f64;
        self.span_rad.add(increments * f64::from(scan.angle_increment).abs());
        self.turn_s.add(increments * f64::from(scan.time_increment));
    }

    pub(super) fn findings(&self, subject: &Subject<'_>) -> Vec<Finding> {
        let units = self.units(subject);
        let returns = if units.is_empty() { self.returns(subject) } else { None };
        units.into_iter().chain(returns).collect()
    }

    fn units(&self, subject: &Subject<'_>) -> Vec<Finding> {
        let topic = subject.topic;
        let mut findings = Vec::new();
        let range_m = self.range_m.median();
        if let Some(range_m) = range_m.filter(|range_m| *range_m > FARTHEST_M) {
            findings.push(subject.grave(
                Check::Units,
                format!(
                    "{topic}: the median range is {range_m:.0} m, which is {:.2} m if they are millimetres",
                    range_m * 1e-3
                ),
                "LaserScan has metres (REP-103): divide by 1000 in the driver, range_min and range_max too",
            ));
        } else if let Some(max_m) = self.range_max_m.median()
            && max_m > FARTHEST_STATED_M
            && max_m.is_finite()
        {
            findings.push(Finding::warn(
                Check::Units,
                format!(
                    "{topic}: range_max is {max_m:.0} m, and the median range {:.2} m",
                    range_m.unwrap_or_default()
                ),
                "LaserScan has metres (REP-103), also in range_min and range_max",
            ));
        }
        if let Some(span_rad) = self.span_rad.median()
            && span_rad > MOST_SPAN_RAD
        {
            findings.push(subject.grave(
                Check::Units,
                format!(
                    "{topic}: the beams span {span_rad:.1} rad, more than a turn; if they are degrees, {:.1} rad",
                    span_rad.to_radians()
                ),
                "LaserScan has radians (REP-103): convert angle_min, angle_max and angle_increment in the driver",
            ));
        }
        if let (Some(turn_s), Some(period_s)) = (self.turn_s.median(), subject.period_s)
            && period_s > 0.0
            && turn_s > MOST_PERIODS * period_s
        {
            findings.push(Finding::warn(
                Check::Units,
                format!(
                    "{topic}: by time_increment a turn takes {turn_s:.3} s, and scans come every {period_s:.3} s"
                ),
                "time_increment is the seconds from a beam to the next: set it in the driver, or leave it 0",
            ));
        }
        findings
    }

    fn returns(&self, subject: &Subject<'_>) -> Option<Finding> {
        let Self { scans, beams, returned, within, .. } = self;
        let topic = subject.topic;
        if *beams == 0 || *within as f64 >= LEAST_SHARE * *beams as f64 {
            return None;
        }
        let what = format!(
            "{topic}: {within} of {beams} beams of {scans} scans have a range within the stated limits; {returned} \
             have any"
        );
        let fix = if *returned > *within {
            "set range_min and range_max in the driver to what the scanner measures, in metres"
        } else {
            "uncover the scanner; see that it turns, and that its type and baud rate are set right in the driver"
        };
        Some(Finding::grave_if(*within == 0 && subject.is_read, Check::Returns, what, fix))
    }
}
