//! Serialises a value into a description of itself.

use std::fmt::Display;

use serde::Serialize;
use serde::ser::{self, Impossible, SerializeSeq, SerializeStruct, SerializeTuple};

/// The serialised shape of a value.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Shape {
    /// A number, truth value or text: its type's name in a `.msg` file, and the value.
    Primitive(&'static str, String),
    /// A counted block of bytes.
    Bytes,
    /// A counted sequence.
    Sequence(Vec<Shape>),
    /// A fixed number of elements.
    Tuple(Vec<Shape>),
    /// Named fields.
    Struct(&'static str, Vec<(&'static str, Shape)>),
}

impl Shape {
    pub(super) fn of(value: &impl Serialize) -> Result<Self, NoShape> {
        value.serialize(Describer)
    }
}

/// The value serialised as something that no message holds.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(super) struct NoShape(String);

impl ser::Error for NoShape {
    fn custom<T: Display>(message: T) -> Self {
        Self(message.to_string())
    }
}

struct Describer;

macro_rules! primitives {
    ($($method:ident, $kind:ty, $name:literal;)*) => {$(
        fn $method(self, value: $kind) -> Result<Shape, NoShape> {
            Ok(Shape::Primitive($name, value.to_string()))
        }
    )*};
}

type No = Impossible<Shape, NoShape>;

fn none<T>(what: &str) -> Result<T, NoShape> {
    Err(NoShape(format!("no message holds a {what}")))
}

impl ser::Serializer for Describer {
    type Ok = Shape;
    type Error = NoShape;
    type SerializeSeq = SequenceDescriber;
    type SerializeTuple = TupleDescriber;
    type SerializeTupleStruct = No;
    type SerializeTupleVariant = No;
    type SerializeMap = No;
    type SerializeStruct = StructDescriber;
    type SerializeStructVariant = No;

    primitives! {
        serialize_bool, bool, "bool";
        serialize_i8, i8, "int8";
        serialize_i16, i16, "int16";
        serialize_i32, i32, "int32";
        serialize_i64, i64, "int64";
        serialize_u8, u8, "uint8";
        serialize_u16, u16, "uint16";
        serialize_u32, u32, "uint32";
        serialize_u64, u64, "uint64";
        serialize_f32, f32, "float32";
        serialize_f64, f64, "float64";
        serialize_str, &str, "string";
    }

    fn serialize_char(self, _: char) -> Result<Shape, NoShape> {
        none("character of 32 bits")
    }

    fn serialize_bytes(self, _: &[u8]) -> Result<Shape, NoShape> {
        Ok(Shape::Bytes)
    }

    fn serialize_none(self) -> Result<Shape, NoShape> {
        none("value that may be absent")
    }

    fn serialize_some<T: ?Sized + Serialize>(self, _: &T) -> Result<Shape, NoShape> {
        none("value that may be absent")
    }

    fn serialize_unit(self) -> Result<Shape, NoShape> {
        none("unit")
    }

    fn serialize_unit_struct(self, _: &'static str) -> Result<Shape, NoShape> {
        none("unit")
    }

    fn serialize_unit_variant(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
    ) -> Result<Shape, NoShape> {
        none("variant")
    }

    fn serialize_newtype_struct<T: ?Sized + Serialize>(
        self,
        _: &'static str,
        value: &T,
    ) -> Result<Shape, NoShape> {
        value.serialize(self)
    }

    fn serialize_newtype_variant<T: ?Sized + Serialize>(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        _: &T,
    ) -> Result<Shape, NoShape> {
        none("variant")
    }

    fn serialize_seq(self, _: Option<usize>) -> Result<SequenceDescriber, NoShape> {
        Ok(SequenceDescriber(Vec::new()))
    }

    fn serialize_tuple(self, _: usize) -> Result<TupleDescriber, NoShape> {
        Ok(TupleDescriber(Vec::new()))
    }

    fn serialize_tuple_struct(self, _: &'static str, _: usize) -> Result<No, NoShape> {
        none("struct without names")
    }

    fn serialize_tuple_variant(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        _: usize,
    ) -> Result<No, NoShape> {
        none("variant")
    }

    fn serialize_map(self, _: Option<usize>) -> Result<No, NoShape> {
        none("map")
    }

    fn serialize_struct(self, name: &'static str, _: usize) -> Result<StructDescriber, NoShape> {
        Ok(StructDescriber(name, Vec::new()))
    }

    fn serialize_struct_variant(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        _: usize,
    ) -> Result<No, NoShape> {
        none("variant")
    }
}

struct SequenceDescriber(Vec<Shape>);

impl SerializeSeq for SequenceDescriber {
    type Ok = Shape;
    type Error = NoShape;

    fn serialize_element<T: ?Sized + Serialize>(&mut self, value: &T) -> Result<(), NoShape> {
        self.0.push(value.serialize(Describer)?);
        Ok(())
    }

    fn end(self) -> Result<Shape, NoShape> {
        Ok(Shape::Sequence(self.0))
    }
}

struct TupleDescriber(Vec<Shape>);

impl SerializeTuple for TupleDescriber {
    type Ok = Shape;
    type Error = NoShape;

    fn serialize_element<T: ?Sized + Serialize>(&mut self, value: &T) -> Result<(), NoShape> {
        self.0.push(value.serialize(Describer)?);
        Ok(())
    }

    fn end(self) -> Result<Shape, NoShape> {
        Ok(Shape::Tuple(self.0))
    }
}

struct StructDescriber(&'static str, Vec<(&'static str, Shape)>);

impl SerializeStruct for StructDescriber {
    type Ok = Shape;
    type Error = NoShape;

    fn serialize_field<T: ?Sized + Serialize>(
        &mut self,
        name: &'static str,
        value: &T,
    ) -> Result<(), NoShape> {
        self.1.push((name, value.serialize(Describer)?));
        Ok(())
    }

    fn end(self) -> Result<Shape, NoShape> {
        Ok(Shape::Struct(self.0, self.1))
    }
}
