//! Where a thing has been over the last scans, and whether it came some way.

use std::collections::VecDeque;
use std::ops::Range;

use nalgebra::{Point2, Vector2, distance};

use super::turn::Turn;

/// Faster than this nobody goes indoors: a run.
const FASTEST_M_PER_S: f64 = 3.0;
/// Places that a journey is made of, at least: with three of them a thing that came into sight beside another
/// could pass for it.
pub(super) const LEAST_PLACES: usize = 4;
/// The way from place to place may be longer than the journey by this factor: what merely sways goes back.
const MOST_DETOUR: f64 = 1.5;
/// A journey counts only above this share of the platform's own: what is seen of a thing that stands changes as
/// the platform goes by.
const SHARE_OF_PLATFORM: f64 = 0.5;

/// A step may be ahead of an even pace by this share of the journey: of two steps one may be a stride and the other a
/// rest, and more so of the four places that a journey has at least.
const MOST_AHEAD: f64 = 0.25;

/// Where a thing was in one scan.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) now_ms: u32,
    /// The middle of what was seen of it.
    pub(super) in_map_m: Point2<f64>,
    pub(super) platform_m: Point2<f64>,
    /// The returns that show it.
    pub(super) returns: usize,
}

impl Place {
    /// The middle of what some beams of a turn met; `None` where they met nothing.
    pub(super) fn of(turn: &Turn, beams: &Range<usize>, now_ms: u32) -> Option<Self> {
        let platform_m = turn.beams.first()?.origin_m;
        let met = turn.beams.get(beams.clone())?.iter().filter_map(|beam| beam.met);
        let (sum, returns) = met.fold((Vector2::zeros(), 0_usize), |(sum, returns), met| {
            (sum + met.in_map_m.coords, returns + 1)
        });
        let in_map_m = Point2::from(sum / returns as f64);
        (returns > 0).then_some(Self { now_ms, in_map_m, platform_m, returns })
    }
}

/// The places of a thing over the last while.
#[derive(Clone, Debug, Default)]
pub(super) struct Journey {
    /// The latest last.
    places: VecDeque<Place>,
}

impl Journey {
    /// Takes a place, and forgets those of more than `longest_look_ms` before.
    pub(super) fn arrive(&mut self, place: Place, longest_look_ms: u32) {
        self.places.push_back(place);
        let is_old = |old: &Place| place.now_ms.saturating_sub(old.now_ms) > longest_look_ms;
        while self.places.front().is_some_and(is_old) {
            self.places.pop_front();
        }
    }

    /// How far a place is from the last one, unless nobody gets there in time; without motion the middle of what
    /// is seen of a thing jumps by `jump_m`.
    pub(super) fn step_m(&self, place: &Place, jump_m: f64) -> Option<f64> {
        let last = self.last()?;
        let apart_m = distance(&last.in_map_m, &place.in_map_m);
        let elapsed_s = f64::from(place.now_ms.saturating_sub(last.now_ms)) * 1e-3;
        (apart_m <= jump_m + FASTEST_M_PER_S * elapsed_s).then_some(apart_m)
    }

    /// Where the thing was last.
    pub(super) fn last(&self) -> Option<&Place> {
        self.places.back()
    }

    /// When the thing was last seen.
    pub(super) fn seen_ms(&self) -> Option<u32> {
        self.last().map(|place| place.now_ms)
    }

    /// How many places are remembered.
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// For how long the places reach back.
    pub(super) fn lasts_ms(&self) -> u32 {
        self.ends().map_or(0, |(first, last)| last.now_ms.saturating_sub(first.now_ms))
    }

    /// How far the platform has come meanwhile.
    pub(super) fn platform_m(&self) -> f64 {
        self.ends().map_or(0.0, |(first, last)| distance(&first.platform_m, &last.platform_m))
    }

    /// Whether the thing is `away_m` farther than the platform's share from where it was.
    pub(super) fn leads_away(&self, away_m: f64) -> bool {
        self.ends().is_some_and(|(first, last)| {
            let journey_m = distance(&first.in_map_m, &last.in_map_m);
            journey_m >= away_m + SHARE_OF_PLATFORM * self.platform_m()
        })
    }

    /// Whether the thing has come `travelled_m` farther than the platform's share, without going back.
    pub(super) fn travels(&self, travelled_m: f64) -> bool {
        let Some((first, last)) = self.ends() else { return false };
        let steps = self.places.iter().zip(self.places.iter().skip(1));
        let way_m: f64 = steps.map(|(from, to)| distance(&from.in_map_m, &to.in_map_m)).sum();
        let journey_m = distance(&first.in_map_m, &last.in_map_m);
        self.places.len() >= LEAST_PLACES
            && self.leads_away(travelled_m)
            && way_m <= MOST_DETOUR * journey_m
    }

    /// Whether the journey was made step by step. In one leap nobody comes so far: that is another thing, or another
    /// part of it, that came into sight.
    pub(super) fn is_gradual(&self) -> bool {
        let Some((first, last)) = self.ends() else { return false };
        let journey_m = distance(&first.in_map_m, &last.in_map_m);
        let lasts_ms = f64::from(self.lasts_ms().max(1));
        self.places.iter().zip(self.places.iter().skip(1)).all(|(from, to)| {
            let time_share = f64::from(to.now_ms.saturating_sub(from.now_ms)) / lasts_ms;
            distance(&from.in_map_m, &to.in_map_m) <= (time_share + MOST_AHEAD) * journey_m
        })
    }

    fn ends(&self) -> Option<(&Place, &Place)> {
        self.places.front().zip(self.places.back())
    }
}
