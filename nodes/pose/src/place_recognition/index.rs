//! Descriptors that are nearly the same, found without comparing all.

/// The bits of a word.
const WORD_BITS: usize = 16;
/// Words of a descriptor: each has a table.
const WORDS: usize = 256 / WORD_BITS;
/// Values of a word.
const VALUES: usize = 1 << WORD_BITS;
/// No entry.
const NONE: u32 = u32::MAX;

/// A descriptor of 256 bits, of a corner or of a segment.
pub(super) type Bits = [u64; 4];

/// Descriptors, each with whose it is.
#[derive(Clone, Debug)]
pub(super) struct Index {
    entries: Vec<Entry>,
    /// The newest entry of each value of each word.
    heads: Vec<u32>,
}

#[derive(Clone, Debug)]
struct Entry {
    bits: Bits,
    owner: u32,
    /// The next older entry of the same value, by words.
    next: [u32; WORDS],
}

/// A descriptor that is nearly the same as one that was looked for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Found {
    pub(super) owner: u32,
    /// The how manyth of all descriptors it is.
    pub(super) entry: u32,
    pub(super) distance: u32,
}

/// What a search works on: one for many searches.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    /// Which search met each entry last.
    met: Vec<u32>,
    search: u32,
}

impl Index {
    pub(super) fn new() -> Self {
        Self { entries: Vec::new(), heads: vec![NONE; WORDS * VALUES] }
    }

    /// How many descriptors there are, of owners that are gone, too.
    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    /// Takes a descriptor in. What does not fit any more is left out.
    pub(super) fn insert(&mut self, bits: &Bits, owner: u32) {
        let Some(index) = u32::try_from(self.entries.len()).ok().filter(|index| *index != NONE)
        else {
            return;
        };
        let mut next = [NONE; WORDS];
        for (word, next) in next.iter_mut().enumerate() {
            let head = &mut self.heads[slot(bits, word)];
            *next = *head;
            *head = index;
        }
        self.entries.push(Entry { bits: *bits, owner, next });
    }

    /// Drops all entries of owners that `keeps` does not keep.
    pub(super) fn retain(&mut self, keeps: impl Fn(u32) -> bool) {
        let entries = std::mem::take(&mut self.entries);
        self.heads.fill(NONE);
        for entry in entries.into_iter().filter(|entry| keeps(entry.owner)) {
            self.insert(&entry.bits, entry.owner);
        }
    }

    /// Those that share a word and differ in no more than `max_distance` bits. Of each value no more than `most` are
    /// looked at, the newest first: some looks are everywhere, and say nothing.
    pub(super) fn search(
        &self,
        bits: &Bits,
        max_distance: u32,
        most: usize,
        scratch: &mut Scratch,
        found: &mut Vec<Found>,
    ) {
        found.clear();
        scratch.met.resize(self.entries.len(), 0);
        scratch.search = scratch.search.wrapping_add(1);
        if scratch.search == 0 {
            // All numbers are used up.
            scratch.met.fill(0);
            scratch.search = 1;
        }
        for word in 0..WORDS {
            let mut index = self.heads[slot(bits, word)];
            for _ in 0..most {
                let Some(entry) = self.entries.get(index as usize) else { break };
                let met = &mut scratch.met[index as usize];
                if *met != scratch.search {
                    *met = scratch.search;
                    let distance = distance(bits, &entry.bits);
                    if distance <= max_distance {
                        found.push(Found { owner: entry.owner, entry: index, distance });
                    }
                }
                index = entry.next[word];
            }
        }
    }
}

/// Where the newest entry with this word is kept. A word is made of bits that lie far apart: neighbouring ones are not
/// independent of each other, and most entries would have few values.
fn slot(bits: &Bits, word: usize) -> usize {
    let mut value = 0;
    for place in 0..WORD_BITS {
        let bit = place * WORDS + word;
        value |= ((bits[bit / 64] >> (bit % 64)) as usize & 1) << place;
    }
    word * VALUES + value
}

fn distance(one: &Bits, other: &Bits) -> u32 {
    one.iter().zip(other).map(|(one, other)| (one ^ other).count_ones()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solve::testing::Draw;

    #[test]
    fn what_shares_a_word_and_is_near_is_found_and_nothing_else() {
        let mut draw = Draw::new(1);
        let mut index = Index::new();
        // A base, and others that differ from it in up to 80 bits.
        let base: Bits = std::array::from_fn(|_| draw.bits());
        let mut all = Vec::new();
        for owner in 0..300 {
            let mut bits = base;
            for _ in 0..draw.uniform(0.0, 80.0) as usize {
                let bit = draw.bits() % 256;
                bits[(bit / 64) as usize] ^= 1 << (bit % 64);
            }
            index.insert(&bits, owner);
            all.push(bits);
        }
        let shares = |bits: &Bits| (0..WORDS).any(|word| slot(bits, word) == slot(&base, word));
        let expected = |keeps: &dyn Fn(u32) -> bool| -> Vec<u32> {
            let near = (0_u32..).zip(&all).filter(|(owner, bits)| {
                keeps(*owner) && shares(bits) && distance(bits, &base) <= 40
            });
            near.map(|(owner, _)| owner).collect()
        };
        let (mut scratch, mut found) = (Scratch::default(), Vec::new());
        let mut search = |index: &Index| {
            index.search(&base, 40, usize::MAX, &mut scratch, &mut found);
            let mut owners: Vec<u32> = found.iter().map(|found| found.owner).collect();
            owners.sort_unstable();
            owners
        };
        assert!(expected(&|_| true).len() > 50);
        assert_eq!(search(&index), expected(&|_| true));
        assert_eq!(search(&index), expected(&|_| true));
        let is_even = |owner: u32| owner.is_multiple_of(2);
        index.retain(is_even);
        assert_eq!(search(&index), expected(&is_even));
        assert_eq!(index.len(), 150);
    }

    #[test]
    fn of_a_look_that_is_everywhere_only_the_newest_are_looked_at() {
        let mut index = Index::new();
        for owner in 0..100 {
            index.insert(&[0; 4], owner);
        }
        let (mut scratch, mut found) = (Scratch::default(), Vec::new());
        index.search(&[0; 4], 0, 10, &mut scratch, &mut found);
        let owners: Vec<u32> = found.iter().map(|found| found.owner).collect();
        assert_eq!(owners, (90..100).rev().collect::<Vec<_>>());
    }
}
