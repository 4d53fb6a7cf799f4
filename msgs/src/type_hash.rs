//! The hashes by which ROS 2 tells definitions of one type apart (REP-2016): SHA-256 of a description of the type and of
//! all types in it, written as JSON in one fixed form.
//!
//! As rosidl has it: constants and defaults are not part of the description, and a message without fields has one.

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use sha2::{Digest, Sha256};

use crate::definition::{Arity, Definition};

/// The version of the hash, in front of its digits.
const PREFIX: &str = "RIHS01_";

/// The numbers of the types in `type_description_interfaces/msg/FieldType`.
const NESTED: u8 = 1;
const BUILT_IN: [(&str, u8); 16] = [
    ("int8", 2),
    ("uint8", 3),
    // As in ROS 1.
    ("char", 3),
    ("int16", 4),
    ("uint16", 5),
    ("int32", 6),
    ("uint32", 7),
    ("int64", 8),
    ("uint64", 9),
    ("float32", 10),
    ("float64", 11),
    ("wchar", 14),
    ("bool", 15),
    ("byte", 16),
    (STRING, 17),
    (WIDE_STRING, 18),
];
const STRING: &str = "string";
const WIDE_STRING: &str = "wstring";
/// From a string to one with a bound.
const TO_BOUNDED_STRING: u8 = 4;
/// From one to an array, to a bounded sequence and to an unbounded one.
const TO_ARRAY: u8 = 48;
const TO_BOUNDED_SEQUENCE: u8 = 96;
const TO_SEQUENCE: u8 = 144;

/// What rosidl puts into a message without fields.
const NO_FIELDS: &str = "uint8 structure_needs_at_least_one_member";

/// What a service's event has beside the request and the response (`service_msgs`).
const EVENT_INFO: &str = "service_msgs/msg/ServiceEventInfo";
const EVENT_INFO_FIELDS: &str =
    "uint8 event_type\nbuiltin_interfaces/Time stamp\nchar[16] client_gid\nint64 sequence_number\n";
const TIME: &str = "builtin_interfaces/msg/Time";
const TIME_FIELDS: &str = "int32 sec\nuint32 nanosec\n";

/// The descriptions of types by their full names, each as JSON, with the names of the types in it.
type Descriptions = BTreeMap<String, (String, BTreeSet<String>)>;

/// The hash of the message `type_name`, as `sensor_msgs/msg/Image`, by its `schema` in the form of
/// [`RosMessage::schema`](crate::RosMessage::schema), which bags have as well; `None` where that is no such text.
#[must_use]
pub fn type_hash_of(type_name: &str, schema: &str) -> Option<String> {
    let mut known = Descriptions::new();
    describe_schema(&mut known, type_name, schema)?;
    hash(&known, type_name)
}

/// The hash of the service `type_name` by the schemas of its request and response.
pub(crate) fn of_service(type_name: &str, [request, response]: &[String; 2]) -> Option<String> {
    let mut known = Descriptions::new();
    let parts = ["_Request", "_Response", "_Event"].map(|part| format!("{type_name}{part}"));
    let [request_name, response_name, event_name] = &parts;
    describe_schema(&mut known, request_name, request)?;
    describe_schema(&mut known, response_name, response)?;
    describe(&mut known, EVENT_INFO, EVENT_INFO_FIELDS)?;
    describe(&mut known, TIME, TIME_FIELDS)?;
    let event = [
        ("info", EVENT_INFO.to_owned(), NESTED, 0),
        ("request", request_name.clone(), NESTED + TO_BOUNDED_SEQUENCE, 1),
        ("response", response_name.clone(), NESTED + TO_BOUNDED_SEQUENCE, 1),
    ];
    let whole = [
        ("request_message", request_name.clone(), NESTED, 0),
        ("response_message", response_name.clone(), NESTED, 0),
        ("event_message", event_name.clone(), NESTED, 0),
    ];
    for (name, fields) in [(event_name.as_str(), event), (type_name, whole)] {
        let nested = fields.iter().map(|(_, of, _, _)| of.clone()).collect();
        let fields = fields
            .map(|(field, of, number, capacity)| field_json(field, (number, capacity, 0), &of));
        known.insert(name.to_owned(), (description_json(name, &fields), nested));
    }
    hash(&known, type_name)
}

/// Describes a message and those behind it in its schema.
fn describe_schema(known: &mut Descriptions, type_name: &str, schema: &str) -> Option<()> {
    let mut name = type_name.to_owned();
    let mut text = String::new();
    for line in schema.lines() {
        if let Some(next) = line.strip_prefix("MSG: ") {
            describe(known, &name, &text)?;
            name = full_name(next.trim(), "")?;
            text.clear();
        } else if !line.starts_with("====") {
            text.push_str(line);
            text.push('\n');
        }
    }
    describe(known, &name, &text)
}

fn describe(known: &mut Descriptions, type_name: &str, text: &str) -> Option<()> {
    let package = type_name.split('/').next()?;
    let mut definition = Definition::parse(text).ok()?;
    if definition.fields.is_empty() {
        definition = Definition::parse(NO_FIELDS).ok()?;
    }
    let mut nested = BTreeSet::new();
    let mut fields = Vec::new();
    for field in &definition.fields {
        let built_in = BUILT_IN.iter().find(|(name, _)| *name == field.element);
        let is_string = [STRING, WIDE_STRING].contains(&field.element);
        let (number, of) = match built_in {
            Some((_, number)) if is_string && field.longest.is_some() => {
                (number + TO_BOUNDED_STRING, String::new())
            }
            Some((_, number)) => (*number, String::new()),
            None => (NESTED, full_name(field.element, package)?),
        };
        let (more, capacity) = match field.arity {
            Arity::One => (0, 0),
            Arity::Array(length) => (TO_ARRAY, length),
            Arity::BoundedSequence(most) => (TO_BOUNDED_SEQUENCE, most),
            Arity::Sequence => (TO_SEQUENCE, 0),
        };
        let capacity = u64::try_from(capacity).ok()?;
        let numbers = (number + more, capacity, field.longest.unwrap_or(0));
        fields.push(field_json(field.name, numbers, &of));
        if !of.is_empty() {
            nested.insert(of);
        }
    }
    known.insert(type_name.to_owned(), (description_json(type_name, &fields), nested));
    Some(())
}

/// `package/msg/Name` of a type as a field names it, within `package`.
fn full_name(element: &str, package: &str) -> Option<String> {
    let parts: Vec<&str> = element.split('/').collect();
    match *parts.as_slice() {
        [name] if !package.is_empty() => Some(format!("{package}/msg/{name}")),
        [package, name] => Some(format!("{package}/msg/{name}")),
        [_, _, _] => Some(element.to_owned()),
        _ => None,
    }
}

/// `numbers` are of the type, its capacity, and that of its strings. Names of ROS 2 need no escapes in JSON.
fn field_json(name: &str, (number, capacity, longest): (u8, u64, u64), of: &str) -> String {
    format!(
        r#"{{"name": "{name}", "type": {{"type_id": {number}, "capacity": {capacity}, "string_capacity": {longest}, "nested_type_name": "{of}"}}}}"#
    )
}

fn description_json(type_name: &str, fields: &[String]) -> String {
    format!(r#"{{"type_name": "{type_name}", "fields": [{}]}}"#, fields.join(", "))
}

/// The hash of a type that is described as are all in it.
fn hash(known: &Descriptions, type_name: &str) -> Option<String> {
    let (own, nested) = known.get(type_name)?;
    let mut inner = BTreeSet::new();
    let mut open: Vec<&String> = nested.iter().collect();
    while let Some(name) = open.pop() {
        if inner.insert(name) {
            open.extend(&known.get(name)?.1);
        }
    }
    // In the order of their names.
    let inner: Vec<&str> =
        inner.iter().filter_map(|name| Some(known.get(*name)?.0.as_str())).collect();
    let inner = inner.join(", ");
    let json =
        format!(r#"{{"type_description": {own}, "referenced_type_descriptions": [{inner}]}}"#);
    Some(Sha256::digest(json).iter().fold(PREFIX.to_owned(), |mut hash, byte| {
        let _ = write!(hash, "{byte:02x}");
        hash
    }))
}
