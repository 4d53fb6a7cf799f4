//! The zones of runs of beams, and zones that are held while their object is not visible.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use geometry::{DynamicZone, ReturnSpan, ZoneSource};
use nalgebra::{Point2, Point3};

use super::deskewed_scan::{DeskewedBeam, DeskewedScan, LARGEST_STEP_M};
use super::evidence::ReturnClass;
use super::tracker::TrackedObject;
use crate::config::DetectionConfig;

/// The beams of a moving object.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct MovingBeams {
    /// From its first beam to the one after its last.
    pub(super) beams: Range<usize>,
    /// Its index among the objects of the tracker.
    pub(super) object: Option<usize>,
    /// Whether it certainly moves: its zone is held when it is not visible.
    pub(super) has_travelled: bool,
}

/// The observation of a cycle.
#[derive(Clone, Copy, Debug)]
pub(super) struct CycleView<'a> {
    pub(super) scan: &'a DeskewedScan,
    /// The class of each beam's return; `None` for a beam without one.
    pub(super) classes: &'a [Option<ReturnClass>],
    /// The beams of the aperture.
    pub(super) within: &'a Range<usize>,
    pub(super) platform_moves: bool,
}

/// Makes the zones of objects.
#[derive(Clone, Debug)]
pub(super) struct ZoneMaker {
    half_aperture_rad: f64,
    tolerance_rad: f64,
    max_held_cycles: u32,
}

/// The zone of an object, with its ends in the map frame, so that the motion of the platform does not change it.
#[derive(Clone, Debug)]
pub(super) struct ObjectZone {
    zone: DynamicZone,
    right_in_map_m: Point3<f64>,
    left_in_map_m: Point3<f64>,
    /// The largest error of the object's returns.
    error_m: f64,
    has_travelled: bool,
    /// The number of cycles in which it was measured.
    measured_cycles: u32,
}

impl ObjectZone {
    /// The distance of `in_map_m` from the front of the object.
    pub(super) fn distance_m(&self, in_map_m: &Point2<f64>) -> f64 {
        let (right_m, left_m) = (self.right_in_map_m.xy(), self.left_in_map_m.xy());
        let width_m = left_m - right_m;
        let length_m2 = width_m.norm_squared();
        // The ends of a zone of one beam are one point.
        let share =
            if length_m2 > 0.0 { (in_map_m - right_m).dot(&width_m) / length_m2 } else { 0.0 };
        let nearest_m = right_m + width_m * share.clamp(0.0, 1.0);
        (in_map_m - nearest_m).norm()
    }

    /// Whether the object of a scan's last run goes on in the scan's first run, beyond the rear.
    fn goes_on_behind_the_rear(&self, first: &Self) -> bool {
        let is_turned = first.zone.azimuth_max_rad > PI;
        let right_rad = first.zone.azimuth_min_rad + if is_turned { 0.0 } else { TAU };
        let (Some(a), Some(b)) = (self.zone.returns, first.zone.returns) else { return false };
        let step_m = a.nearest_m.max(b.nearest_m) - a.farthest_m.min(b.farthest_m);
        self.zone.azimuth_max_rad >= right_rad && f64::from(step_m) <= LARGEST_STEP_M
    }

    /// The zone of both, if two runs of beams are one object.
    fn joined(self, other: &Self) -> Self {
        let turn_rad = turn_towards_rad(other.zone.azimuth_min_rad, self.zone.azimuth_min_rad);
        let other_zone = DynamicZone {
            azimuth_min_rad: other.zone.azimuth_min_rad + turn_rad,
            azimuth_max_rad: other.zone.azimuth_max_rad + turn_rad,
            ..other.zone
        };
        let other = &Self { zone: other_zone, ..other.clone() };
        let (right, left) = if self.zone.azimuth_min_rad <= other.zone.azimuth_min_rad {
            (&self, other)
        } else {
            (other, &self)
        };
        let returns = self.zone.returns.zip(other.zone.returns).map(|(a, b)| ReturnSpan {
            nearest_m: a.nearest_m.min(b.nearest_m),
            farthest_m: a.farthest_m.max(b.farthest_m),
        });
        let zone = DynamicZone {
            azimuth_min_rad: right.zone.azimuth_min_rad,
            azimuth_max_rad: right.zone.azimuth_max_rad.max(left.zone.azimuth_max_rad),
            peak_std_dev_m: right.zone.peak_std_dev_m.max(left.zone.peak_std_dev_m),
            source: ZoneSource::Measured,
            returns,
        };
        Self {
            zone: from_the_rear(zone),
            right_in_map_m: right.right_in_map_m,
            left_in_map_m: left.left_in_map_m,
            error_m: right.error_m.max(left.error_m),
            has_travelled: right.has_travelled || left.has_travelled,
            measured_cycles: right.measured_cycles.max(left.measured_cycles),
        }
    }
}

impl ZoneMaker {
    pub(super) fn new(config: &DetectionConfig) -> Self {
        Self {
            half_aperture_rad: 0.5 * config.aperture_rad,
            tolerance_rad: config.zone_tolerance_rad,
            max_held_cycles: config.max_held_cycles,
        }
    }

    pub(super) fn set_aperture(&mut self, aperture_rad: f64) {
        self.half_aperture_rad = 0.5 * aperture_rad;
    }

    /// The zones of a cycle by azimuth: one for each run, or for the two of an object across the rear, with the largest deviation of its beams, and those of objects
    /// that are not visible. On a moving platform a zone is held for no more cycles than it was measured in: an object
    /// that appears only briefly was most likely a false detection.
    pub(super) fn zones(
        &self,
        view: &CycleView<'_>,
        runs: &[MovingBeams],
        objects: &mut [TrackedObject],
        std_dev_m: &[Option<f32>],
    ) -> Vec<DynamicZone> {
        let mut of_runs: Vec<ObjectZone> = Vec::new();
        let mut measured: Vec<Option<ObjectZone>> = vec![None; objects.len()];
        for run in runs {
            let Some(zone) = self.measured(view.scan, run, std_dev_m) else { continue };
            of_runs.push(zone.clone());
            if let Some(of_object) = run.object.and_then(|object| measured.get_mut(object)) {
                *of_object = Some(match of_object.take() {
                    Some(other) => other.joined(&zone),
                    None => zone,
                });
            }
        }
        if self.is_whole_circle()
            && view.scan.is_closed
            && let [first, .., last] = of_runs.as_slice()
            && last.goes_on_behind_the_rear(first)
        {
            let across = last.clone().joined(first);
            of_runs.pop();
            of_runs[0] = across;
        }
        let mut zones: Vec<DynamicZone> = of_runs.iter().map(|of_run| of_run.zone).collect();
        for (object, measured) in objects.iter_mut().zip(measured) {
            let before = object.zone.take();
            object.zone = match measured {
                Some(zone) => {
                    let cycles = before.map_or(0, |before| before.measured_cycles);
                    Some(ObjectZone { measured_cycles: cycles.saturating_add(1), ..zone })
                }
                None => before.and_then(|before| self.held(before, view)),
            };
            let zone = object.zone.as_ref().map(|zone| zone.zone);
            zones.extend(zone.filter(|zone| zone.source != ZoneSource::Measured));
        }
        zones.sort_by(|a, b| a.azimuth_min_rad.total_cmp(&b.azimuth_min_rad));
        zones
    }

    /// The zone of a run. Its bounds are the bearings of the beams beside the run, since the object ends
    /// before them, and the tolerance.
    fn measured(
        &self,
        scan: &DeskewedScan,
        MovingBeams { beams: run, has_travelled, .. }: &MovingBeams,
        std_dev_m: &[Option<f32>],
    ) -> Option<ObjectZone> {
        let returns = || scan.returns_of_object(run.clone()).map(|(_, hit)| hit);
        let (first, last) = (returns().next()?, returns().last()?);
        let error_m = returns().map(|hit| hit.error_m).fold(0.0, f64::max);
        let mut span = ReturnSpan { nearest_m: f32::INFINITY, farthest_m: 0.0 };
        let (mut right_rad, mut left_rad) = (f64::INFINITY, f64::NEG_INFINITY);
        // All of a run is on the same side of the rear as its middle.
        let middle_rad = azimuth_rad(&returns().nth(returns().count() / 2)?.in_rig_m);
        for hit in returns() {
            let distance_m = hit.distance_m() as f32;
            span.nearest_m = span.nearest_m.min(distance_m);
            span.farthest_m = span.farthest_m.max(distance_m);
            let azimuth_rad = azimuth_rad(&hit.in_rig_m);
            let azimuth_rad = azimuth_rad + turn_towards_rad(azimuth_rad, middle_rad);
            right_rad = right_rad.min(azimuth_rad);
            left_rad = left_rad.max(azimuth_rad);
        }
        // The beams without a return at the run's ends.
        let hit = |beam: &usize| scan.beams[*beam].hit.is_some();
        let blind_right = run.clone().take_while(|beam| !hit(beam)).count() as f64;
        let blind_left = run.clone().rev().take_while(|beam| !hit(beam)).count() as f64;
        let widening_rad = |blind: f64| (1.0 + blind) * scan.step_rad + self.tolerance_rad;
        let zone = DynamicZone {
            azimuth_min_rad: self.within_aperture(right_rad - widening_rad(blind_right)),
            azimuth_max_rad: self.within_aperture(left_rad + widening_rad(blind_left)),
            peak_std_dev_m: std_dev_m[run.clone()].iter().flatten().copied().fold(0.0, f32::max),
            source: ZoneSource::Measured,
            returns: Some(span),
        };
        let (right_in_map_m, left_in_map_m) =
            (scan.map_from_rig * first.in_rig_m, scan.map_from_rig * last.in_rig_m);
        Some(ObjectZone {
            zone: from_the_rear(zone),
            right_in_map_m,
            left_in_map_m,
            error_m,
            has_travelled: *has_travelled,
            measured_cycles: 1,
        })
    }

    /// A zone of an earlier cycle, as seen now; `None` when it has been held for long enough, or when most of its beams pass
    /// its place. On a moving platform also when they hit background there: then that was detected, and not an object that
    /// is hidden now.
    fn held(&self, old: ObjectZone, view: &CycleView<'_>) -> Option<ObjectZone> {
        let CycleView { scan, classes, within, platform_moves } = *view;
        let cycles = match old.zone.source {
            ZoneSource::Measured => 1,
            ZoneSource::Held { cycles } => cycles.saturating_add(1),
        };
        let rig_from_map = scan.map_from_rig.inverse();
        let ends = [old.right_in_map_m, old.left_in_map_m].map(|end| rig_from_map * end);
        let [right_rad, left_rad] = ends.map(|end| azimuth_rad(&end));
        let left_rad = left_rad + turn_towards_rad(left_rad, right_rad);
        let distances_m = ends.map(|end| end.x.hypot(end.y) as f32);
        let span = old.zone.returns?;
        // The depth of the object moves with its ends.
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
        let widening_rad = scan.step_rad + self.tolerance_rad;
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
        let zone = from_the_rear(zone);
        let mut beams = 0_usize;
        let mut seen_past = 0_usize;
        let is_past = |beam: &DeskewedBeam, class: Option<ReturnClass>| {
            beam.hit.as_ref().is_some_and(|hit| {
                let slack_m = hit.error_m + old.error_m;
                let is_behind = hit.distance_m() > f64::from(span.farthest_m) + slack_m;
                let is_before = hit.distance_m() < f64::from(span.nearest_m) - slack_m;
                is_behind
                    || (platform_moves && !is_before && class == Some(ReturnClass::Background))
            })
        };
        for index in within.clone() {
            let beam = &scan.beams[index];
            let azimuth_rad = beam.azimuth_rad + turn_towards_rad(beam.azimuth_rad, right_rad);
            if azimuth_rad < right_rad || azimuth_rad > left_rad {
                continue;
            }
            beams += 1;
            if is_past(beam, classes.get(index).copied().flatten()) {
                seen_past += 1;
            }
        }
        let is_over = beams == 0 || 2 * seen_past >= beams;
        (!is_over).then_some(ObjectZone { zone, ..old })
    }

    fn is_whole_circle(&self) -> bool {
        self.half_aperture_rad >= PI
    }

    /// An aperture of the whole circle has no bounds.
    fn within_aperture(&self, azimuth_rad: f64) -> f64 {
        if self.is_whole_circle() {
            return azimuth_rad;
        }
        azimuth_rad.max(-self.half_aperture_rad).min(self.half_aperture_rad)
    }
}

/// By what a direction is turned for it to be no more than half a turn from another.
fn turn_towards_rad(azimuth_rad: f64, other_rad: f64) -> f64 {
    if azimuth_rad - other_rad > PI {
        -TAU
    } else if azimuth_rad - other_rad < -PI {
        TAU
    } else {
        0.0
    }
}

/// The zone with its right bound in `[-pi, pi]`, and no more than the whole circle.
fn from_the_rear(zone: DynamicZone) -> DynamicZone {
    let turn_rad = turn_towards_rad(zone.azimuth_min_rad, 0.0);
    let azimuth_min_rad = zone.azimuth_min_rad + turn_rad;
    let azimuth_max_rad = (zone.azimuth_max_rad + turn_rad).min(azimuth_min_rad + TAU);
    DynamicZone { azimuth_min_rad, azimuth_max_rad, ..zone }
}

fn azimuth_rad(point_in_rig: &Point3<f64>) -> f64 {
    point_in_rig.y.atan2(point_in_rig.x)
}

#[cfg(test)]
mod tests;
