//! A message of any type with something in every field, of any size, made from a seed.

use std::fmt::Display;

use serde::de::{self, DeserializeOwned, DeserializeSeed, Deserializer, SeqAccess, Visitor};

/// Which numbers may come.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Floats {
    /// Those that JSON can say, and short enough to be read back exactly by any reader.
    SaidInJson,
    /// Infinities, not-a-number, minus zero and the smallest ones too.
    Any,
}

/// Divides without a rest in binary, and with four decimals.
const SIXTEEN: f64 = 16.0;

/// The message that `seed` makes: equal seeds make equal messages. With `grown_bytes` one of its texts,
/// byte blocks or sequences, chosen by the seed, takes about as many bytes.
pub(super) fn filled<T: DeserializeOwned>(
    seed: u64,
    floats: Floats,
    grown_bytes: Option<usize>,
) -> T {
    let mut plain = Filler::new(seed, floats);
    let message = plain.make();
    match grown_bytes {
        Some(bytes) if plain.lengths_met > 0 => {
            let grown = Grown { index: seed as usize % plain.lengths_met, bytes };
            Filler { grown: Some(grown), ..Filler::new(seed, floats) }.make()
        }
        _ => message,
    }
}

/// The one thing of free length that is made long.
struct Grown {
    /// Its place among the things of free length, in the order in which they are met.
    index: usize,
    bytes: usize,
}

struct Filler {
    state: u64,
    floats: Floats,
    grown: Option<Grown>,
    lengths_met: usize,
    bytes_made: usize,
}

impl Filler {
    fn new(seed: u64, floats: Floats) -> Self {
        Self { state: seed, floats, grown: None, lengths_met: 0, bytes_made: 0 }
    }

    fn make<T: DeserializeOwned>(&mut self) -> T {
        T::deserialize(self).expect("a message holds what a Filler can make")
    }

    /// SplitMix64 (Steele, Lea, Flood 2014).
    fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.state;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// A count below `usual`; or, of the thing that is made long, its bytes.
    fn length(&mut self, usual: u64) -> usize {
        let small = (self.next() % usual) as usize;
        self.grown_length().unwrap_or(small)
    }

    fn grown_length(&mut self) -> Option<usize> {
        let met = self.lengths_met;
        self.lengths_met += 1;
        self.grown.as_ref().filter(|grown| grown.index == met).map(|grown| grown.bytes)
    }

    fn special_float(&mut self) -> Option<f64> {
        const SPECIAL: [f64; 6] =
            [f64::INFINITY, f64::NEG_INFINITY, f64::NAN, -0.0, f64::MAX, f64::MIN_POSITIVE];
        let chosen = self.next();
        (self.floats == Floats::Any && chosen.is_multiple_of(4))
            .then(|| SPECIAL[(chosen >> 8) as usize % SPECIAL.len()])
    }
}

macro_rules! whole_numbers {
    ($($method:ident, $visit:ident, $number:ty;)*) => {$(
        fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CannotFill> {
            self.bytes_made += size_of::<$number>();
            visitor.$visit(self.next() as $number)
        }
    )*};
}

impl<'de> Deserializer<'de> for &mut Filler {
    type Error = CannotFill;

    whole_numbers! {
        deserialize_i8, visit_i8, i8;
        deserialize_i16, visit_i16, i16;
        deserialize_i32, visit_i32, i32;
        deserialize_i64, visit_i64, i64;
        deserialize_u8, visit_u8, u8;
        deserialize_u16, visit_u16, u16;
        deserialize_u32, visit_u32, u32;
        deserialize_u64, visit_u64, u64;
    }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CannotFill> {
        self.bytes_made += 1;
        visitor.visit_bool(self.next() & 1 == 1)
    }

    fn deserialize_f32<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CannotFill> {
        self.bytes_made += 4;
        let usual = self.next() as i32 as f32 / SIXTEEN as f32;
        visitor.visit_f32(self.special_float().map_or(usual, |special| special as f32))
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CannotFill> {
        self.bytes_made += 8;
        let usual = match self.floats {
            Floats::SaidInJson => f64::from(self.next() as i32) / SIXTEEN,
            Floats::Any => self.next() as i64 as f64 / 1e9,
        };
        visitor.visit_f64(self.special_float().unwrap_or(usual))
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CannotFill> {
        let bytes = self.length(12);
        let mut text = String::with_capacity(bytes + 1);
        while text.len() < bytes {
            text.push(if self.next().is_multiple_of(5) { 'é' } else { 'a' });
        }
        self.bytes_made += 5 + text.len();
        visitor.visit_string(text)
    }

    fn deserialize_byte_buf<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CannotFill> {
        let bytes = self.length(10);
        self.bytes_made += 4 + bytes;
        visitor.visit_byte_buf((0..bytes).map(|_| self.next() as u8).collect())
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CannotFill> {
        let count = (self.next() % 4) as usize;
        let end = match self.grown_length() {
            Some(bytes) => End::Bytes(self.bytes_made + bytes),
            None => End::Elements(count),
        };
        visitor.visit_seq(Elements { filler: self, end })
    }

    fn deserialize_tuple<V: Visitor<'de>>(
        self,
        length: usize,
        visitor: V,
    ) -> Result<V::Value, CannotFill> {
        visitor.visit_seq(Elements { filler: self, end: End::Elements(length) })
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, CannotFill> {
        self.deserialize_tuple(fields.len(), visitor)
    }

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, CannotFill> {
        Err(de::Error::custom("no message holds this"))
    }

    serde::forward_to_deserialize_any! {
        char str bytes option unit unit_struct newtype_struct tuple_struct map enum identifier
        ignored_any
    }
}

/// When a sequence ends.
enum End {
    /// After so many more elements.
    Elements(usize),
    /// Once so many bytes were made in all.
    Bytes(usize),
}

struct Elements<'a> {
    filler: &'a mut Filler,
    end: End,
}

impl<'de> SeqAccess<'de> for Elements<'_> {
    type Error = CannotFill;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, CannotFill> {
        match &mut self.end {
            End::Elements(0) => return Ok(None),
            End::Elements(left) => *left -= 1,
            End::Bytes(bytes) if self.filler.bytes_made >= *bytes => return Ok(None),
            End::Bytes(_) => {}
        }
        seed.deserialize(&mut *self.filler).map(Some)
    }
}

#[derive(Debug)]
struct CannotFill(String);

impl Display for CannotFill {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(&self.0)
    }
}

impl std::error::Error for CannotFill {}

impl de::Error for CannotFill {
    fn custom<T: Display>(message: T) -> Self {
        Self(message.to_string())
    }
}
