//! What is known of one cell: how often it was passed, how often something ended in it.

/// Cycles that the counts stand for. Older ones fade as new ones come, so that a place changes its nature in
/// time, however long it was otherwise: background that has gone is in doubt after 70 cycles and free after 160, 10 and
/// 23 s at 7 Hz.
const COUNTED_CYCLES: f32 = 100.0;
/// No cycle, no time.
const NEVER: u32 = 0;

/// Evidence on one cell; a cell never seen has none.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Cell {
    /// Cycles in which it was free for sure.
    passes: f32,
    /// Cycles in which something that was no moving object ended here.
    ends: f32,
    /// When it was last seen, in milliseconds of the evidence's own time, which begins at 1.
    seen_ms: u32,
    /// Since when a moving object has been standing here; 0 for none.
    claimed_ms: u32,
}

impl Cell {
    pub(super) const EMPTY: Self =
        Self { passes: 0.0, ends: 0.0, seen_ms: NEVER, claimed_ms: NEVER };

    /// Cycles in which it was free for sure, faded.
    pub(super) fn passes(&self, now_ms: u32, memory_ms: u32) -> f32 {
        if self.is_stale(now_ms, memory_ms) { 0.0 } else { self.passes }
    }

    /// Cycles in which background was here, faded.
    pub(super) fn ends(&self, now_ms: u32, memory_ms: u32) -> f32 {
        if self.is_stale(now_ms, memory_ms) { 0.0 } else { self.ends }
    }

    fn is_stale(&self, now_ms: u32, memory_ms: u32) -> bool {
        now_ms.saturating_sub(self.seen_ms) > memory_ms
    }

    /// Something was seen here: what is too old is forgotten first.
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

    /// It was free for sure. Counts once a cycle: cycles have different times.
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

    /// Background ended here. Counts once a cycle, and not where the same cycle saw free space for sure.
    pub(super) fn end(&mut self, now_ms: u32, memory_ms: u32) {
        if self.seen_ms == now_ms {
            return;
        }
        self.see(now_ms, memory_ms);
        self.fade();
        self.ends += 1.0;
    }

    /// A moving object stands here. After `stopped_ms` without the place seen free again it is background.
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
    fn it_counts_once_a_cycle_and_changes_its_nature_in_time() {
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
    fn what_stands_too_long_is_background_unless_the_place_is_seen_free_between() {
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
    fn what_is_too_old_is_forgotten() {
        let mut cell = Cell::EMPTY;
        cell.pass(1, MEMORY_MS);
        assert_eq!(cell.passes(MEMORY_MS + 1, MEMORY_MS), 1.0);
        assert_eq!(cell.passes(MEMORY_MS + 2, MEMORY_MS), 0.0);
        cell.end(MEMORY_MS + 2, MEMORY_MS);
        assert_eq!((cell.passes, cell.ends), (0.0, 1.0));
    }
}
