//! Segments by their direction.

use std::f32::consts::{PI, TAU};

use crate::feature::lines::LineFeature;

/// This many sets, of 10 degrees each (PL-SLAM).
const BINS: usize = 36;
const BIN_RAD: f32 = TAU / BINS as f32;

/// Segments sorted into 36 sets by direction, so that those of about one direction are found without asking all.
#[derive(Clone, Debug)]
pub struct DirectionBins {
    /// Set by set, and within one in the given order: which segment, and its direction.
    members: Vec<(usize, f32)>,
    /// Where each set begins, and after the last one the number of all.
    firsts: [usize; BINS + 1],
}

impl DirectionBins {
    /// The sets of these segments.
    #[must_use]
    pub fn new(features: &[LineFeature]) -> Self {
        let directions = features.iter().map(|feature| feature.segment.direction_rad());
        let mut members: Vec<(usize, f32)> = directions.enumerate().collect();
        // Stable: within a set the order stays.
        members.sort_by_key(|&(_, direction_rad)| bin(direction_rad));
        let mut firsts = [0; BINS + 1];
        for &(_, direction_rad) in &members {
            firsts[bin(direction_rad) + 1] += 1;
        }
        for set in 0..BINS {
            firsts[set + 1] += firsts[set];
        }
        Self { members, firsts }
    }

    /// Which segments point into a direction, give or take `max_turn_rad`.
    pub fn near(&self, direction_rad: f32, max_turn_rad: f32) -> impl Iterator<Item = usize> {
        let beside = (max_turn_rad / BIN_RAD).ceil() as usize;
        let sets = (2 * beside + 1).min(BINS);
        // With all sets there is none to begin at; with fewer, `beside` is less than their number.
        let first = bin(direction_rad) + BINS - beside.min(BINS);
        let members = (first..first + sets).flat_map(|set| {
            let set = set % BINS;
            &self.members[self.firsts[set]..self.firsts[set + 1]]
        });
        members
            .filter(move |&&(_, other_rad)| turn_rad(direction_rad, other_rad) <= max_turn_rad)
            .map(|&(index, _)| index)
    }
}

/// Which set a direction belongs to. What is not a number belongs to the first.
fn bin(direction_rad: f32) -> usize {
    ((direction_rad.rem_euclid(TAU) / BIN_RAD) as usize).min(BINS - 1)
}

/// By how much two directions differ, in `[0, pi]`.
pub(super) fn turn_rad(one_rad: f32, other_rad: f32) -> f32 {
    let turn_rad = (one_rad - other_rad).rem_euclid(TAU);
    if turn_rad > PI { TAU - turn_rad } else { turn_rad }
}
