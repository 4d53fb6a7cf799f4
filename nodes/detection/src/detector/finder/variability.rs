//! The method `rec_hv`: zones of high variability (Rec-HV 3.2.1.1 to 3.2.2).

use geometry::Scan;

use super::super::cycle::Step;
use super::super::found::Found;
use crate::aperture::Beam;
use crate::config::DetectionConfig;
use crate::gap_fill::{FilledRanges, RangeLimits, TooFewReturns, fill_gaps};
use crate::variability::VariabilityWindow;
use crate::zone_finder::{Unmeasured, ZoneFinder, ZoneSearch};

/// Finds the zone by the variability of the ranges over a window of scans.
#[derive(Clone, Debug)]
pub(in crate::detector) struct VariabilityFinder {
    window_scans: usize,
    window: VariabilityWindow,
    zones: ZoneFinder,
}

impl VariabilityFinder {
    pub(super) fn new(config: &DetectionConfig) -> Self {
        Self {
            window_scans: config.window_scans,
            window: VariabilityWindow::new(config.window_scans),
            zones: ZoneFinder::new(config),
        }
    }

    pub(super) fn find(
        &mut self,
        scan: &Scan,
        beams: &[Beam],
        observe: &mut impl FnMut(Step),
    ) -> Found {
        // 3.2.1.1: a range for each of the beams.
        let limits = RangeLimits { min_m: scan.range_min_m, max_m: scan.range_max_m };
        let filled = fill_gaps(beams, limits);
        let filled_beams = filled.as_ref().map_or(0, FilledRanges::filled_beams);
        observe(Step::GapFill);

        // 3.2.1.2, eq. 2 and 3: mean and deviation of each beam over the window.
        let deviations = self.deviations(filled);
        observe(Step::Variability);

        // 3.2.2, eq. 5: the angles between which something moves.
        let search = self.zone(beams, deviations);
        observe(Step::ZoneSearch);
        let unknown_beams = beams.iter().filter(|beam| beam.range_m.is_none()).count();
        Found::by_variability(search, filled_beams, unknown_beams)
    }

    pub(super) fn clear_window(&mut self) {
        self.window.clear();
    }

    pub(super) fn clear(&mut self) {
        self.window.clear();
        self.zones.clear();
    }

    fn deviations(
        &mut self,
        filled: Result<FilledRanges, TooFewReturns>,
    ) -> Result<Vec<f32>, Unmeasured> {
        let filled =
            filled.map_err(|TooFewReturns { returns }| Unmeasured::TooFewReturns { returns })?;
        self.window.push(filled.ranges_m);
        let statistics = self.window.statistics().ok_or(Unmeasured::WindowFilling {
            scans: self.window.len(),
            window_scans: self.window_scans,
        })?;
        Ok(statistics.std_dev_m)
    }

    fn zone(&mut self, beams: &[Beam], deviations: Result<Vec<f32>, Unmeasured>) -> ZoneSearch {
        match deviations {
            Ok(std_dev_m) => {
                let azimuths_rad: Vec<f64> = beams.iter().map(|beam| beam.azimuth_rad).collect();
                self.zones.find(&azimuths_rad, &std_dev_m)
            }
            // Nothing says of a motion that it would widen the zone.
            Err(why) => self.zones.hold(why, 0.0),
        }
    }
}
