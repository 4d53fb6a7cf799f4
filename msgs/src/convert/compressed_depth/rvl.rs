//! RVL, the lossless code for depth images of A. D. Wilson, "Fast Lossless Depth Image Compression",
//! ISS 2017: runs of pixels without a measurement, and differences between those with one.
//!
//! The pixels, row after row, are taken as runs: a number says how many are 0, the next one how many
//! are not, and then each of those is written as its difference from the one before it that was not 0,
//! folded so that small ones of either sign are small (0, -1, 1, -2, .. become 0, 1, 2, 3, ..). A
//! number is written in digits of three bits, the lowest first, each in a nibble of which the highest
//! bit says that another digit follows. Nibbles fill words of 32 bits from the highest one; words stand
//! little endian, and the last is filled up with zeros.

#[cfg(test)]
mod tests;

/// Digits of a number have three bits, and a nibble has one more.
const DIGIT_BITS: u32 = 3;
const DIGIT_MASK: u32 = 7;
const NIBBLE_BITS: u32 = 4;
/// Another digit follows.
const MORE: u32 = 8;
const WORD_BYTES: usize = 4;
const WORD_NIBBLES: u32 = 8;

/// A difference of 16 bits, folded, has 17 bits: six digits.
const DIFFERENCE_DIGITS: u32 = 6;
/// Numbers below this one are looked up: those of three digits and fewer, nearly all of them.
const LOOKED_UP: usize = 512;
/// The digits of each as in the stream.
const CODES: [u16; LOOKED_UP] = codes();

/// Why a stream is not the image that it claims to be.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum RvlError {
    /// The data ends before the image does.
    #[error("the stream ends at pixel {at_px} of {pixels}")]
    Ends {
        /// The pixels before it are known.
        at_px: usize,
        /// Those of the image.
        pixels: usize,
    },
    /// A run extends beyond the image.
    #[error("a run of {run} pixels starts at pixel {at_px} of {pixels}")]
    Run {
        /// Where it starts.
        at_px: usize,
        /// How long it claims to be.
        run: u64,
        /// Pixels of the image.
        pixels: usize,
    },
    /// A number is longer than any that an image needs.
    #[error("a number at pixel {at_px} has more than {most_digits} digits")]
    Number {
        /// Its position.
        at_px: usize,
        /// How long it can be.
        most_digits: u32,
    },
}

/// Appends the stream of an image.
pub(super) fn compress(pixels: &[u16], data: &mut Vec<u8>) {
    let mut writer = NibbleWriter { data, pending: 0, nibbles: 0 };
    let mut rest = pixels;
    let mut last = 0;
    while !rest.is_empty() {
        let zeros = rest.iter().position(|pixel| *pixel != 0).unwrap_or(rest.len());
        let (_, from_measured) = rest.split_at(zeros);
        let run = from_measured.iter().position(|pixel| *pixel == 0);
        let (measured, behind) = from_measured.split_at(run.unwrap_or(from_measured.len()));
        writer.run(zeros);
        writer.run(measured.len());
        for pixel in measured {
            let pixel = i32::from(*pixel);
            writer.number(fold(pixel - last));
            last = pixel;
        }
        rest = behind;
    }
    writer.finish();
}

/// The pixels of an image of `pixels` of them. Data behind it in the stream are ignored.
/// Differences wrap at 16 bits as those of signed writers do.
///
/// # Errors
/// When the stream is another image's, or damaged.
pub(super) fn decompress(stream: &[u8], pixels: usize) -> Result<Vec<u16>, RvlError> {
    // Zeroed memory costs nothing before it is touched, and runs of zeros touch none.
    let mut image = vec![0; pixels];
    let mut reader = NibbleReader::new(stream);
    let mut last = 0_u16;
    let mut at_px = 0;
    while at_px < pixels {
        at_px += reader.run(at_px, pixels)?;
        if at_px == pixels {
            break;
        }
        let run = reader.run(at_px, pixels)?;
        let measured = image.get_mut(at_px..at_px + run).unwrap_or_default();
        for (offset, pixel) in measured.iter_mut().enumerate() {
            let fault = |fault: Fault| fault.at(at_px + offset, pixels);
            last = last.wrapping_add(unfold(reader.number(DIFFERENCE_DIGITS).map_err(fault)?));
            *pixel = last;
        }
        at_px += run;
    }
    Ok(image)
}

/// Small differences of either sign to small numbers.
fn fold(difference: i32) -> u32 {
    ((difference << 1) ^ (difference >> 31)) as u32
}

/// The difference of a number, modulo 2^16.
fn unfold(number: u32) -> u16 {
    ((number >> 1) ^ (number & 1).wrapping_neg()) as u16
}

#[cfg_attr(
    not(test),
    expect(clippy::indexing_slicing, reason = "at compile time, where running off it is an error")
)]
const fn codes() -> [u16; LOOKED_UP] {
    let mut codes = [0; LOOKED_UP];
    let mut number = 0;
    while number < LOOKED_UP {
        let mut rest = number as u32;
        let mut code = rest & DIGIT_MASK;
        rest >>= DIGIT_BITS;
        while rest > 0 {
            code = ((code | MORE) << NIBBLE_BITS) | (rest & DIGIT_MASK);
            rest >>= DIGIT_BITS;
        }
        codes[number] = code as u16;
        number += 1;
    }
    codes
}

/// Nibbles packed into words.
struct NibbleWriter<'data> {
    data: &'data mut Vec<u8>,
    /// The lowest `nibbles` of it are not yet written; fewer than a word's between two calls.
    pending: u64,
    nibbles: u32,
}

impl NibbleWriter<'_> {
    fn run(&mut self, length: usize) {
        let mut rest = length;
        // Runs beyond 32 bits have digits in front of what a number can hold.
        while rest > LOOKED_UP {
            self.put((rest as u32 & DIGIT_MASK) | MORE, 1);
            rest >>= DIGIT_BITS;
        }
        self.number(rest as u32);
    }

    fn number(&mut self, number: u32) {
        if let Some(code) = CODES.get(number as usize) {
            let digits = 1 + u32::from(number > 0o7) + u32::from(number > 0o77);
            self.put(u32::from(*code), digits);
        } else {
            let mut rest = number;
            while rest > DIGIT_MASK {
                self.put((rest & DIGIT_MASK) | MORE, 1);
                rest >>= DIGIT_BITS;
            }
            self.put(rest, 1);
        }
    }

    fn put(&mut self, code: u32, nibbles: u32) {
        self.pending = (self.pending << (nibbles * NIBBLE_BITS)) | u64::from(code);
        self.nibbles += nibbles;
        if self.nibbles >= WORD_NIBBLES {
            self.nibbles -= WORD_NIBBLES;
            let word = (self.pending >> (self.nibbles * NIBBLE_BITS)) as u32;
            self.data.extend_from_slice(&word.to_le_bytes());
        }
    }

    fn finish(mut self) {
        if self.nibbles > 0 {
            self.put(0, WORD_NIBBLES - self.nibbles);
        }
    }
}

/// Why there is no number.
enum Fault {
    Ends,
    Long { most_digits: u32 },
}

impl Fault {
    fn at(self, at_px: usize, pixels: usize) -> RvlError {
        match self {
            Self::Ends => RvlError::Ends { at_px, pixels },
            Self::Long { most_digits } => RvlError::Number { at_px, most_digits },
        }
    }
}

/// Nibbles unpacked from words.
struct NibbleReader<'data> {
    words: std::slice::Iter<'data, [u8; WORD_BYTES]>,
    /// The highest `nibbles` of it are to be read; zeros below.
    window: u64,
    nibbles: u32,
}

/// The digits that are sure to be in the window while the stream continues.
const WINDOW_DIGITS: u32 = 9;
/// Digits of a number that are taken together.
const SHORT_DIGITS: u32 = 3;
/// The highest bit of each nibble.
const MORE_BITS: u64 = 0x8888_8888_8888_8888;

impl<'data> NibbleReader<'data> {
    /// Bytes at the end that are no word hold no nibble that comes next.
    fn new(stream: &'data [u8]) -> Self {
        Self { words: stream.as_chunks().0.iter(), window: 0, nibbles: 0 }
    }

    /// The length of a run that starts at a pixel.
    fn run(&mut self, at_px: usize, pixels: usize) -> Result<usize, RvlError> {
        let run = self.number(WINDOW_DIGITS).map_err(|fault| fault.at(at_px, pixels))? as usize;
        if run <= pixels - at_px {
            Ok(run)
        } else {
            Err(RvlError::Run { at_px, run: run as u64, pixels })
        }
    }

    /// A number of at most this many digits, no more than the window's.
    fn number(&mut self, most_digits: u32) -> Result<u32, Fault> {
        while self.nibbles < WINDOW_DIGITS {
            let Some(word) = self.words.next() else { break };
            let room = u64::BITS - (self.nibbles + WORD_NIBBLES) * NIBBLE_BITS;
            self.window |= u64::from(u32::from_le_bytes(*word)) << room;
            self.nibbles += WORD_NIBBLES;
        }
        // The first nibble without the bit is the last digit.
        let digits = (!self.window & MORE_BITS).leading_zeros() / NIBBLE_BITS + 1;
        if digits > self.nibbles.min(most_digits) {
            let is_long = self.nibbles > most_digits;
            return Err(if is_long { Fault::Long { most_digits } } else { Fault::Ends });
        }
        // Nearly all have up to three digits; taken together, since a branch on how many there are would
        // be guessed wrong for every other pixel.
        let number = if digits <= SHORT_DIGITS {
            let nibbles = (self.window >> (u64::BITS - SHORT_DIGITS * NIBBLE_BITS)) as u32;
            let [first, second, third] =
                [nibbles >> 8, nibbles >> 4, nibbles].map(|n| n & DIGIT_MASK);
            let number = first | (second << DIGIT_BITS) | (third << (2 * DIGIT_BITS));
            number & ((1 << (digits * DIGIT_BITS)) - 1)
        } else {
            (0..digits).fold(0, |number, digit| {
                let nibble = (self.window >> (u64::BITS - (digit + 1) * NIBBLE_BITS)) as u32;
                number | (nibble & DIGIT_MASK) << (digit * DIGIT_BITS)
            })
        };
        self.window <<= digits * NIBBLE_BITS;
        self.nibbles -= digits;
        Ok(number)
    }
}
