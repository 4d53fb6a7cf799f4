//! A message of any type with something in every field, made from a seed.

use std::fmt::Display;

use serde::de::{self, DeserializeOwned, DeserializeSeed, Deserializer, SeqAccess, Visitor};

/// The message of this type that `seed` makes. Sequences hold 1 to 3 elements; numbers are finite;
/// equal seeds make equal messages.
pub(crate) fn filled<T: DeserializeOwned>(seed: u64) -> T {
    T::deserialize(&mut Filler { state: seed }).expect("a message holds what a Filler can make")
}

#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct CannotFill(String);

impl de::Error for CannotFill {
    fn custom<T: Display>(message: T) -> Self {
        Self(message.to_string())
    }
}

struct Filler {
    state: u64,
}

impl Filler {
    /// SplitMix64 (Steele, Lea, Flood 2014).
    fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.state;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }
}

macro_rules! whole_numbers {
    ($($method:ident, $visit:ident, $number:ty;)*) => {$(
        fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CannotFill> {
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
        visitor.visit_bool(self.next() & 1 == 1)
    }

    fn deserialize_f32<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CannotFill> {
        visitor.visit_f32(self.next() as i32 as f32 / 1024.0)
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CannotFill> {
        visitor.visit_f64(self.next() as i64 as f64 / 1e9)
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CannotFill> {
        // Lengths of every remainder of 8, some of them with letters of two bytes.
        let length = self.next() % 12;
        let text =
            (0..length).map(|_| if self.next().is_multiple_of(5) { 'é' } else { 'a' }).collect();
        visitor.visit_string(text)
    }

    fn deserialize_byte_buf<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CannotFill> {
        let length = 1 + self.next() % 9;
        visitor.visit_byte_buf((0..length).map(|_| self.next() as u8).collect())
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CannotFill> {
        let left = 1 + (self.next() % 3) as usize;
        visitor.visit_seq(Elements { filler: self, left })
    }

    fn deserialize_tuple<V: Visitor<'de>>(
        self,
        length: usize,
        visitor: V,
    ) -> Result<V::Value, CannotFill> {
        visitor.visit_seq(Elements { filler: self, left: length })
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, CannotFill> {
        visitor.visit_seq(Elements { filler: self, left: fields.len() })
    }

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, CannotFill> {
        Err(CannotFill("no message holds this".to_owned()))
    }

    serde::forward_to_deserialize_any! {
        char str bytes option unit unit_struct newtype_struct tuple_struct map enum identifier
        ignored_any
    }
}

struct Elements<'a> {
    filler: &'a mut Filler,
    left: usize,
}

impl<'de> SeqAccess<'de> for Elements<'_> {
    type Error = CannotFill;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, CannotFill> {
        if self.left == 0 {
            return Ok(None);
        }
        self.left -= 1;
        seed.deserialize(&mut *self.filler).map(Some)
    }
}
