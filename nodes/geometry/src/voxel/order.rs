//! The order of cells.

use super::{VoxelBox, VoxelKey};

/// The place of each key in the ascending order of all of them. No two keys may be equal.
pub(super) fn ranks(keys: &[VoxelKey]) -> Vec<u32> {
    match KeyBox::around(keys) {
        Some(bounds) => ranks_by_digits(keys, &bounds),
        None => ranks_by_comparison(keys),
    }
}

/// The smallest box of cells around some keys.
struct KeyBox {
    min: VoxelKey,
    y_cells: u64,
    z_cells: u64,
    /// Bits of the largest index.
    bits: u32,
}

impl KeyBox {
    /// `None` around nothing, or where the box has more cells than 64 bits can count.
    fn around(keys: &[VoxelKey]) -> Option<Self> {
        let VoxelBox { least: min, most: max } = VoxelBox::around(keys)?;
        let cells = |min: i32, max: i32| u64::from(max.abs_diff(min)) + 1;
        let (y_cells, z_cells) = (cells(min.y, max.y), cells(min.z, max.z));
        let all_cells = cells(min.x, max.x).checked_mul(y_cells)?.checked_mul(z_cells)?;
        Some(Self { min, y_cells, z_cells, bits: u64::BITS - (all_cells - 1).leading_zeros() })
    }

    /// Numbers the cells of the box in the order of their keys.
    fn index(&self, key: &VoxelKey) -> u64 {
        let x = u64::from(key.x.abs_diff(self.min.x));
        let y = u64::from(key.y.abs_diff(self.min.y));
        let z = u64::from(key.z.abs_diff(self.min.z));
        (x * self.y_cells + y) * self.z_cells + z
    }
}

/// Sorts by the cells' indices, from the lowest digit to the highest. A room's cells take three
/// passes, a fifth of the time of comparing.
fn ranks_by_digits(keys: &[VoxelKey], bounds: &KeyBox) -> Vec<u32> {
    const DIGIT_BITS: u32 = 11;
    const DIGITS: usize = 1 << DIGIT_BITS;
    let mut sorted: Vec<(u64, u32)> = keys.iter().map(|key| bounds.index(key)).zip(0..).collect();
    let mut scratch = vec![(0, 0); sorted.len()];
    for shift in (0..bounds.bits).step_by(DIGIT_BITS as usize) {
        let digit = |cell: u64| (cell >> shift) as usize % DIGITS;
        let mut places = [0; DIGITS];
        for &(cell, _) in &sorted {
            places[digit(cell)] += 1;
        }
        let mut place = 0;
        for count in &mut places {
            place += std::mem::replace(count, place);
        }
        for &entry in &sorted {
            let place = &mut places[digit(entry.0)];
            scratch[*place] = entry;
            *place += 1;
        }
        std::mem::swap(&mut sorted, &mut scratch);
    }
    inverse(sorted.iter().map(|&(_, position)| position))
}

fn ranks_by_comparison(keys: &[VoxelKey]) -> Vec<u32> {
    let mut sorted: Vec<(VoxelKey, u32)> = keys.iter().copied().zip(0..).collect();
    sorted.sort_unstable();
    inverse(sorted.iter().map(|&(_, position)| position))
}

/// The rank of each position, from the positions in order of rank.
fn inverse(positions: impl ExactSizeIterator<Item = u32>) -> Vec<u32> {
    let mut ranks = vec![0; positions.len()];
    for (rank, position) in (0..).zip(positions) {
        ranks[position as usize] = rank;
    }
    ranks
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn both_orders_rank_alike(
            cells in proptest::collection::btree_set(proptest::array::uniform3(
                prop_oneof![10 => -40..40_i32, 1 => any::<i32>()]), 0..200),
            turn in any::<prop::sample::Index>(),
        ) {
            let sorted: Vec<VoxelKey> = cells.iter().map(|&[x, y, z]| VoxelKey { x, y, z }).collect();
            let mut keys = sorted.clone();
            if !keys.is_empty() {
                keys.rotate_left(turn.index(sorted.len()));
                keys.reverse();
            }
            let ranks = ranks(&keys);
            prop_assert_eq!(&ranks, &ranks_by_comparison(&keys));
            for (key, rank) in keys.iter().zip(ranks) {
                prop_assert_eq!(key, &sorted[rank as usize]);
            }
        }
    }

    #[test]
    fn a_box_too_large_to_count_is_ranked_by_comparison() {
        let corner = |value| VoxelKey { x: value, y: value, z: value };
        let keys = [corner(i32::MAX), corner(0), corner(i32::MIN)];
        assert!(KeyBox::around(&keys).is_none());
        assert_eq!(ranks(&keys), [2, 1, 0]);
        assert!(ranks(&[]).is_empty());
        assert_eq!(ranks(&keys[..1]), [0]);
    }
}
