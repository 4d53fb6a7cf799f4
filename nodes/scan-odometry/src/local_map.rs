//! The lines that the scans have left: where they are, how well that is known, when they were last seen.

mod cells;

use nalgebra::{Isometry2, Point2, UnitComplex, Vector2};

use crate::ScanOdometryConfig;
use crate::local_line::LocalLine;
use cells::Cells;

/// Edge of the cells in which lines are looked for. A search of one cell around covers at least this distance.
pub(crate) const CELL_M: f64 = 0.25;
/// A line seen in this many scans is where it is: it no longer moves, and holds the pose without drift.
const SETTLED_SCANS: u32 = 30;
/// A line seen in this many scans is a real surface and not chance.
const PROVEN_SCANS: u32 = 3;
/// A line that has not been proven is forgotten when it has not been seen for this many scans.
const UNPROVEN_FOR_SCANS: u64 = 10;
/// The distance that a line may have moved while it was seen only once: a person walks 1 m/s, over a tenth of a second. What has been
/// seen longer moves less: this over the number of scans.
const FRESH_STD_DEV_M: f64 = 0.1;
/// Two normals closer than 60 degrees may be of one surface: those of round things differ by this much from scan to scan.
const ALIKE_COSINE: f64 = 0.5;
/// A line is seen from its front; 3 degrees from behind are within what its normal is known to.
const FROM_BEHIND_COSINE: f64 = 0.05;
/// Returns farther beyond the end of a line than this do not belong to it.
const BEYOND_END_M: f64 = 0.05;

/// A line of the map, in the odom frame.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct MapLine {
    pub(crate) position_m: Point2<f64>,
    /// Of length 1, towards where it was seen from.
    pub(crate) normal: Vector2<f64>,
    half_length_m: f64,
    offset_variance_m2: f64,
    pub(crate) normal_variance_rad2: f64,
    /// In how many scans it was seen.
    scans: u32,
    /// Number of the scan that left it.
    pub(crate) born: u64,
    seen: Moment,
}

impl MapLine {
    fn new(line: &LocalLine, odom_from_middle: &Isometry2<f64>, now: Moment) -> Self {
        Self {
            position_m: odom_from_middle * line.position_m,
            normal: odom_from_middle.rotation * line.normal,
            half_length_m: line.half_length_m,
            offset_variance_m2: line.offset_variance_m2,
            normal_variance_rad2: line.normal_variance_rad2,
            scans: 1,
            born: now.scan,
            seen: now,
        }
    }

    /// The variance of its offset at a place along it, if it is static.
    pub(crate) fn standing_variance_m2(&self, along_m: f64) -> f64 {
        self.offset_variance_m2 + self.normal_variance_rad2 * along_m * along_m
    }

    /// The same, when it may have moved since it was seen first.
    pub(crate) fn variance_m2(&self, along_m: f64) -> f64 {
        let fresh_m = FRESH_STD_DEV_M / f64::from(self.scans);
        self.standing_variance_m2(along_m) + fresh_m * fresh_m
    }

    /// Takes in what a scan's returns on it say, as a Kalman filter of offset and angle.
    fn refine(&mut self, seen: &Gathered, now: Moment) {
        self.seen = now;
        if self.scans >= SETTLED_SCANS || seen.weight <= 0.0 {
            return;
        }
        self.scans += 1;
        let (mean_m, mean_along_m) = (seen.residual / seen.weight, seen.along / seen.weight);
        let gain = self.offset_variance_m2 / (self.offset_variance_m2 + 1.0 / seen.weight);
        self.position_m += gain * mean_m * self.normal;
        self.offset_variance_m2 *= 1.0 - gain;
        let spread = seen.along_along - seen.weight * mean_along_m * mean_along_m;
        if spread > 0.0 {
            let slope = (seen.along_residual - seen.weight * mean_along_m * mean_m) / spread;
            let gain = self.normal_variance_rad2 / (self.normal_variance_rad2 + 1.0 / spread);
            // A residual that rises along the tangent turns the normal back.
            self.normal = UnitComplex::new(-gain * slope) * self.normal;
            self.normal_variance_rad2 *= 1.0 - gain;
        }
    }
}

/// A return on a line of the map.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Meeting {
    /// Index of the line.
    pub(crate) line: usize,
    /// How far the return lies in front of the line.
    pub(crate) residual_m: f64,
    /// How far along the line, from its position to the left of the normal.
    pub(crate) along_m: f64,
}

/// When a line was seen.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Moment {
    /// Number of the scan.
    pub(crate) scan: u64,
    /// How far the platform had gone.
    pub(crate) travelled_m: f64,
}

/// Weighted sums over the returns of a scan on one line.
#[derive(Clone, Copy, Default)]
struct Gathered {
    weight: f64,
    residual: f64,
    along: f64,
    along_along: f64,
    along_residual: f64,
}

/// The lines around the platform.
#[derive(Clone, Debug)]
pub(crate) struct LocalMap {
    lines: Vec<MapLine>,
    cells: Cells,
    reach_m: f64,
    spacing_m: f64,
    max_lines: usize,
    memory_distance_m: f64,
}

impl LocalMap {
    pub(crate) fn new(config: &ScanOdometryConfig) -> Self {
        Self {
            lines: Vec::new(),
            cells: Cells::new(config.reach_m),
            reach_m: config.reach_m,
            spacing_m: config.line_spacing_m,
            max_lines: config.max_lines,
            memory_distance_m: config.memory_distance_m,
        }
    }

    pub(crate) fn lines(&self) -> &[MapLine] {
        &self.lines
    }

    pub(crate) fn clear(&mut self) {
        self.lines.clear();
        self.cells.fill(&Point2::origin(), &self.lines);
    }

    /// The line next to a return, among those within `radius_m` that face the beam and, where the return has a
    /// normal of its own, that face as it does. `ring` cells around the return's own are searched.
    pub(crate) fn nearest(
        &self,
        point_m: &Point2<f64>,
        direction: &Vector2<f64>,
        own_normal: Option<&Vector2<f64>>,
        ring: usize,
        radius_m: f64,
    ) -> Option<Meeting> {
        let mut best = None;
        let mut best_m2 = radius_m * radius_m;
        for row in self.cells.rows_around(point_m, ring) {
            for &index in row {
                let line = &self.lines[index as usize];
                let offset = point_m - line.position_m;
                let far_m2 = offset.norm_squared();
                if far_m2 >= best_m2 || line.normal.dot(direction) > FROM_BEHIND_COSINE {
                    continue;
                }
                if own_normal.is_some_and(|normal| normal.dot(&line.normal) < ALIKE_COSINE) {
                    continue;
                }
                let along_m = line.normal.perp(&offset);
                if along_m.abs() > line.half_length_m + BEYOND_END_M {
                    continue;
                }
                best_m2 = far_m2;
                let residual_m = line.normal.dot(&offset);
                best = Some(Meeting { line: index as usize, residual_m, along_m });
            }
        }
        best
    }

    /// Adds a scan: refines the lines that were matched, each match with the inverse of its variance, and adds
    /// those lines of the scan that `matched` has nothing for. Then drops lines that are far, old or too many.
    pub(crate) fn take_in(
        &mut self,
        matched: &[Option<(Meeting, f64)>],
        lines: &[Option<LocalLine>],
        odom_from_middle: &Isometry2<f64>,
        now: Moment,
    ) {
        let mut gathered: Vec<Option<Gathered>> = vec![None; self.lines.len()];
        for (meeting, weight) in matched.iter().flatten() {
            let Meeting { residual_m, along_m, .. } = *meeting;
            let sums = gathered[meeting.line].get_or_insert_default();
            sums.weight += weight;
            sums.residual += weight * residual_m;
            sums.along += weight * along_m;
            sums.along_along += weight * along_m * along_m;
            sums.along_residual += weight * along_m * residual_m;
        }
        for (line, seen) in self.lines.iter_mut().zip(&gathered) {
            if let Some(seen) = seen {
                line.refine(seen, now);
            }
        }
        self.add(matched, lines, odom_from_middle, now);
        self.forget(&odom_from_middle.translation.vector.into(), now);
        self.cells.fill(&odom_from_middle.translation.vector.into(), &self.lines);
    }

    fn add(
        &mut self,
        matched: &[Option<(Meeting, f64)>],
        lines: &[Option<LocalLine>],
        odom_from_middle: &Isometry2<f64>,
        now: Moment,
    ) {
        let mut latest: Option<LocalLine> = None;
        for (line, matched) in lines.iter().zip(matched) {
            let is_covered = matched
                .as_ref()
                .is_some_and(|(meeting, _)| meeting.along_m.abs() <= self.spacing_m);
            let Some(line) = line.filter(|_| !is_covered) else { continue };
            let is_beside_latest = latest.as_ref().is_some_and(|latest| {
                (line.position_m - latest.position_m).norm() < self.spacing_m
                    && line.normal.dot(&latest.normal) > ALIKE_COSINE
            });
            if !is_beside_latest {
                self.lines.push(MapLine::new(&line, odom_from_middle, now));
                latest = Some(line);
            }
        }
    }

    fn forget(&mut self, around_m: &Point2<f64>, now: Moment) {
        let (reach_m, memory_distance_m) = (self.reach_m, self.memory_distance_m);
        self.lines.retain(|line| {
            let is_near = (line.position_m - around_m).amax() < reach_m;
            let is_young = now.travelled_m - line.seen.travelled_m <= memory_distance_m;
            let unseen_for = now.scan.saturating_sub(line.seen.scan);
            is_near && is_young && (line.scans >= PROVEN_SCANS || unseen_for <= UNPROVEN_FOR_SCANS)
        });
        let surplus = self.lines.len().saturating_sub(self.max_lines);
        if surplus > 0 {
            let mut seen: Vec<u64> = self.lines.iter().map(|line| line.seen.scan).collect();
            let (_, &mut oldest, _) = seen.select_nth_unstable(surplus - 1);
            // Of those seen equally long ago the first ones go.
            let mut to_drop = surplus;
            self.lines.retain(|line| {
                let drops = to_drop > 0 && line.seen.scan <= oldest;
                to_drop -= usize::from(drops);
                !drops
            });
        }
    }
}

#[cfg(test)]
mod tests;
