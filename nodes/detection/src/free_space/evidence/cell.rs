//! The evidence on one cell: how often a ray passed it, and how often a return was in it.

/// The number of cycles in the counts. Older cycles decay, so that a place changes its class in a bounded time, however
/// long it had the other class: background that was removed is undecided after 70 cycles and free after 160, 10 and
/// 23 s at 7 Hz.
const COUNTED_CYCLES: f32 = 100.0;
/// No cycle, no time.
const NEVER: u32 = 0;

/// Evidence on one cell; a cell never seen has none.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Cell {
    /// Cycles in which it was certainly free.
    passes: f32,
    /// Cycles with a return here that was not of a moving object.
    ends: f32,
    /// When it was last seen, in milliseconds of the evidence's own time, which begins at 1.
    seen_ms: u32,
    /// Since when a moving object has been here; 0 for none.
    claimed_ms: u32,
}

impl Cell {
    pub(super) const EMPTY: Self =
        Self { passes: 0.0, ends: 0.0, seen_ms: NEVER, claimed_ms: NEVER };

    /// Cycles in which it was certainly free, with decay.
    pub(super) fn passes(&self, now_ms: u32, memory_ms: u32) -> f32 {
        if self.is_stale(now_ms, memory_ms) { 0.0 } else { self.passes }
    }

    /// Cycles in which background was here, with decay.
    pub(super) fn ends(&self, now_ms: u32, memory_ms: u32) -> f32 {
        if self.is_stale(now_ms, memory_ms) { 0.0 } else { self.ends }
    }

    fn is_stale(&self, now_ms: u32, memory_ms: u32) -> bool {
        now_ms.saturating_sub(self.seen_ms) > memory_ms
    }

    /// Notes an observation: counts that are too old are reset first.
    fn see(&mut self, now_ms: u32, memory_ms: u32) {
        if self.is_stale(now_ms, memory_ms) {
            *self = Self::EMPTY;
        }
        self.seen_ms = now_ms;
    }

    fn fade(&mut self) {
        if self.passes + self.ends >= COUNTED_CYCLES {
            let share = (COUNTED_CYCLES - 1.0) / COUNTED_CYCLES;
            self.passes *= share;
            self.ends *= share;
        }
    }

    /// It was certainly free. Counts once a cycle, since cycles have different times.
    #[inline]
    pub(super) fn pass(&mut self, now_ms: u32, memory_ms: u32) {
        if self.seen_ms == now_ms {
            return;
        }
        self.see(now_ms, memory_ms);
        self.fade();
        self.passes += 1.0;
        self.claimed_ms = NEVER;
    }

    /// A return of background was here. Counts once a cycle, and not if the same cycle certainly observed free space.
    pub(super) fn end(&mut self, now_ms: u32, memory_ms: u32) {
        if self.seen_ms == now_ms {
            return;
        }
        self.see(now_ms, memory_ms);
        self.fade();
        self.ends += 1.0;
    }

    /// A moving object is here. After `stopped_ms` without free space observed in between it is background.
    pub(super) fn claim(&mut self, now_ms: u32, memory_ms: u32, stopped_ms: u32) {
        self.see(now_ms, memory_ms);
        if self.claimed_ms == NEVER {
            self.claimed_ms = now_ms;
        } else if now_ms.saturating_sub(self.claimed_ms) >= stopped_ms {
            *self = Self { passes: 0.0, ends: COUNTED_CYCLES, seen_ms: now_ms, claimed_ms: NEVER };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MEMORY_MS: u32 = 120_000;

    #[test]
    fn it_counts_once_a_cycle_and_changes_its_class_in_time() {
        let mut cell = Cell::EMPTY;
        for cycle in 1..=1000 {
            cell.end(cycle * 100, MEMORY_MS);
            cell.end(cycle * 100, MEMORY_MS);
        }
        assert!((cell.ends(100_000, MEMORY_MS) - COUNTED_CYCLES).abs() < 1.0);
        let mut cycles = 0;
        while cell.ends > 0.1 * cell.passes {
            cycles += 1;
            cell.pass(100_000 + cycles * 100, MEMORY_MS);
        }
        assert!((150..300).contains(&cycles), "free again after {cycles} cycles");
    }

    #[test]
    fn a_stopped_object_becomes_background_unless_the_place_is_observed_free() {
        let mut cell = Cell::EMPTY;
        cell.pass(1, MEMORY_MS);
        for cycle in 1..=59 {
            cell.claim(cycle * 1000, MEMORY_MS, 60_000);
        }
        assert_eq!(cell.ends, 0.0);
        cell.pass(59_500, MEMORY_MS);
        cell.claim(60_000, MEMORY_MS, 60_000);
        cell.claim(119_000, MEMORY_MS, 60_000);
        assert_eq!(cell.ends, 0.0);
        cell.claim(120_000, MEMORY_MS, 60_000);
        assert_eq!((cell.passes, cell.ends), (0.0, COUNTED_CYCLES));
    }

    #[test]
    fn old_evidence_is_reset() {
        let mut cell = Cell::EMPTY;
        cell.pass(1, MEMORY_MS);
        assert_eq!(cell.passes(MEMORY_MS + 1, MEMORY_MS), 1.0);
        assert_eq!(cell.passes(MEMORY_MS + 2, MEMORY_MS), 0.0);
        cell.end(MEMORY_MS + 2, MEMORY_MS);
        assert_eq!((cell.passes, cell.ends), (0.0, 1.0));
    }
}
