//! The deviation of the ranges over the window (Rec-HV eq. 2, 3), with the earlier scans warped into the
//! present frame.

use std::collections::VecDeque;
use std::sync::Arc;

use nalgebra::{Point2, Vector2};

use super::deskewed_scan::{DeskewedBeam, DeskewedScan, NEIGHBOUR_STEPS, Return};

/// The scans of the window.
#[derive(Clone, Debug)]
pub(super) struct ScanWindow {
    window_scans: usize,
    scans: VecDeque<Arc<DeskewedScan>>,
}

impl ScanWindow {
    /// An empty window for `window_scans` scans: the thesis' n.
    pub(super) fn new(window_scans: usize) -> Self {
        Self { window_scans: window_scans.max(1), scans: VecDeque::new() }
    }

    pub(super) fn clear(&mut self) {
        self.scans.clear();
    }

    pub(super) fn len(&self) -> usize {
        self.scans.len()
    }

    /// The scan before the newest.
    pub(super) fn previous(&self) -> Option<&DeskewedScan> {
        self.scans.len().checked_sub(2).and_then(|place| self.scans.get(place)).map(|scan| &**scan)
    }

    /// Adds the next scan; a full window drops the oldest.
    pub(super) fn push(&mut self, scan: Arc<DeskewedScan>) {
        if self.scans.len() == self.window_scans {
            self.scans.pop_front();
        }
        self.scans.push_back(scan);
    }

    /// The population deviation of each beam of the newest scan over the window (eq. 3), or `None` until the
    /// window is full. A beam without a return has none, and neither has one with a range in fewer than two
    /// scans.
    ///
    /// With the same pose throughout and a return for every beam this is eq. 3 to the bit.
    pub(super) fn std_dev_m(&self) -> Option<Vec<Option<f32>>> {
        if self.scans.len() < self.window_scans {
            return None;
        }
        let present = self.scans.back()?;
        let warped: Vec<Vec<Option<f32>>> =
            self.scans.iter().map(|scan| warp(scan, present)).collect();
        let deviation = |beam: usize| {
            present.beams[beam].hit?;
            let ranges = || warped.iter().filter_map(|ranges| ranges[beam]).map(f64::from);
            let known = ranges().count();
            if known < 2.min(self.window_scans) {
                return None;
            }
            let share = 1.0 / known as f64;
            let mean_m = share * ranges().sum::<f64>();
            let variance_m2 = share * ranges().map(|range| (range - mean_m).powi(2)).sum::<f64>();
            Some(variance_m2.sqrt() as f32)
        };
        Some((0..present.beams.len()).map(deviation).collect())
    }
}

/// The ranges that the beams of `present` would have had at the time of `earlier`; `None` where `earlier` has no return, or
/// where the present return was hidden from it.
pub(super) fn warp(earlier: &DeskewedScan, present: &DeskewedScan) -> Vec<Option<f32>> {
    if has_the_beams_of(earlier, present) {
        // The ranges are not recomputed.
        return earlier.beams.iter().map(|beam| beam.hit.map(|hit| hit.range_m)).collect();
    }
    let mut ranges_m: Vec<Option<f32>> = vec![None; present.beams.len()];
    let (Some(seen_now), Some(seen_then)) = (Bearings::of(present), Bearings::of(earlier)) else {
        return ranges_m;
    };
    for (index, beam) in earlier.beams.iter().enumerate() {
        let Some(hit) = &beam.hit else { continue };
        // Each return covers half a step to each side, and the surface up to the next return.
        let Some(place) = seen_now.place(&hit.in_map_m) else { continue };
        nearer(&mut ranges_m, place.round() as isize, seen_now.distance_m(&hit.in_map_m));
        let Some(next_hit) = earlier.next(index).and_then(|next| earlier.beams[next].hit.as_ref())
        else {
            continue;
        };
        if let Some(next_place) = seen_now.place(&next_hit.in_map_m)
            && earlier.is_one_surface(hit, next_hit)
        {
            seen_now.cover(&mut ranges_m, (place, hit), (next_place, next_hit));
        }
    }
    for (range_m, beam) in ranges_m.iter_mut().zip(&present.beams) {
        if let Some(hit) = &beam.hit
            && !seen_then.could_see(earlier, hit)
        {
            *range_m = None;
        }
    }
    ranges_m
}

/// Whether both scans have the same beams: they are of the same pose, and were measured at the same time before or after it, or on a
/// static platform.
fn has_the_beams_of(earlier: &DeskewedScan, present: &DeskewedScan) -> bool {
    let first =
        |scan: &DeskewedScan| scan.beams.first().map(|beam| (beam.origin_m, beam.direction));
    earlier.map_from_rig == present.map_from_rig
        && earlier.beams.len() == present.beams.len()
        && first(earlier) == first(present)
}

/// Whether the place of `hit` was not occupied in the scan before: a beam of it passed the place, or had no return
/// and nothing known was in between.
pub(super) fn is_newly_occupied(earlier: &DeskewedScan, hit: &Return) -> bool {
    let Some(bearings) = Bearings::of(earlier) else { return false };
    let Some(place) = bearings.place(&hit.in_map_m) else { return false };
    earlier.beams.get(place.round() as usize).is_some_and(|beam| {
        beam.hit.as_ref().is_none_or(|seen| {
            f64::from(seen.range_m)
                > bearings.distance_m(&hit.in_map_m) + hit.error_m + seen.error_m
        })
    })
}

fn nearer(ranges_m: &mut [Option<f32>], place: isize, distance_m: f64) {
    let Ok(place) = usize::try_from(place) else { return };
    if let Some(range_m) = ranges_m.get_mut(place) {
        let distance_m = distance_m as f32;
        *range_m = Some(range_m.map_or(distance_m, |range_m| range_m.min(distance_m)));
    }
}

/// The bearings of a scan's beams in the map's plane.
struct Bearings<'a> {
    origin_m: Point2<f64>,
    /// The direction of the first beam.
    first: Vector2<f64>,
    step_rad: f64,
    /// Between two of them a scanner of less than a full turn may have its gap.
    beams: &'a [DeskewedBeam],
}

impl<'a> Bearings<'a> {
    fn of(scan: &'a DeskewedScan) -> Option<Self> {
        // The origin of the middle beam is used for all: within a scan it hardly moves.
        let middle = scan.beams.get(scan.beams.len() / 2)?;
        let back_rad = scan.beams.first()?.azimuth_rad - middle.azimuth_rad;
        let first = nalgebra::Rotation2::new(back_rad) * middle.direction;
        let (origin_m, step_rad) = (middle.origin_m, scan.step_rad);
        Some(Self { origin_m, first, step_rad, beams: &scan.beams })
    }

    /// The angle from the first beam to another.
    fn along_rad(&self, beam: usize) -> Option<f64> {
        Some(self.beams.get(beam)?.azimuth_rad - self.beams.first()?.azimuth_rad)
    }

    /// The index of the beam that hits a point; fractions lie between two beams.
    fn place(&self, point_m: &Point2<f64>) -> Option<f64> {
        let offset_m = point_m - self.origin_m;
        let mut along_rad = self.first.perp(&offset_m).atan2(self.first.dot(&offset_m));
        if along_rad < -0.5 * self.step_rad {
            along_rad += std::f64::consts::TAU;
        }
        let first_rad = self.beams.first()?.azimuth_rad;
        let above = self.beams.partition_point(|beam| beam.azimuth_rad - first_rad <= along_rad);
        let Some(below) = above.checked_sub(1) else {
            return Some(along_rad / self.step_rad).filter(|place| place.is_finite());
        };
        // Each beam covers half a step to each side, and neighbours what is between them.
        let beyond = (along_rad - self.along_rad(below)?) / self.step_rad;
        let next_rad = self.along_rad(above);
        let to_next = next_rad.map(|next_rad| (next_rad - along_rad) / self.step_rad);
        let place = match to_next {
            Some(to_next) if beyond + to_next <= NEIGHBOUR_STEPS => {
                below as f64 + beyond / (beyond + to_next)
            }
            _ if beyond <= 0.5 => below as f64 + beyond,
            Some(to_next) if to_next <= 0.5 => above as f64 - to_next,
            _ => return None,
        };
        place.is_finite().then_some(place)
    }

    fn distance_m(&self, point_m: &Point2<f64>) -> f64 {
        (point_m - self.origin_m).norm()
    }

    /// Fills the beams between two returns of one surface, seen from its front.
    fn cover(
        &self,
        ranges_m: &mut [Option<f32>],
        (from, from_hit): (f64, &Return),
        (to, to_hit): (f64, &Return),
    ) {
        // A larger angle is the seam of the scan, or a surface seen from behind.
        if to <= from || to - from > 0.5 * self.beams.len() as f64 {
            return;
        }
        let (a_m, b_m) = (from_hit.in_map_m - self.origin_m, to_hit.in_map_m - self.origin_m);
        for place in from.ceil() as isize..=to.floor() as isize {
            let along_rad = usize::try_from(place).ok().and_then(|beam| self.along_rad(beam));
            let Some(along_rad) = along_rad else { continue };
            let direction = nalgebra::Rotation2::new(along_rad) * self.first;
            // Where the ray crosses the line from a to b.
            let distance_m = a_m.perp(&b_m) / direction.perp(&(b_m - a_m));
            if distance_m.is_finite() && distance_m > 0.0 {
                nearer(ranges_m, place, distance_m);
            }
        }
    }

    /// Whether a beam of `scan` ended at `hit` or passed it.
    fn could_see(&self, scan: &DeskewedScan, hit: &Return) -> bool {
        let Some(place) = self.place(&hit.in_map_m) else { return false };
        let seen = scan.beams.get(place.round() as usize).and_then(|beam| beam.hit.as_ref());
        seen.is_some_and(|seen| {
            let error_m = hit.error_m + seen.error_m;
            self.distance_m(&hit.in_map_m) <= f64::from(seen.range_m) + error_m
        })
    }
}

#[cfg(test)]
mod tests;
