//! Compares what a message serialises as with the text of its definition.

use serde::Serialize;

use super::shape::Shape;
use crate::definition::{Arity, Definition, Field};
use crate::registry::definition_of;

/// The one byte that ROS 2 sends for a message without fields.
const PLACEHOLDER: &str = "uint8 structure_needs_at_least_one_member";

/// Whether defaults are compared too, besides names, order and types.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Values {
    /// The value is the struct's default.
    Default,
    /// The value is any.
    Any,
}

/// Where `value` and `text`, the definition of a message of `package`, differ.
pub(crate) fn differences(
    value: &impl Serialize,
    package: &str,
    text: &str,
    values: Values,
) -> Vec<String> {
    let mut found = Vec::new();
    match Shape::of(value) {
        Ok(Shape::Struct(name, fields)) => {
            compare_fields(name, &fields, package, text, values, &mut found);
        }
        other => found.push(format!("a message is a struct, not {other:?}")),
    }
    found
}

fn compare_fields(
    path: &str,
    fields: &[(&'static str, Shape)],
    package: &str,
    text: &str,
    values: Values,
    found: &mut Vec<String>,
) {
    let mut wanted = match Definition::parse(text) {
        Ok(definition) => definition.fields,
        Err(error) => {
            found.push(format!("{path}: {error}"));
            return;
        }
    };
    if wanted.is_empty() {
        wanted.extend(Definition::parse(PLACEHOLDER).unwrap_or_default().fields);
    }
    let names: Vec<_> = fields.iter().map(|(name, _)| *name).collect();
    let wanted_names: Vec<_> = wanted.iter().map(|field| field.name).collect();
    if names != wanted_names {
        found.push(format!("{path}: the struct has {names:?}, the text {wanted_names:?}"));
        return;
    }
    for ((name, shape), field) in fields.iter().zip(&wanted) {
        let path = format!("{path}.{name}");
        compare_field(&path, shape, package, field, values, found);
    }
}

fn compare_field(
    path: &str,
    shape: &Shape,
    package: &str,
    field: &Field<'_>,
    values: Values,
    found: &mut Vec<String>,
) {
    let octet = matches!(field.element, "uint8" | "byte" | "char");
    let elements: &[Shape] = match (field.arity, shape) {
        (Arity::One, single) => std::slice::from_ref(single),
        // Bytes serialise as blocks, never element by element.
        (Arity::Sequence | Arity::BoundedSequence(_), Shape::Bytes) if octet => &[],
        (Arity::Sequence | Arity::BoundedSequence(_), Shape::Sequence(elements)) if !octet => {
            elements
        }
        (Arity::Array(length), Shape::Tuple(elements)) if elements.len() == length => elements,
        (arity, shape) => {
            found.push(format!("{path}: {arity:?} of {} in the text, {shape:?}", field.element));
            return;
        }
    };
    for element in elements {
        compare_element(path, element, package, field, values, found);
    }
}

fn compare_element(
    path: &str,
    element: &Shape,
    package: &str,
    field: &Field<'_>,
    values: Values,
    found: &mut Vec<String>,
) {
    let wanted_type = match field.element {
        "byte" | "char" => "uint8",
        other => other,
    };
    match element {
        Shape::Primitive(kind, value) => {
            if *kind != wanted_type {
                found.push(format!("{path}: {wanted_type} in the text, {kind} in the struct"));
            } else if values == Values::Default && field.arity == Arity::One {
                let unset = match *kind {
                    "string" => "",
                    "bool" => "false",
                    _ => "0",
                };
                let default = field.default.unwrap_or(unset).trim_matches('"');
                if value != default {
                    found.push(format!("{path}: default {default:?} in the text, {value:?}"));
                }
            }
        }
        Shape::Struct(name, fields) => {
            let (package, wanted_name) =
                wanted_type.split_once('/').unwrap_or((package, wanted_type));
            match definition_of(package, wanted_name) {
                Some(text) if *name == wanted_name => {
                    compare_fields(path, fields, package, text, values, found);
                }
                _ => found.push(format!("{path}: {wanted_type} in the text, {name} in the struct")),
            }
        }
        other => found.push(format!("{path}: {wanted_type} in the text, {other:?} in the struct")),
    }
}
