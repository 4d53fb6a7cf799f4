//! The deviation of the ranges over the window (Rec-HV eq. 2, 3), with the earlier scans warped into the
//! present frame.

use std::collections::VecDeque;

use nalgebra::{Point2, Vector2};

use super::turn::{Return, Turn};

/// The turns of the window.
#[derive(Clone, Debug)]
pub(super) struct WarpWindow {
    window_scans: usize,
    turns: VecDeque<Turn>,
}

impl WarpWindow {
    /// An empty window for `window_scans` turns: the thesis' n.
    pub(super) fn new(window_scans: usize) -> Self {
        Self { window_scans: window_scans.max(1), turns: VecDeque::new() }
    }

    pub(super) fn clear(&mut self) {
        self.turns.clear();
    }

    pub(super) fn len(&self) -> usize {
        self.turns.len()
    }

    /// The turn before the newest.
    pub(super) fn previous(&self) -> Option<&Turn> {
        self.turns.len().checked_sub(2).and_then(|place| self.turns.get(place))
    }

    /// Takes in the next turn; the oldest leaves a full window.
    pub(super) fn push(&mut self, turn: Turn) {
        if self.turns.len() == self.window_scans {
            self.turns.pop_front();
        }
        self.turns.push_back(turn);
    }

    /// The population deviation of each beam of the newest turn over the window (eq. 3), or `None` until the
    /// window is full. A beam without a return has none, and neither has one that fewer than two turns know
    /// a range for: what nothing could have seen has not moved.
    ///
    /// With the same pose throughout and a return for every beam this is eq. 3 to the bit.
    pub(super) fn std_dev_m(&self) -> Option<Vec<Option<f32>>> {
        if self.turns.len() < self.window_scans {
            return None;
        }
        let present = self.turns.back()?;
        let warped: Vec<Vec<Option<f32>>> =
            self.turns.iter().map(|turn| warp(turn, present)).collect();
        let deviation = |beam: usize| {
            present.beams[beam].met?;
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

/// What the beams of `present` would have measured of what `earlier` measured; unknown where it measured
/// nothing, and where the present return was hidden from it.
pub(super) fn warp(earlier: &Turn, present: &Turn) -> Vec<Option<f32>> {
    if earlier.map_from_rig == present.map_from_rig && earlier.beams.len() == present.beams.len() {
        // The same place: the same beams, so that nothing is computed and no bit changes.
        return earlier.beams.iter().map(|beam| beam.met.map(|met| met.range_m)).collect();
    }
    let mut ranges_m: Vec<Option<f32>> = vec![None; present.beams.len()];
    let (Some(seen_now), Some(seen_then)) = (Bearings::of(present), Bearings::of(earlier)) else {
        return ranges_m;
    };
    for (index, beam) in earlier.beams.iter().enumerate() {
        let Some(met) = &beam.met else { continue };
        // Each return stands for the half step to each side, and for the surface up to the next return.
        let Some(place) = seen_now.place(&met.in_map_m) else { continue };
        nearer(&mut ranges_m, place.round() as isize, seen_now.distance_m(&met.in_map_m));
        let Some(next_met) = earlier.next(index).and_then(|next| earlier.beams[next].met.as_ref())
        else {
            continue;
        };
        if let Some(next_place) = seen_now.place(&next_met.in_map_m)
            && earlier.is_one_surface(met, next_met)
        {
            seen_now.cover(&mut ranges_m, (place, met), (next_place, next_met));
        }
    }
    for (range_m, beam) in ranges_m.iter_mut().zip(&present.beams) {
        if let Some(met) = &beam.met
            && !seen_then.could_see(earlier, met)
        {
            *range_m = None;
        }
    }
    ranges_m
}

/// Whether `met` was not there in the turn before: a beam of it saw past the place, or had no return
/// although nothing is known to have stood in its way.
pub(super) fn has_arrived(earlier: &Turn, met: &Return) -> bool {
    let Some(bearings) = Bearings::of(earlier) else { return false };
    let Some(place) = bearings.place(&met.in_map_m) else { return false };
    earlier.beams.get(place.round() as usize).is_some_and(|beam| {
        beam.met.as_ref().is_none_or(|seen| {
            f64::from(seen.range_m)
                > bearings.distance_m(&met.in_map_m) + met.error_m + seen.error_m
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

/// The bearings of a turn's beams in the map's plane.
struct Bearings {
    origin_m: Point2<f64>,
    first: Vector2<f64>,
    step_rad: f64,
    beams: usize,
}

impl Bearings {
    fn of(turn: &Turn) -> Option<Self> {
        // The middle of the turn, in front of the rig, stands for it: within a turn the origin hardly moves.
        let middle = turn.beams.get(turn.beams.len() / 2)?;
        let beams = turn.beams.len();
        let back_rad = turn.beams.first()?.azimuth_rad - middle.azimuth_rad;
        let first = nalgebra::Rotation2::new(back_rad) * middle.direction;
        Some(Self { origin_m: middle.origin_m, first, step_rad: turn.step_rad, beams })
    }

    /// At which place among the beams a point is seen; fractions lie between two beams.
    fn place(&self, point_m: &Point2<f64>) -> Option<f64> {
        let way_m = point_m - self.origin_m;
        let mut along_rad = self.first.perp(&way_m).atan2(self.first.dot(&way_m));
        if along_rad < -0.5 * self.step_rad {
            along_rad += std::f64::consts::TAU;
        }
        let place = along_rad / self.step_rad;
        (place.is_finite() && place <= self.beams as f64 - 0.5).then_some(place)
    }

    fn distance_m(&self, point_m: &Point2<f64>) -> f64 {
        (point_m - self.origin_m).norm()
    }

    /// Fills the beams between two returns of one surface, seen from its front.
    fn cover(
        &self,
        ranges_m: &mut [Option<f32>],
        (from, from_met): (f64, &Return),
        (to, to_met): (f64, &Return),
    ) {
        // A longer way round is the seam of the turn, or a surface seen from behind.
        if to <= from || to - from > 0.5 * self.beams as f64 {
            return;
        }
        let (a_m, b_m) = (from_met.in_map_m - self.origin_m, to_met.in_map_m - self.origin_m);
        for place in from.ceil() as isize..=to.floor() as isize {
            let direction = nalgebra::Rotation2::new(place as f64 * self.step_rad) * self.first;
            // Where the ray crosses the line from a to b.
            let distance_m = a_m.perp(&b_m) / direction.perp(&(b_m - a_m));
            if distance_m.is_finite() && distance_m > 0.0 {
                nearer(ranges_m, place, distance_m);
            }
        }
    }

    /// Whether a beam of `turn` ended at `met` or went past it.
    fn could_see(&self, turn: &Turn, met: &Return) -> bool {
        let Some(place) = self.place(&met.in_map_m) else { return false };
        let seen = turn.beams.get(place.round() as usize).and_then(|beam| beam.met.as_ref());
        seen.is_some_and(|seen| {
            let error_m = met.error_m + seen.error_m;
            self.distance_m(&met.in_map_m) <= f64::from(seen.range_m) + error_m
        })
    }
}

#[cfg(test)]
mod tests;
