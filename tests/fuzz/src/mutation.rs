//! Inputs from valid ones, by a seed and the number of the case alone.

/// No input is longer.
pub const MOST_BYTES: usize = 64 << 10;

/// Inputs are mutated so often at most; once in half of the cases.
const MOST_MUTATIONS: usize = 12;

/// Numbers at which readers err: the ends of each width, and one beyond.
const NUMBERS: [u64; 18] = [
    0,
    1,
    2,
    0x7f,
    0x80,
    0xff,
    0x100,
    0x7fff,
    0x8000,
    0xffff,
    0x1_0000,
    0x0fff_ffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x1_0000_0000,
    0x7fff_ffff_ffff_ffff,
    0xffff_ffff_ffff_ffff,
];

/// The same of floating-point numbers.
const FLOATS: [f64; 12] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    1e-300,
    1e18,
    1e38,
    1e300,
    f64::MAX,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::NAN,
];

/// The same of numbers in a text.
const TEXTS: [&str; 16] = [
    "0",
    "-1",
    "255",
    "65536",
    "2147483648",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "18446744073709551615",
    "99999999999999999999999",
    "1e308",
    "1e999",
    "-1e-999",
    "nan",
    "inf",
    "0x10",
];

/// Makes inputs.
pub struct Mutator {
    seed: u64,
    inputs: Vec<Vec<u8>>,
    words: &'static [&'static [u8]],
}

impl Mutator {
    /// One that begins with these inputs. `words` are put in here and there.
    #[must_use]
    pub fn new(seed: u64, inputs: Vec<Vec<u8>>, words: &'static [&'static [u8]]) -> Self {
        Self { seed, inputs, words }
    }

    /// The input of a case: the same whenever it is asked for. The first cases are the inputs as they are.
    #[must_use]
    pub fn input(&self, case: u64) -> Vec<u8> {
        if let Some(input) = usize::try_from(case).ok().and_then(|case| self.inputs.get(case)) {
            return input.clone();
        }
        let mut random = Random(self.seed ^ case.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut bytes = self.one(&mut random).to_vec();
        let mutations = if random.below(2) == 0 { 1 } else { 1 + random.below(MOST_MUTATIONS) };
        for _ in 0..mutations {
            self.mutate(&mut bytes, &mut random);
        }
        bytes.truncate(MOST_BYTES);
        bytes
    }

    fn one(&self, random: &mut Random) -> &[u8] {
        let at = random.below(self.inputs.len());
        self.inputs.get(at).map(Vec::as_slice).unwrap_or_default()
    }

    fn mutate(&self, bytes: &mut Vec<u8>, random: &mut Random) {
        let at = random.below(bytes.len());
        match random.below(16) {
            0 => overwrite(bytes, at, &[random.byte()]),
            1 | 2 => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte ^= 1 << random.below(8);
                }
            }
            3 | 4 => {
                let width = 1 << random.below(4);
                let number = random.number();
                let at = if random.below(4) == 0 { at } else { at & !(width - 1) };
                let little = number.to_le_bytes();
                let big = number.to_be_bytes();
                let number =
                    if random.below(4) == 0 { &big[8 - width..] } else { &little[..width] };
                overwrite(bytes, at, number);
            }
            5 => {
                let float = random.of(&FLOATS).copied().unwrap_or_default();
                if random.below(2) == 0 {
                    overwrite(bytes, at & !7, &float.to_le_bytes());
                } else {
                    overwrite(bytes, at & !3, &(float as f32).to_le_bytes());
                }
            }
            6 | 7 => replace_number(bytes, at, random),
            8 => bytes.truncate(at),
            9 => {
                let end = (at + 1 + random.length()).min(bytes.len());
                bytes.drain(at.min(end)..end);
            }
            10 => {
                let inserted: Vec<u8> =
                    (0..=random.length().min(64)).map(|_| random.byte()).collect();
                insert(bytes, at, &inserted);
            }
            11 => {
                // A part again, a few times or very often.
                let end = (at + 1 + random.length()).min(bytes.len());
                let part = bytes.get(at..end).unwrap_or_default().to_vec();
                let most = (MOST_BYTES - bytes.len().min(MOST_BYTES)) / part.len().max(1);
                let times = if random.below(32) == 0 { most } else { 1 + random.below(4) };
                insert(bytes, at, &part.repeat(times.min(most)));
            }
            12 => {
                // The rest of another input.
                let other = self.one(random);
                let from = random.below(other.len());
                bytes.truncate(at);
                bytes.extend(other.get(from..).unwrap_or_default());
            }
            13 => {
                let to = random.below(bytes.len());
                if at < bytes.len() && to < bytes.len() {
                    bytes.swap(at, to);
                }
            }
            _ => match random.of(self.words) {
                Some(word) if random.below(2) == 0 => insert(bytes, at, word),
                Some(word) => overwrite(bytes, at, word),
                None => overwrite(bytes, at, &[random.byte(), random.byte()]),
            },
        }
    }
}

fn overwrite(bytes: &mut [u8], at: usize, with: &[u8]) {
    for (byte, with) in bytes.iter_mut().skip(at).zip(with) {
        *byte = *with;
    }
}

fn insert(bytes: &mut Vec<u8>, at: usize, inserted: &[u8]) {
    let at = at.min(bytes.len());
    if bytes.len() + inserted.len() <= MOST_BYTES {
        bytes.splice(at..at, inserted.iter().copied());
    }
}

/// Another number in the place of the next one behind `at` that is written in digits.
fn replace_number(bytes: &mut Vec<u8>, at: usize, random: &mut Random) {
    let is_of_number = |byte: &u8| byte.is_ascii_digit() || matches!(byte, b'.' | b'-' | b'e');
    let rest = bytes.get(at..).unwrap_or_default();
    let Some(from) = rest.iter().position(u8::is_ascii_digit).map(|from| at + from) else { return };
    let length = bytes.get(from..).unwrap_or_default().iter().take_while(|byte| is_of_number(byte));
    let end = from + length.count();
    let text = match random.below(3) {
        0 => random.number().to_string(),
        _ => random.of(&TEXTS).copied().unwrap_or_default().to_owned(),
    };
    bytes.splice(from..end, text.bytes());
}

/// SplitMix64 (Steele et al., OOPSLA 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Below `end`; 0 where there is nothing below it.
    fn below(&mut self, end: usize) -> usize {
        (self.next() % (end.max(1) as u64)) as usize
    }

    fn byte(&mut self) -> u8 {
        self.next() as u8
    }

    /// A length, short more often than long.
    fn length(&mut self) -> usize {
        let most = 1 << self.below(11);
        self.below(most)
    }

    /// One of the numbers at which readers err, one next to it, or a small one.
    fn number(&mut self) -> u64 {
        let number = self.of(&NUMBERS).copied().unwrap_or_default();
        match self.below(4) {
            0 => number.wrapping_sub(1),
            1 => number.wrapping_add(1),
            2 => self.below(64) as u64,
            _ => number,
        }
    }

    fn of<'a, T>(&mut self, values: &'a [T]) -> Option<&'a T> {
        values.get(self.below(values.len()))
    }
}
