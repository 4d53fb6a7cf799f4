//! The position of a voxel's key in a table.

use std::hash::{BuildHasherDefault, Hash, Hasher};

use super::VoxelKey;

/// For tables whose keys are [`VoxelKey`]s, or other keys that hash as one.
pub type BuildVoxelHasher = BuildHasherDefault<VoxelHasher>;

/// Takes a key as [`VoxelKey`] has spread it. The standard hasher is seeded at random and made against adversaries; a map
/// of surfaces needs neither, and this is a few times faster.
#[derive(Clone, Copy, Debug, Default)]
pub struct VoxelHasher {
    state: u64,
}

impl VoxelKey {
    /// Spreads neighbouring keys over 64 bits. Fixed, not seeded: it decides where an entry is in memory, and must not
    /// decide what comes out.
    #[inline]
    pub(super) fn spread(self) -> u64 {
        // Odd numbers with their bits spread evenly: 2^64 divided by the golden ratio, and a constant of L'Ecuyer's
        // tables of multipliers.
        const FIRST: u64 = 0x9e37_79b9_7f4a_7c15;
        const SECOND: u64 = 0xd1b5_4a32_d192_ed03;
        let plane = u64::from(self.x as u32) << 32 | u64::from(self.y as u32);
        let mixed = (plane.wrapping_mul(FIRST) ^ u64::from(self.z as u32)).wrapping_mul(SECOND);
        // A table takes its position from the low bits and its tags from the high ones, and a product mixes upwards only.
        mixed ^ (mixed >> 32)
    }
}

impl Hash for VoxelKey {
    #[inline]
    fn hash<H: Hasher>(&self, state: &mut H) {
        state.write_u64(self.spread());
    }
}

impl Hasher for VoxelHasher {
    #[inline]
    fn write_u64(&mut self, spread: u64) {
        self.state = self.state.rotate_left(32) ^ spread;
    }

    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            let key = VoxelKey { x: i32::from(*byte), y: 0, z: 0 };
            self.write_u64(key.spread());
        }
    }

    #[inline]
    fn finish(&self) -> u64 {
        self.state
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;
    use std::hash::BuildHasher;

    use super::*;

    #[test]
    fn a_room_of_keys_spreads_over_the_table() {
        let hasher = BuildVoxelHasher::default();
        let keys =
            (-40..40).flat_map(|x| (-40..40).flat_map(move |y| (-10..10).map(move |z| (x, y, z))));
        let hashes: Vec<u64> =
            keys.map(|(x, y, z)| hasher.hash_one(VoxelKey { x, y, z })).collect();
        let distinct: HashSet<u64> = hashes.iter().copied().collect();
        assert_eq!(distinct.len(), hashes.len());
        // 128,000 keys in 2^17 positions: by chance 62 % of the positions are taken; half is still good. The same of
        // the upper bits.
        for shift in [0, 47] {
            let positions: HashSet<u64> =
                hashes.iter().map(|hash| hash >> shift & 0x1_ffff).collect();
            assert!(positions.len() > 65_536, "{} positions from bit {shift}", positions.len());
        }
    }
}
