//! The evidence on one cell, in 2D as in 3D: how often it was hit, how often it was free, and since when it has been occupied.
//!
//! - **Once a cycle** a cell is hit (something static is in it) or passed (all of it is certainly free). The first of a cycle
//!   counts, and hits come before passes: a hit outweighs any number of passes of its cycle.
//! - **What moves** in a cell is neither. What has stayed for long, seen or unseen, without a pass in between, is static.
//! - **Decay.** Old cycles count less and less, so that a cell that changes gets its new state in a bounded time.
//! - **Age.** Where the caller has a time after which evidence is too old, a cell that was not renewed is unknown again.

/// Cycles in which a cell must be passed before it counts as free. One pass may be a wrong depth or range, two may come from one
/// image that was used twice.
const LEAST_PASSES: u8 = 3;
/// A cell with fewer hits is not occupied, as for [`LEAST_PASSES`].
const LEAST_HITS: u8 = 3;
/// A single hit may be noise; two may be a surface.
const LEAST_HITS_OF_SURFACE: u8 = 2;
/// What comes and goes was hit, and then free, so often.
const LEAST_RUNS: u8 = 2;
/// It was hit, and free, for so many cycles each time, in the mean: more than errors of single cycles give.
const LEAST_RUN: u8 = 3;
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

/// How many passes a hit outweighs in the state of a cell: it depends on how often noise puts a hit beside its cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PassesPerHit {
    /// A free cell is hit in no more than one of so many cycles: such hits are noise.
    pub(crate) where_free: u16,
    /// An occupied cell is hit at least once in so many cycles: the cells of a surface in all of them, those beside it as often
    /// as the noise moves a point across the border.
    pub(crate) where_occupied: u16,
}

impl PassesPerHit {
    /// Of voxels, hit by means of many depths.
    const OF_MEANS: Self = Self { where_free: 15, where_occupied: 5 };
}

/// What of something that moves, or moved, is in a cell.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
enum Held {
    #[default]
    Nothing,
    /// It moves, or may go on: it was here, and no pass came after it.
    Moving,
    /// The same, of a thing that was put here, and left.
    Left,
    /// It has stopped for good, and is background.
    Stopped,
}

/// The evidence on a cell. Times are ticks of the caller, from 1 on and later with each cycle; 0 means never.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Cell {
    /// The first of the hits that still count, or since when something that moves has been here.
    occupied_since: u32,
    last_hit: u32,
    /// The last cycle with any evidence.
    seen: u32,
    hits: u8,
    passes: u8,
    /// How often hits began: the first time, and after a pass.
    runs: u8,
    held: Held,
}

// Grids are sized by it.
const _: () = assert!(size_of::<Cell>() == 16);

impl Cell {
    /// Something static was in it in this cycle.
    #[inline]
    pub fn hit(&mut self, now: u32) {
        if self.seen == now {
            return;
        }
        if self.hits == 0 && !self.holds_moving() {
            self.occupied_since = now;
        }
        if self.last_hit != self.seen || self.hits == 0 {
            self.runs = self.runs.saturating_add(1);
        }
        (self.last_hit, self.seen) = (now, now);
        self.hits += 1;
        self.fade();
    }

    /// All of it was free in this cycle.
    #[inline]
    pub fn pass(&mut self, now: u32) {
        if self.seen == now {
            return;
        }
        self.seen = now;
        // A pass shows that what moved is gone; what has stopped is background, which is gone after many.
        if self.held != Held::Stopped || self.hits == 0 {
            self.held = Held::Nothing;
        }
        if self.hits == 0 {
            self.passes = (self.passes + 1).min(MOST_CYCLES - 1);
        } else {
            self.passes += 1;
            self.fade();
        }
    }

    /// Something that moves was in it in this cycle, so that no pass counts. Returns since when something that moves has been here,
    /// without a pass in between: what has been here for long is static ([`Self::take_for_occupied`]).
    pub fn hold_moving(&mut self, now: u32) -> u32 {
        self.seen = now;
        if !self.holds_moving() {
            (self.held, self.occupied_since) = (Held::Moving, now);
        }
        self.occupied_since
    }

    /// What is here was put here, and who did it has left.
    pub fn leave(&mut self) {
        if self.held == Held::Moving {
            self.held = Held::Left;
        }
    }

    /// Whether what is here was put here and left.
    #[must_use]
    pub fn is_left(&self) -> bool {
        self.held == Held::Left
    }

    /// Whether what is here has moved, and has stopped for good.
    #[must_use]
    pub fn has_stopped(&self) -> bool {
        self.held == Held::Stopped && self.state() == CellState::Occupied
    }

    fn holds_moving(&self) -> bool {
        matches!(self.held, Held::Moving | Held::Left)
    }

    /// Forgets evidence that was not renewed for more than `memory` ticks.
    #[inline]
    pub fn forget_after(&mut self, memory: u32, now: u32) {
        if now.saturating_sub(self.seen) > memory {
            *self = Self::default();
        }
    }

    /// The evidence of two cells that come to one place.
    pub(crate) fn joined(self, other: Self) -> Self {
        let (hits, passes) = (self.hits + other.hits, self.passes + other.passes);
        let first_of = |one: u32, other: u32| {
            if one == 0 || other == 0 { one.max(other) } else { one.min(other) }
        };
        let mut joined = Self {
            occupied_since: first_of(self.occupied_since, other.occupied_since),
            last_hit: self.last_hit.max(other.last_hit),
            seen: self.seen.max(other.seen),
            hits,
            runs: self.runs.saturating_add(other.runs),
            passes: if hits == 0 { passes.min(MOST_CYCLES - 1) } else { passes },
            held: self.held.max(other.held),
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
            self.runs = self.runs.div_ceil(2);
        }
    }

    /// Sets it to free: the cycle itself may still pass it.
    pub fn take_for_free(&mut self) {
        *self = Self { passes: self.passes.max(LEAST_PASSES), seen: self.seen, ..Self::default() };
    }

    /// Sets it to occupied since this time: what moved has stopped here for good.
    pub fn take_for_occupied(&mut self, since: u32, now: u32) {
        *self = Self {
            occupied_since: since,
            last_hit: now,
            seen: now,
            hits: MOST_CYCLES / 2,
            runs: 1,
            held: Held::Stopped,
            ..Self::default()
        };
    }

    /// The state of a voxel, which means of depths hit.
    #[must_use]
    #[inline]
    pub fn state(&self) -> CellState {
        self.state_by(PassesPerHit::OF_MEANS)
    }

    /// Its state, if a hit outweighs so many passes.
    #[inline]
    pub(crate) fn state_by(&self, passes_per_hit: PassesPerHit) -> CellState {
        let (hits, passes) = (u16::from(self.hits), u16::from(self.passes));
        if self.was_passed() && hits * passes_per_hit.where_free <= passes {
            CellState::Free
        } else if self.was_hit() && hits * passes_per_hit.where_occupied >= passes {
            CellState::Occupied
        } else {
            CellState::Unknown
        }
    }

    /// Whether it is, or may be, part of a surface.
    #[must_use]
    pub fn may_be_surface(&self) -> bool {
        let (hits, passes) = (u16::from(self.hits), u16::from(self.passes));
        self.hits >= LEAST_HITS_OF_SURFACE && hits * PassesPerHit::OF_MEANS.where_occupied >= passes
    }

    /// Whether it was hit in enough cycles to be more than noise.
    #[must_use]
    pub fn was_hit(&self) -> bool {
        self.hits >= LEAST_HITS
    }

    /// Whether it was passed in enough cycles to be more than noise.
    #[must_use]
    pub fn was_passed(&self) -> bool {
        self.passes >= LEAST_PASSES
    }

    /// Whether it was hit in some cycles and free in others, again and again and for several cycles each time, as by a thing that comes
    /// and goes. Errors of depths and poses that are others in each cycle change it more often: with a share `p` of hits, cycles with
    /// hits come in runs of `1 / (1 - p)` and those with passes in runs of `1 / p`, which are not both longer than two.
    #[must_use]
    pub fn comes_and_goes(&self) -> bool {
        self.runs >= LEAST_RUNS && self.hits.min(self.passes) >= LEAST_RUN.saturating_mul(self.runs)
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

    /// Since when it has been occupied: the first of the hits that still count.
    #[must_use]
    pub fn occupied_since(&self) -> u32 {
        self.occupied_since
    }

    /// The last hit.
    #[must_use]
    pub fn last_hit(&self) -> u32 {
        self.last_hit
    }

    /// Whether further passes cannot change it: then it can be merged with its neighbours.
    pub(crate) fn is_free_for_long(&self) -> bool {
        self.hits == 0 && self.passes == MOST_CYCLES - 1 && self.held == Held::Nothing
    }

    /// The cell that replaces two that have long been free.
    pub(crate) fn merged(self, other: Self) -> Self {
        Self { passes: self.passes, seen: self.seen.max(other.seen), ..Self::default() }
    }
}

#[cfg(test)]
mod tests;
