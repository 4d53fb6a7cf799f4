//! From runs of beams to zones, and the zones that are kept when their object is lost from sight.

use std::ops::Range;

use geometry::{DynamicZone, ReturnSpan, ZoneSource};
use nalgebra::{Point2, Point3};

use super::free_space::Verdict;
use super::turn::{Turn, TurnBeam};
use crate::config::DetectionConfig;

/// A zone that was kept is the one that is measured when their depths are no farther apart than this: what
/// a runner does in a cycle of 7 Hz.
const SAME_DEPTH_M: f32 = 0.6;
/// An object that is lost from sight may be found again so far aside for each cycle: the same runner.
pub(super) const FOUND_AGAIN_M: f64 = 0.6;
/// What a return behind a zone must be farther away, beside its own error, to be seen past the object.
const BEHIND_M: f64 = 0.1;

/// The beams of one object.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct MovingBeams {
    /// From its first beam to behind its last one.
    pub(super) beams: Range<usize>,
    /// Whether it is sure to move: its zone is kept when it is lost from sight.
    pub(super) has_travelled: bool,
}

/// What a cycle sees.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight<'a> {
    pub(super) turn: &'a Turn,
    /// What the evidence says of each beam; `None` for one without a return.
    pub(super) verdicts: &'a [Option<Verdict>],
    /// The beams that are looked at.
    pub(super) within: &'a Range<usize>,
    pub(super) platform_moves: bool,
}

/// Makes zones, and remembers those of the last cycles.
#[derive(Clone, Debug)]
pub(super) struct ZoneKeeper {
    half_aperture_rad: f64,
    tolerance_rad: f64,
    max_held_cycles: u32,
    remembered: Vec<Remembered>,
}

/// A zone with its ends in the map, so that it stays where it is when the platform turns.
#[derive(Clone, Debug)]
struct Remembered {
    zone: DynamicZone,
    right_in_map_m: Point3<f64>,
    left_in_map_m: Point3<f64>,
    has_travelled: bool,
    /// In so many cycles it has been measured.
    measured_cycles: u32,
}

impl ZoneKeeper {
    pub(super) fn new(config: &DetectionConfig) -> Self {
        Self {
            half_aperture_rad: 0.5 * config.aperture_rad,
            tolerance_rad: config.zone_tolerance_rad,
            max_held_cycles: config.max_held_cycles,
            remembered: Vec::new(),
        }
    }

    pub(super) fn clear(&mut self) {
        self.remembered.clear();
    }

    /// How far `in_map_m` is from the front of the nearest object of the cycle before.
    pub(super) fn distance_m(&self, in_map_m: &Point2<f64>) -> f64 {
        let distance_m = |old: &Remembered| {
            let (right_m, left_m) = (old.right_in_map_m.xy(), old.left_in_map_m.xy());
            let way_m = left_m - right_m;
            let length_m2 = way_m.norm_squared();
            // The ends of a zone of one beam are one point.
            let share =
                if length_m2 > 0.0 { (in_map_m - right_m).dot(&way_m) / length_m2 } else { 0.0 };
            let nearest_m = right_m + way_m * share.clamp(0.0, 1.0);
            (in_map_m - nearest_m).norm()
        };
        self.remembered.iter().map(distance_m).fold(f64::INFINITY, f64::min)
    }

    /// The zones of a cycle by azimuth: one for each run, with the largest deviation of its beams, and those
    /// of the cycles before that have gone without an explanation. From a platform that moves, a zone is kept no
    /// longer than it was measured: what appears there and is gone was most likely none.
    pub(super) fn zones(
        &mut self,
        sight: &Sight<'_>,
        runs: &[MovingBeams],
        std_dev_m: &[Option<f32>],
    ) -> Vec<DynamicZone> {
        let mut remembered: Vec<Remembered> =
            runs.iter().filter_map(|run| self.measured(sight.turn, run, std_dev_m)).collect();
        let measured = remembered.len();
        let old = std::mem::take(&mut self.remembered);
        for new in &mut remembered {
            let same = old.iter().filter(|old| is_same_place(&old.zone, &new.zone));
            let before = same.map(|old| old.measured_cycles).max().unwrap_or(0);
            new.measured_cycles = before.saturating_add(1);
        }
        for old in old {
            let Some(held) = self.held(old, sight) else { continue };
            let is_retaken = remembered[..measured].iter().any(|new| {
                let is_new = new.measured_cycles == 1;
                is_same_place(&held.zone, &new.zone)
                    || (is_new && is_found_again(&held.zone, &new.zone))
            });
            if !is_retaken {
                remembered.push(held);
            }
        }
        remembered.sort_by(|a, b| a.zone.azimuth_min_rad.total_cmp(&b.zone.azimuth_min_rad));
        self.remembered = remembered;
        self.remembered.iter().map(|remembered| remembered.zone).collect()
    }

    /// The zone of a run. Its bounds are the bearings of the beams beside the run, for the object ends
    /// somewhere before them, and the tolerance.
    fn measured(
        &self,
        turn: &Turn,
        MovingBeams { beams: run, has_travelled }: &MovingBeams,
        std_dev_m: &[Option<f32>],
    ) -> Option<Remembered> {
        let returns = || run.clone().filter_map(|beam| turn.beams[beam].met.as_ref());
        let (first, last) = (returns().next()?, returns().next_back()?);
        let mut span = ReturnSpan { nearest_m: f32::INFINITY, farthest_m: 0.0 };
        let (mut right_rad, mut left_rad) = (f64::INFINITY, f64::NEG_INFINITY);
        for met in returns() {
            let distance_m = met.distance_m() as f32;
            span.nearest_m = span.nearest_m.min(distance_m);
            span.farthest_m = span.farthest_m.max(distance_m);
            let azimuth_rad = azimuth_rad(&met.in_rig_m);
            right_rad = right_rad.min(azimuth_rad);
            left_rad = left_rad.max(azimuth_rad);
        }
        // Beams without a return at the run's ends have no bearing of a return: so many steps.
        let met = |beam: &usize| turn.beams[*beam].met.is_some();
        let blind_right = run.clone().take_while(|beam| !met(beam)).count() as f64;
        let blind_left = run.clone().rev().take_while(|beam| !met(beam)).count() as f64;
        let widening_rad = |blind: f64| (1.0 + blind) * turn.step_rad + self.tolerance_rad;
        let zone = DynamicZone {
            azimuth_min_rad: self.within_aperture(right_rad - widening_rad(blind_right)),
            azimuth_max_rad: self.within_aperture(left_rad + widening_rad(blind_left)),
            peak_std_dev_m: std_dev_m[run.clone()].iter().flatten().copied().fold(0.0, f32::max),
            source: ZoneSource::Measured,
            returns: Some(span),
        };
        let (right_in_map_m, left_in_map_m) =
            (turn.map_from_rig * first.in_rig_m, turn.map_from_rig * last.in_rig_m);
        let has_travelled = *has_travelled;
        Some(Remembered { zone, right_in_map_m, left_in_map_m, has_travelled, measured_cycles: 1 })
    }

    /// A zone of the cycles before, as it is seen now, unless it is over: when it has been kept for long enough, or
    /// when most of its beams see past where it was. From a platform that moves it is over, too, when they meet
    /// background there: that is then what stands there, and not an object lost from sight.
    fn held(&self, old: Remembered, sight: &Sight<'_>) -> Option<Remembered> {
        let Sight { turn, verdicts, within, platform_moves } = *sight;
        let cycles = match old.zone.source {
            ZoneSource::Measured => 1,
            ZoneSource::Held { cycles } => cycles.saturating_add(1),
        };
        let rig_from_map = turn.map_from_rig.inverse();
        let ends = [old.right_in_map_m, old.left_in_map_m].map(|end| rig_from_map * end);
        let [right_rad, left_rad] = ends.map(|end| azimuth_rad(&end));
        let distances_m = ends.map(|end| end.x.hypot(end.y) as f32);
        let span = old.zone.returns?;
        // The depth of the object goes along with the motion of its ends.
        let depth_m = span.farthest_m - span.nearest_m;
        let nearest_m = distances_m[0].min(distances_m[1]).min(span.nearest_m);
        let span = ReturnSpan {
            nearest_m,
            farthest_m: (nearest_m + depth_m).max(distances_m[0]).max(distances_m[1]),
        };
        let most = self.max_held_cycles;
        let longest = if platform_moves { old.measured_cycles.min(most) } else { most };
        if !old.has_travelled || cycles > longest || left_rad < right_rad {
            return None;
        }
        let widening_rad = turn.step_rad + self.tolerance_rad;
        let zone = DynamicZone {
            azimuth_min_rad: self.within_aperture(right_rad - widening_rad),
            azimuth_max_rad: self.within_aperture(left_rad + widening_rad),
            source: ZoneSource::Held { cycles },
            returns: Some(span),
            ..old.zone
        };
        if zone.azimuth_max_rad <= zone.azimuth_min_rad {
            return None;
        }
        let mut beams = 0_usize;
        let mut seen_past = 0_usize;
        let is_past = |beam: &TurnBeam, verdict: Option<Verdict>| {
            beam.met.as_ref().is_some_and(|met| {
                let slack_m = met.error_m + BEHIND_M;
                let is_behind = met.distance_m() > f64::from(span.farthest_m) + slack_m;
                let is_before = met.distance_m() < f64::from(span.nearest_m) - slack_m;
                is_behind || (platform_moves && !is_before && verdict == Some(Verdict::Background))
            })
        };
        for index in within.clone() {
            let beam = &turn.beams[index];
            if beam.azimuth_rad < right_rad || beam.azimuth_rad > left_rad {
                continue;
            }
            beams += 1;
            if is_past(beam, verdicts.get(index).copied().flatten()) {
                seen_past += 1;
            }
        }
        let is_over = beams == 0 || 2 * seen_past >= beams;
        (!is_over).then_some(Remembered { zone, ..old })
    }

    fn within_aperture(&self, azimuth_rad: f64) -> f64 {
        azimuth_rad.max(-self.half_aperture_rad).min(self.half_aperture_rad)
    }
}

/// How far two spans are apart in depth; zones without one are at any depth.
fn depth_gap_m(a: &DynamicZone, b: &DynamicZone) -> f32 {
    match (a.returns, b.returns) {
        (Some(a), Some(b)) => (a.nearest_m - b.farthest_m).max(b.nearest_m - a.farthest_m),
        _ => 0.0,
    }
}

fn is_same_place(a: &DynamicZone, b: &DynamicZone) -> bool {
    a.azimuth_min_rad <= b.azimuth_max_rad
        && b.azimuth_min_rad <= a.azimuth_max_rad
        && depth_gap_m(a, b) <= SAME_DEPTH_M
}

/// Whether a zone that appears is where the object of a held one may have come to: from behind what hid it.
fn is_found_again(held: &DynamicZone, new: &DynamicZone) -> bool {
    let ZoneSource::Held { cycles } = held.source else { return false };
    let gap_rad = (held.azimuth_min_rad - new.azimuth_max_rad)
        .max(new.azimuth_min_rad - held.azimuth_max_rad)
        .max(0.0);
    let distance_m = new.returns.map_or(0.0, |span| f64::from(span.nearest_m));
    depth_gap_m(held, new) <= SAME_DEPTH_M
        && gap_rad * distance_m <= FOUND_AGAIN_M * f64::from(cycles)
}

fn azimuth_rad(point_in_rig: &Point3<f64>) -> f64 {
    point_in_rig.y.atan2(point_in_rig.x)
}

#[cfg(test)]
mod tests;
