//! Reads the body of a message.

use serde::de::{DeserializeSeed, Deserializer, SeqAccess, Visitor};

use super::{CdrFault, HEADER_BYTES};

/// Reads fields from the front of a message's body. It owns nothing: what is allocated is allocated
/// by the struct that is read, after the claimed size was compared with the bytes that are left.
pub(super) struct Decoder<'de, const BIG_ENDIAN: bool> {
    rest: &'de [u8],
    consumed: usize,
}

impl<'de, const BIG_ENDIAN: bool> Decoder<'de, BIG_ENDIAN> {
    pub(super) fn new(body: &'de [u8]) -> Self {
        Self { rest: body, consumed: 0 }
    }

    /// Bytes that were not read yet.
    pub(super) fn left(&self) -> usize {
        self.rest.len()
    }

    /// The position of the next byte in the message.
    pub(super) fn at(&self) -> usize {
        HEADER_BYTES + self.consumed
    }

    /// The bytes of a number, which is aligned to its own size.
    fn number<const SIZE: usize>(&mut self) -> Result<[u8; SIZE], CdrFault> {
        let padding = self.consumed.next_multiple_of(SIZE) - self.consumed;
        let number = self.rest.get(padding..).and_then(|rest| rest.split_first_chunk::<SIZE>());
        let Some((number, rest)) = number else {
            let needed = padding + SIZE;
            return Err(CdrFault::Ended { at: self.at(), needed, left: self.left() });
        };
        self.rest = rest;
        self.consumed += padding + SIZE;
        Ok(*number)
    }

    /// The count in front of a string or a sequence; no element takes less than a byte.
    fn count(&mut self, what: &'static str) -> Result<u32, CdrFault> {
        let bytes = self.number()?;
        let claimed =
            if BIG_ENDIAN { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) };
        if claimed as usize > self.left() {
            let (at, left) = (self.at(), self.left());
            return Err(CdrFault::ClaimsTooMuch { what, at, claimed, left });
        }
        Ok(claimed)
    }

    /// A counted block of bytes, and where it starts.
    fn block(&mut self, what: &'static str) -> Result<(&'de [u8], usize), CdrFault> {
        let count = self.count(what)? as usize;
        let at = self.at();
        // `count` is not beyond the rest, so that nothing is lost here.
        let (block, rest) = self.rest.split_at_checked(count).unwrap_or((self.rest, &[]));
        self.rest = rest;
        self.consumed += count;
        Ok((block, at))
    }

    fn text(&mut self) -> Result<&'de str, CdrFault> {
        let (block, at) = self.block("string")?;
        let text = match block.split_last() {
            // Some writers leave the terminator of an empty string out.
            None => block,
            Some((0, text)) => text,
            Some(_) => return Err(CdrFault::Unterminated { at, length: block.len() as u32 }),
        };
        std::str::from_utf8(text).map_err(|reason| CdrFault::NotUtf8 { at, reason })
    }
}

macro_rules! numbers {
    ($($method:ident, $visit:ident, $number:ty;)*) => {$(
        fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CdrFault> {
            let bytes = self.number()?;
            visitor.$visit(if BIG_ENDIAN {
                <$number>::from_be_bytes(bytes)
            } else {
                <$number>::from_le_bytes(bytes)
            })
        }
    )*};
}

macro_rules! unsupported {
    ($($method:ident, $what:literal;)*) => {$(
        fn $method<V: Visitor<'de>>(self, _: V) -> Result<V::Value, CdrFault> {
            Err(CdrFault::Unsupported($what))
        }
    )*};
}

impl<'de, const BIG_ENDIAN: bool> Deserializer<'de> for &mut Decoder<'de, BIG_ENDIAN> {
    type Error = CdrFault;

    numbers! {
        deserialize_i8, visit_i8, i8;
        deserialize_i16, visit_i16, i16;
        deserialize_i32, visit_i32, i32;
        deserialize_i64, visit_i64, i64;
        deserialize_u8, visit_u8, u8;
        deserialize_u16, visit_u16, u16;
        deserialize_u32, visit_u32, u32;
        deserialize_u64, visit_u64, u64;
        deserialize_f32, visit_f32, f32;
        deserialize_f64, visit_f64, f64;
    }

    unsupported! {
        deserialize_any, "value of unknown type";
        deserialize_char, "character of 32 bits";
        deserialize_option, "value that may be absent";
        deserialize_map, "map";
        deserialize_identifier, "name of a field";
        deserialize_ignored_any, "value of unknown type";
    }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CdrFault> {
        let at = self.at();
        match self.number()? {
            [0] => visitor.visit_bool(false),
            [1] => visitor.visit_bool(true),
            [value] => Err(CdrFault::NotABool { at, value }),
        }
    }

    fn deserialize_str<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CdrFault> {
        visitor.visit_borrowed_str(self.text()?)
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CdrFault> {
        self.deserialize_str(visitor)
    }

    fn deserialize_bytes<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CdrFault> {
        visitor.visit_borrowed_bytes(self.block("bytes")?.0)
    }

    fn deserialize_byte_buf<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CdrFault> {
        self.deserialize_bytes(visitor)
    }

    fn deserialize_unit<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CdrFault> {
        visitor.visit_unit()
    }

    fn deserialize_unit_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, CdrFault> {
        visitor.visit_unit()
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, CdrFault> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, CdrFault> {
        let left = self.count("sequence")? as usize;
        visitor.visit_seq(Elements { decoder: self, left })
    }

    fn deserialize_tuple<V: Visitor<'de>>(
        self,
        length: usize,
        visitor: V,
    ) -> Result<V::Value, CdrFault> {
        visitor.visit_seq(Elements { decoder: self, left: length })
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        length: usize,
        visitor: V,
    ) -> Result<V::Value, CdrFault> {
        self.deserialize_tuple(length, visitor)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, CdrFault> {
        self.deserialize_tuple(fields.len(), visitor)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _variants: &'static [&'static str],
        _visitor: V,
    ) -> Result<V::Value, CdrFault> {
        Err(CdrFault::Unsupported("choice between variants"))
    }

    fn is_human_readable(&self) -> bool {
        false
    }
}

/// The elements of a sequence, an array or a struct.
struct Elements<'a, 'de, const BIG_ENDIAN: bool> {
    decoder: &'a mut Decoder<'de, BIG_ENDIAN>,
    left: usize,
}

impl<'de, const BIG_ENDIAN: bool> SeqAccess<'de> for Elements<'_, 'de, BIG_ENDIAN> {
    type Error = CdrFault;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, CdrFault> {
        let Some(left) = self.left.checked_sub(1) else { return Ok(None) };
        self.left = left;
        seed.deserialize(&mut *self.decoder).map(Some)
    }

    /// Not above the bytes that are left; serde asks for no more than 1 MiB on the strength of it.
    fn size_hint(&self) -> Option<usize> {
        Some(self.left)
    }
}
