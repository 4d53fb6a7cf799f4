//! Where the map's plane was observed free, and where background was observed. [`volume::Cell`] has the rules for the evidence
//! on a cell: once a cycle, decay, age, objects that stopped. This module has those for a return among cells.

mod grid;

use nalgebra::Point2;
use volume::{Cell, SAMPLES_PER_CELL, WIDEST_GAP_M};

use super::clearance::clear_distances_m;
use super::deskewed_scan::{DeskewedBeam, DeskewedScan, Return};
use crate::config::FreeSpaceConfig;
use grid::RollingGrid;

/// Above this rate a place is background, or may be: one return near it in five observations.
const MAX_BACKGROUND_RATE: f64 = 0.2;
/// Above this rate it is more likely background than free.
const BACKGROUND_RATE: f64 = 0.5;
/// The prior: half an observation of each kind (Krichevsky and Trofimov).
const PRIOR: f64 = 0.5;
/// The error of a return is looked for over at most so many cells: it bounds the computing time.
const MOST_CELLS_AROUND: f64 = 64.0;

/// The class of a return by the evidence.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum ReturnClass {
    /// It is in observed free space.
    InFreeSpace {
        /// How probable a return of the background is here.
        background_rate: f64,
    },
    /// Its place was neither certainly observed as free, nor was background observed near it.
    Unknown,
    /// The evidence does not decide.
    Ambiguous,
    /// It is where background was seen.
    Background,
}

/// The label of a return for the update of the evidence.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum ReturnLabel {
    /// Static.
    Background,
    /// Static or moving: it does not update the evidence.
    Undecided,
    /// A moving object.
    Moving,
}

/// The evidence of free space around the platform.
#[derive(Clone, Debug)]
pub(super) struct EvidenceGrid {
    grid: RollingGrid,
    reach_m: f64,
    stopped_ms: u32,
}

impl EvidenceGrid {
    /// An empty grid.
    pub(super) fn new(config: &FreeSpaceConfig, max_stop_s: f64) -> Self {
        Self {
            grid: RollingGrid::new(
                config.evidence_cell_m,
                config.evidence_cells_a_side(),
                (config.evidence_memory_s * 1e3) as u32,
            ),
            reach_m: config.evidence_reach_m,
            stopped_ms: (max_stop_s * 1e3) as u32,
        }
    }

    /// Forgets everything.
    pub(super) fn clear(&mut self) {
        self.grid.clear();
    }

    /// Moves the window with the platform.
    pub(super) fn center_on(&mut self, origin_m: &Point2<f64>) {
        self.grid.center_on(origin_m);
    }

    /// The class of a return by the evidence before this cycle.
    ///
    /// For a return in free space its own cell must have been certainly free in several cycles, and no background may have
    /// been observed within the return's error: the rate of static returns there, estimated from all counts
    /// (returns on a thin surface fall in several cells), must be small. The passes need no further margin: they were
    /// counted with one.
    pub(super) fn classify(&self, hit: &Return, now_ms: u32) -> ReturnClass {
        if f64::from(hit.range_m) > self.reach_m {
            return ReturnClass::Ambiguous;
        }
        let key = self.grid.key_of(&hit.in_map_m);
        let center = self.grid.cell_at_height(key, hit.height_m, now_ms);
        let radius_m = hit.error_m + 0.5 * self.grid.edge_m();
        let hits = self.hits_around(&hit.in_map_m, radius_m, now_ms).sum();
        let background_rate = background_rate(hits, center.passes());
        if center.was_passed() && background_rate <= MAX_BACKGROUND_RATE {
            ReturnClass::InFreeSpace { background_rate }
        } else if hits == 0 {
            ReturnClass::Unknown
        } else if background_rate > BACKGROUND_RATE {
            ReturnClass::Background
        } else {
            ReturnClass::Ambiguous
        }
    }

    /// Whether background was observed within `radius_m` of a place: at least one counted return.
    pub(super) fn has_background_near(
        &self,
        place_m: &Point2<f64>,
        radius_m: f64,
        now_ms: u32,
    ) -> bool {
        self.hits_around(place_m, radius_m, now_ms).any(|hits| hits > 0)
    }

    /// The range along a beam of the first place behind its return that is background, to half a cell; `None` where none is
    /// known within the reach of the evidence.
    pub(super) fn background_behind_m(
        &self,
        beam: &DeskewedBeam,
        hit: &Return,
        now_ms: u32,
    ) -> Option<f32> {
        let step_m = SAMPLES_PER_CELL * self.grid.edge_m();
        // The object itself may have been background for a while.
        let first_m = f64::from(hit.range_m) + hit.error_m + self.grid.edge_m();
        let samples = ((self.reach_m - first_m) / step_m).max(0.0) as u32;
        let is_background = |range_m: &f64| {
            let key = self.grid.key_of(&(beam.origin_m + beam.direction * *range_m));
            let cell = self.grid.cell(key, now_ms);
            let hits = u32::from(cell.hits());
            hits > 0 && background_rate(hits, cell.passes()) > BACKGROUND_RATE
        };
        let mut ranges_m = (0..samples).map(|sample| first_m + f64::from(sample) * step_m);
        ranges_m.find(is_background).map(|range_m| range_m as f32)
    }

    /// Whether all background within the error of a return was first observed in the last `memory_ms`.
    pub(super) fn is_new_background(&self, hit: &Return, memory_ms: u32, now_ms: u32) -> bool {
        let radius_m = hit.error_m + 0.5 * self.grid.edge_m();
        self.cells_around(&hit.in_map_m, radius_m, now_ms)
            .filter(|cell| cell.hits() > 0)
            .all(|cell| now_ms.saturating_sub(cell.occupied_since()) <= memory_ms)
    }

    /// The hits of the cells around a place.
    fn hits_around(
        &self,
        place_m: &Point2<f64>,
        radius_m: f64,
        now_ms: u32,
    ) -> impl Iterator<Item = u32> {
        self.cells_around(place_m, radius_m, now_ms).map(|cell| u32::from(cell.hits()))
    }

    fn cells_around(
        &self,
        place_m: &Point2<f64>,
        radius_m: f64,
        now_ms: u32,
    ) -> impl Iterator<Item = Cell> {
        let center = self.grid.key_of(place_m);
        let around = (radius_m / self.grid.edge_m()).min(MOST_CELLS_AROUND).floor() as i64;
        (-around..=around)
            .flat_map(move |y| (-around..=around).map(move |x| [x, y]))
            .filter(move |[x, y]| x * x + y * y <= around * around)
            .map(move |[x, y]| self.grid.cell([center[0] + x, center[1] + y], now_ms))
    }

    /// Adds a scan; `labels` has the label of each beam's return.
    pub(super) fn integrate(&mut self, scan: &DeskewedScan, labels: &[ReturnLabel], now_ms: u32) {
        self.take_hits(scan, labels, now_ms);
        self.take_passes(scan, now_ms);
    }

    fn take_hits(&mut self, scan: &DeskewedScan, labels: &[ReturnLabel], now_ms: u32) {
        for (index, beam) in scan.beams.iter().enumerate() {
            let Some(hit) = &beam.hit else { continue };
            if let Some(cell) = self.grid.cell_mut(&hit.place_m(), now_ms) {
                match labels[index] {
                    ReturnLabel::Moving => {
                        let since_ms = cell.hold_moving(now_ms);
                        if now_ms.saturating_sub(since_ms) >= self.stopped_ms {
                            cell.take_for_occupied(since_ms, now_ms);
                        }
                    }
                    ReturnLabel::Background => cell.hit(now_ms),
                    ReturnLabel::Undecided => {}
                }
            }
        }
    }

    /// The space between each beam and the next, as far as both show it free.
    fn take_passes(&mut self, scan: &DeskewedScan, now_ms: u32) {
        // A cell is free if its centre is, and half of its diagonal around it.
        let margin_m = std::f64::consts::FRAC_1_SQRT_2 * self.grid.edge_m();
        let clear_m = clear_distances_m(scan, margin_m, self.reach_m);
        for (index, beam) in scan.beams.iter().enumerate() {
            if let Some(next) = scan.next(index) {
                let far_m = clear_m[index].min(clear_m[next]);
                self.pass_between(beam, &scan.beams[next], far_m, now_ms);
            }
        }
    }

    fn pass_between(&mut self, right: &DeskewedBeam, left: &DeskewedBeam, far_m: f64, now_ms: u32) {
        let sample_m = SAMPLES_PER_CELL * self.grid.edge_m();
        let spread = (left.direction - right.direction).norm();
        let far_m = far_m.min(WIDEST_GAP_M / spread);
        for ring in 0..(far_m / sample_m) as u32 {
            let along_m = f64::from(ring) * sample_m;
            let from_m = right.at_m(along_m);
            let offset_m = left.at_m(along_m) - from_m;
            let samples = (spread * along_m / sample_m).ceil().max(1.0);
            for sample in 0..samples as u32 {
                let point_m = from_m + offset_m * (f64::from(sample) / samples);
                if let Some(cell) = self.grid.cell_mut(&point_m, now_ms) {
                    cell.pass(now_ms);
                }
            }
        }
    }
}

/// The probability that a return here is background.
fn background_rate(hits: u32, passes: u8) -> f64 {
    let (hits, passes) = (f64::from(hits), f64::from(passes));
    (hits + PRIOR) / (hits + passes + 2.0 * PRIOR)
}

#[cfg(test)]
mod tests;
