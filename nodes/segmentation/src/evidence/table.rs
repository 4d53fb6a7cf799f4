//! The table of the evidence's voxels: open addressing, bounded, in no order that could reach a result.

use geometry::VoxelKey;

/// Cells along each axis: 21 bits, 84 km either way at the thesis' edge.
const AXIS_BITS: u32 = 21;
const AXIS_OFFSET: i64 = 1 << (AXIS_BITS - 1);
/// Set in every key, so that 0 marks an empty slot.
const KEY_MARK: u64 = 1 << 63;
/// Slots of a new table.
const FIRST_SLOTS: usize = 1 << 14;
/// A table has at least this many slots a cell: most cells are found at once.
const SLOTS_PER_CELL: usize = 2;
/// The share of the cells that is dropped when the table is full, so that dropping is rare.
const DROPPED_SHARE: usize = 4;

/// What is known of one voxel.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Cell {
    key: u64,
    /// The cycle that saw it last, counted from 1.
    pub(super) seen: u32,
    /// When it was first hit, since the start.
    pub(super) first_hit_ms: u32,
    /// The same of the last time.
    pub(super) last_hit_ms: u32,
    /// Cycles in which a static point ended in it; fading.
    pub(super) hits: u16,
    /// Cycles in which it was only passed; fading.
    pub(super) passes: u16,
}

/// The key of a voxel, or `None` beyond the table's reach.
#[inline]
pub(super) fn key_of(voxel: VoxelKey) -> Option<u64> {
    let mut key = KEY_MARK;
    for (axis, cell) in (0..).zip([voxel.x, voxel.y, voxel.z].map(i64::from)) {
        if !(-AXIS_OFFSET..AXIS_OFFSET).contains(&cell) {
            return None;
        }
        key |= ((cell + AXIS_OFFSET) as u64) << (axis * AXIS_BITS);
    }
    Some(key)
}

/// Cells by key, at most so many.
#[derive(Clone, Debug)]
pub(super) struct CellTable {
    slots: Vec<Cell>,
    len: usize,
    max_cells: usize,
    cycle: u32,
    /// Nothing more can be dropped in this cycle: all cells are of it.
    full: bool,
}

impl CellTable {
    pub(super) fn new(max_cells: usize) -> Self {
        Self { slots: vec![Cell::default(); FIRST_SLOTS], len: 0, max_cells, cycle: 0, full: false }
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// The memory that the table takes at most.
    pub(super) fn max_bytes(&self) -> usize {
        let slots = self.max_cells.saturating_mul(SLOTS_PER_CELL).max(FIRST_SLOTS);
        slots.checked_next_power_of_two().unwrap_or(slots).saturating_mul(size_of::<Cell>())
    }

    /// The start of the times is so much later.
    pub(super) fn start_later(&mut self, later_ms: u32) {
        for cell in &mut self.slots {
            for hit_ms in [&mut cell.first_hit_ms, &mut cell.last_hit_ms] {
                *hit_ms = hit_ms.saturating_sub(later_ms);
            }
        }
    }

    pub(super) fn begin_cycle(&mut self) {
        self.cycle = self.cycle.saturating_add(1);
        self.full = false;
    }

    /// What [`Cell::seen`] is set to in this cycle.
    pub(super) fn mark(&self) -> u32 {
        self.cycle
    }

    #[inline]
    pub(super) fn get(&self, key: u64) -> Option<&Cell> {
        let cell = &self.slots[self.slot_of(key)];
        (cell.key == key).then_some(cell)
    }

    /// The cell of a key, made if it is not there; `None` where the table is full of cells of this
    /// cycle.
    #[inline]
    pub(super) fn entry(&mut self, key: u64) -> Option<&mut Cell> {
        let slot = self.slot_of(key);
        if self.slots[slot].key == key {
            return Some(&mut self.slots[slot]);
        }
        self.insert(key)
    }

    #[inline]
    fn slot_of(&self, key: u64) -> usize {
        let last = self.slots.len() - 1;
        let mut slot = hash(key) as usize & last;
        // Ends: at least half of the slots are empty.
        while self.slots[slot].key != key && self.slots[slot].key != 0 {
            slot = (slot + 1) & last;
        }
        slot
    }

    fn insert(&mut self, key: u64) -> Option<&mut Cell> {
        if self.len >= self.max_cells {
            self.drop_longest_unseen();
            if self.len >= self.max_cells {
                return None;
            }
        }
        if (self.len + 1) * SLOTS_PER_CELL > self.slots.len() {
            self.rebuild(self.slots.len() * 2, 0);
        }
        self.len += 1;
        let slot = self.slot_of(key);
        let cell = &mut self.slots[slot];
        *cell = Cell { key, ..Cell::default() };
        Some(cell)
    }

    /// Drops the cells that were seen longest ago, a quarter of all or as many more as were seen
    /// together with these; none of this cycle.
    fn drop_longest_unseen(&mut self) {
        if self.full {
            return;
        }
        let mut seen: Vec<u32> =
            self.slots.iter().filter(|cell| cell.key != 0).map(|cell| cell.seen).collect();
        let rank = seen.len() / DROPPED_SHARE;
        if rank >= seen.len() {
            return;
        }
        let (_, &mut quarter, _) = seen.select_nth_unstable(rank);
        self.rebuild(self.slots.len(), quarter.saturating_add(1).min(self.cycle));
        self.full = self.len >= self.max_cells;
    }

    /// Moves the cells last seen in `first_kept` or later to a table of so many slots.
    fn rebuild(&mut self, slots: usize, first_kept: u32) {
        let old = std::mem::replace(&mut self.slots, vec![Cell::default(); slots]);
        self.len = 0;
        for cell in old.into_iter().filter(|cell| cell.key != 0 && cell.seen >= first_kept) {
            let slot = self.slot_of(cell.key);
            self.slots[slot] = cell;
            self.len += 1;
        }
    }
}

/// Spreads neighbouring voxels over the table: the multiplication of Fibonacci hashing (Knuth, The Art of
/// Computer Programming 3, 6.4) and its upper bits. Fixed, not seeded.
#[inline]
fn hash(key: u64) -> u64 {
    const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;
    key.wrapping_mul(GOLDEN) >> 32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key_at([x, y, z]: [i32; 3]) -> Option<u64> {
        key_of(VoxelKey { x, y, z })
    }

    #[test]
    fn the_bound_holds_and_the_longest_unseen_go_first() {
        let mut table = CellTable::new(1_000);
        for cycle in 0..50_i32 {
            table.begin_cycle();
            let mark = table.mark();
            for place in 0..100 {
                let key = key_at([cycle, place, -3]).unwrap();
                table.entry(key).unwrap().seen = mark;
            }
            assert!(table.len() <= 1_000);
            // What was seen last is all there.
            for (ago, place) in [(0, 0), (1, 99), (4, 50)] {
                if cycle >= ago {
                    assert!(table.get(key_at([cycle - ago, place, -3]).unwrap()).is_some());
                }
            }
        }
        assert!(table.get(key_at([0, 0, -3]).unwrap()).is_none());
        assert!(table.slots.len() * size_of::<Cell>() <= table.max_bytes());
    }

    #[test]
    fn a_cycle_that_sees_more_than_there_is_room_for_keeps_what_it_has() {
        let mut table = CellTable::new(100);
        table.begin_cycle();
        let kept = (0..1_000)
            .filter(|&x| {
                let mark = table.mark();
                table.entry(key_at([x, 0, 0]).unwrap()).is_some_and(|cell| {
                    cell.seen = mark;
                    true
                })
            })
            .count();
        assert_eq!((kept, table.len()), (100, 100));
        table.begin_cycle();
        assert!(table.entry(key_at([-1, 0, 0]).unwrap()).is_some());
    }

    #[test]
    fn keys_are_distinct_and_end_at_the_reach() {
        assert_ne!(key_at([1, 0, 0]), key_at([0, 1, 0]));
        assert_ne!(key_at([-1, 0, 0]), key_at([0, -1, 0]));
        assert_eq!(key_at([1 << (AXIS_BITS - 1), 0, 0]), None);
        assert_eq!(key_at([0, i32::MIN, 0]), None);
        assert!(key_at([-(1 << (AXIS_BITS - 1)), (1 << (AXIS_BITS - 1)) - 1, 0]).is_some());
    }
}
