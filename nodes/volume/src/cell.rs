//! The evidence on one cell, in 2D as in 3D: how often it was hit, how often it was free, and since when.
//!
//! In each cycle a cell is hit (a static point is in it), passed (all of it is certainly free), or neither. A hit outweighs
//! any number of passes of its cycle; the caller ensures that. Moving points are neither.

/// Cycles in which a cell must be passed before it counts as free. One pass may be a wrong depth, two may come from one
/// image that was used twice.
const LEAST_PASSES: u8 = 3;
/// A free cell is hit in fewer than one of this many cycles: such hits are noise.
const PASSES_PER_HIT_WHERE_FREE: u16 = 15;
/// A cell with fewer hits is not occupied, as for [`LEAST_PASSES`].
const LEAST_HITS: u8 = 3;
/// An occupied cell is hit at least once in this many cycles: the cells of a surface in all of them, those beside it as often
/// as the noise of depth moves a point across the border.
const PASSES_PER_HIT_WHERE_OCCUPIED: u16 = 5;
/// A single hit may be noise; two may be a surface.
const LEAST_HITS_OF_SURFACE: u8 = 2;
/// Counts are halved when their sum reaches this, so that a cell that changes gets its new state after some 10 s at 7 Hz. Passes
/// alone do not reach it.
const MOST_CYCLES: u8 = 64;

/// The state of a cell.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum CellState {
    /// There is no evidence, or too little.
    #[default]
    Unknown,
    /// It was observed free in several cycles.
    Free,
    /// It was hit in several cycles.
    Occupied,
}

/// The evidence on a cell. Times are ticks of the caller, from 1 on; 0 means never.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Cell {
    free_since: u32,
    first_hit: u32,
    last_hit: u32,
    hits: u8,
    passes: u8,
}

impl Cell {
    /// A static point was in it in this cycle.
    #[inline]
    pub fn hit(&mut self, now: u32) {
        if self.hits == 0 {
            self.first_hit = now;
        }
        self.last_hit = now;
        self.hits += 1;
        self.fade();
    }

    /// All of it was free in this cycle.
    #[inline]
    pub fn pass(&mut self, now: u32) {
        let was_free = self.state() == CellState::Free;
        if self.hits == 0 {
            self.passes = (self.passes + 1).min(MOST_CYCLES - 1);
        } else {
            self.passes += 1;
            self.fade();
        }
        if !was_free && self.state() == CellState::Free {
            self.free_since = now;
        }
    }

    /// The evidence of two cells that come to one place.
    pub(crate) fn joined(self, other: Self) -> Self {
        let (hits, passes) = (self.hits + other.hits, self.passes + other.passes);
        let first_of = |one: u32, other: u32| {
            if one == 0 || other == 0 { one.max(other) } else { one.min(other) }
        };
        let mut joined = Self {
            free_since: self.free_since.max(other.free_since),
            first_hit: first_of(self.first_hit, other.first_hit),
            last_hit: self.last_hit.max(other.last_hit),
            hits,
            passes: if hits == 0 { passes.min(MOST_CYCLES - 1) } else { passes },
        };
        if hits > 0 {
            joined.fade();
        }
        joined
    }

    fn fade(&mut self) {
        if self.hits + self.passes >= MOST_CYCLES {
            self.hits /= 2;
            self.passes /= 2;
        }
    }

    /// Sets it to free from now on, unless it is free already.
    pub fn take_for_free(&mut self, now: u32) {
        let is_free = self.state() == CellState::Free;
        let free_since = if is_free { self.free_since } else { now };
        *self = Self { free_since, passes: self.passes.max(LEAST_PASSES), ..Self::default() };
    }

    /// Sets it to occupied since this time.
    pub fn take_for_occupied(&mut self, since: u32, now: u32) {
        *self = Self { first_hit: since, last_hit: now, hits: MOST_CYCLES / 2, ..Self::default() };
    }

    /// Its state.
    #[must_use]
    #[inline]
    pub fn state(&self) -> CellState {
        let (hits, passes) = (u16::from(self.hits), u16::from(self.passes));
        if self.passes >= LEAST_PASSES && hits * PASSES_PER_HIT_WHERE_FREE <= passes {
            CellState::Free
        } else if self.hits >= LEAST_HITS && hits * PASSES_PER_HIT_WHERE_OCCUPIED >= passes {
            CellState::Occupied
        } else {
            CellState::Unknown
        }
    }

    /// Whether it is, or may be, part of a surface.
    #[must_use]
    pub fn may_be_surface(&self) -> bool {
        let (hits, passes) = (u16::from(self.hits), u16::from(self.passes));
        self.hits >= LEAST_HITS_OF_SURFACE && hits * PASSES_PER_HIT_WHERE_OCCUPIED >= passes
    }

    /// Whether it was hit in enough cycles to be more than noise.
    #[must_use]
    pub fn was_hit(&self) -> bool {
        self.hits >= LEAST_HITS
    }

    /// Cycles in which it was hit, with decay.
    #[must_use]
    pub fn hits(&self) -> u8 {
        self.hits
    }

    /// Cycles in which it was passed, with decay.
    #[must_use]
    pub fn passes(&self) -> u8 {
        self.passes
    }

    /// Since when it has been free.
    #[must_use]
    pub fn free_since(&self) -> u32 {
        self.free_since
    }

    /// The first of the hits that still count.
    #[must_use]
    pub fn first_hit(&self) -> u32 {
        self.first_hit
    }

    /// The last hit.
    #[must_use]
    pub fn last_hit(&self) -> u32 {
        self.last_hit
    }

    /// Whether further passes cannot change it: then it can be merged with its neighbours.
    pub(crate) fn is_free_for_long(&self) -> bool {
        self.hits == 0 && self.passes == MOST_CYCLES - 1
    }

    /// The cell that replaces two that have long been free: free since the later time.
    pub(crate) fn merged(self, other: Self) -> Self {
        Self {
            free_since: self.free_since.max(other.free_since),
            passes: self.passes,
            ..Self::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(steps: &[(bool, u32)]) -> Cell {
        let mut cell = Cell::default();
        let mut now = 0;
        for &(is_hit, cycles) in steps {
            for _ in 0..cycles {
                now += 1;
                if is_hit { cell.hit(now) } else { cell.pass(now) }
            }
        }
        cell
    }

    #[test]
    fn it_is_what_it_was_seen_to_be_three_times() {
        for (steps, state) in [
            (&[(false, 2)][..], CellState::Unknown),
            (&[(false, 3)], CellState::Free),
            (&[(true, 2)], CellState::Unknown),
            (&[(true, 3)], CellState::Occupied),
            (&[(false, 30), (true, 2)], CellState::Free),
            (&[(false, 30), (true, 3)], CellState::Unknown),
            (&[(true, 4), (false, 20)], CellState::Occupied),
        ] {
            assert_eq!(after(steps).state(), state, "{steps:?}");
        }
    }

    #[test]
    fn it_knows_since_when() {
        let cell = after(&[(false, 20), (true, 1), (false, 5)]);
        assert_eq!((cell.state(), cell.free_since(), cell.last_hit()), (CellState::Free, 3, 21));
        let cell = after(&[(false, 5), (true, 100)]);
        assert_eq!(
            (cell.state(), cell.first_hit(), cell.last_hit()),
            (CellState::Occupied, 6, 105)
        );
    }

    #[test]
    fn it_changes_its_state_in_time_however_long_it_had_it() {
        for is_hit in [false, true] {
            let (from, to) = if is_hit {
                (CellState::Occupied, CellState::Free)
            } else {
                (CellState::Free, CellState::Occupied)
            };
            let mut cell = after(&[(is_hit, 10_000)]);
            assert_eq!(cell.state(), from);
            let cycles = (10_001..10_400).find(|now| {
                if is_hit {
                    cell.pass(*now)
                } else {
                    cell.hit(*now)
                }
                cell.state() == to
            });
            assert!(cycles.is_some_and(|now| now < 10_180), "{cycles:?}");
        }
    }

    #[test]
    fn it_may_be_told_what_it_is() {
        let mut cell = after(&[(true, 40)]);
        cell.take_for_free(50);
        assert_eq!((cell.state(), cell.free_since()), (CellState::Free, 50));
        cell.take_for_occupied(20, 60);
        assert_eq!(
            (cell.state(), cell.first_hit(), cell.last_hit()),
            (CellState::Occupied, 20, 60)
        );
    }
}
