//! Descriptors that are nearly the same, found without comparing all.

/// The bits of a word.
const WORD_BITS: usize = 16;
/// Words of a descriptor: each has a table. That of two descriptors that differ in an eighth of their bits one word at least
/// is the same but for one bit has a probability of 95 %; with 16 words that must be the same altogether it is 87 %, and the
/// index takes twice the memory.
const WORDS: usize = 6;
/// Values of a word.
const VALUES: usize = 1 << WORD_BITS;
/// No entry.
const NONE: u32 = u32::MAX;
/// The entry of a descriptor in the index: the next of each word.
pub(super) const ENTRY_BYTES: usize = WORDS * size_of::<u32>();

/// A descriptor of 256 bits, of a corner or of a segment.
pub(super) type Bits = [u64; 4];

/// An index of similar descriptors: by numbers, the first one 0. The descriptors themselves are their owner's.
#[derive(Clone, Debug)]
pub(super) struct Index {
    /// The next older entry of the same value, by words.
    older: Vec<[u32; WORDS]>,
    /// The newest entry of each value of each word.
    heads: Vec<u32>,
}

/// The scratch memory of a search: one for many searches.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    /// The last search that visited each entry.
    shared: Vec<u32>,
    search: u32,
}

impl Index {
    pub(super) fn new() -> Self {
        Self { older: Vec::new(), heads: vec![NONE; WORDS * VALUES] }
    }

    /// How many entries there are.
    pub(super) fn len(&self) -> usize {
        self.older.len()
    }

    /// Forgets all of them.
    pub(super) fn clear(&mut self) {
        self.older.clear();
        self.heads.fill(NONE);
    }

    /// Takes a descriptor in, under the next number. What does not fit any more is left out.
    pub(super) fn insert(&mut self, bits: &Bits) {
        let Some(entry) = u32::try_from(self.len()).ok().filter(|entry| *entry != NONE) else {
            return;
        };
        let mut older = [NONE; WORDS];
        for (word, older) in older.iter_mut().enumerate() {
            let head = &mut self.heads[word * VALUES + value(bits, word)];
            *older = std::mem::replace(head, entry);
        }
        self.older.push(older);
    }

    /// Visits each entry once that has a word in common with this descriptor but for one bit. Of each value no more than
    /// `most` are visited, the newest first: some descriptors are everywhere, and distinguish nothing.
    pub(super) fn search(
        &self,
        bits: &Bits,
        most: usize,
        scratch: &mut Scratch,
        mut meet: impl FnMut(u32),
    ) {
        scratch.shared.resize(self.len(), 0);
        scratch.search = scratch.search.wrapping_add(1);
        if scratch.search == 0 {
            // All numbers are used up.
            scratch.shared.fill(0);
            scratch.search = 1;
        }
        for word in 0..WORDS {
            let own = value(bits, word);
            for value in near(own) {
                let mut entry = self.heads[word * VALUES + value];
                for _ in 0..most {
                    let Some(older) = self.older.get(entry as usize) else { break };
                    let shared = &mut scratch.shared[entry as usize];
                    if *shared != scratch.search {
                        *shared = scratch.search;
                        meet(entry);
                    }
                    entry = older[word];
                }
            }
        }
    }
}

/// The value of a word. Words are made of the first bits of a descriptor: those of corners are sorted, the first ones depend
/// least on each other, so that entries spread over many values. Neighbours go to different words.
fn value(bits: &Bits, word: usize) -> usize {
    let mut value = 0;
    for place in 0..WORD_BITS {
        let bit = place * WORDS + word;
        value |= ((bits[bit / 64] >> (bit % 64)) as usize & 1) << place;
    }
    value
}

/// A value, and those that differ from it in one bit.
fn near(value: usize) -> impl Iterator<Item = usize> {
    std::iter::once(value).chain((0..WORD_BITS).map(move |bit| value ^ (1 << bit)))
}

/// In how many bits two descriptors differ.
pub(super) fn distance(one: &Bits, other: &Bits) -> u32 {
    one.iter().zip(other).map(|(one, other)| (one ^ other).count_ones()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solve::testing::Random;

    #[test]
    fn an_entry_that_shares_a_word_but_for_one_bit_is_visited_once_and_no_other() {
        let mut random = Random::new(1);
        let mut index = Index::new();
        // A base, and others that differ from it in up to 80 bits.
        let base: Bits = std::array::from_fn(|_| random.bits());
        let mut all = Vec::new();
        for _ in 0..300 {
            let mut bits = base;
            for _ in 0..random.between(0.0, 80.0) as usize {
                let bit = random.bits() % 256;
                bits[(bit / 64) as usize] ^= 1 << (bit % 64);
            }
            index.insert(&bits);
            all.push(bits);
        }
        let shares = |bits: &Bits| {
            let off = |word| (value(bits, word) ^ value(&base, word)).count_ones();
            (0..WORDS).any(|word| off(word) <= 1)
        };
        let expected: Vec<u32> =
            (0_u32..).zip(&all).filter(|(_, bits)| shares(bits)).map(|(entry, _)| entry).collect();
        assert!(expected.len() > 50 && expected.len() < 290, "{}", expected.len());
        let mut scratch = Scratch::default();
        for _ in 0..2 {
            let mut shared = Vec::new();
            index.search(&base, usize::MAX, &mut scratch, |entry| shared.push(entry));
            shared.sort_unstable();
            assert_eq!(shared, expected);
        }
        index.clear();
        index.search(&base, usize::MAX, &mut scratch, |entry| panic!("{entry} is gone"));
        assert_eq!(index.len(), 0);
    }

    #[test]
    fn of_a_look_that_is_everywhere_only_the_newest_are_looked_at() {
        let mut index = Index::new();
        for _ in 0..100 {
            index.insert(&[0; 4]);
        }
        let (mut scratch, mut shared) = (Scratch::default(), Vec::new());
        index.search(&[0; 4], 10, &mut scratch, |entry| shared.push(entry));
        assert_eq!(shared, (90..100).rev().collect::<Vec<_>>());
    }
}
