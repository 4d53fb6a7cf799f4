//! The fields of every message, read from the `.msg` files.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

/// What ROS 2 sends for a message without fields.
const PLACEHOLDER: &str = "uint8 structure_needs_at_least_one_member";

/// What one element of a field is.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) enum Element {
    /// A number or truth value, by its name in a `.msg` file.
    Number(String),
    Text,
    /// A message, by its full name (`std_msgs/msg/Header`).
    Message(String),
}

/// How many elements a field holds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Arity {
    One,
    Array(usize),
    Sequence,
}

#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Field {
    pub(super) element: Element,
    pub(super) arity: Arity,
    pub(super) name: String,
}

/// Every message by its full name.
pub(super) struct Definitions(BTreeMap<String, Vec<Field>>);

/// Where the `.msg` files stand.
pub(super) fn folder() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../msgs/msg"))
}

impl Definitions {
    pub(super) fn read() -> Self {
        let mut messages = BTreeMap::new();
        for package in fs::read_dir(folder()).unwrap() {
            let package = package.unwrap();
            let package_name = package.file_name().into_string().unwrap();
            for file in fs::read_dir(package.path()).unwrap() {
                let path = file.unwrap().path();
                let base = path.file_stem().unwrap().to_str().unwrap();
                let text = fs::read_to_string(&path).unwrap();
                messages.insert(format!("{package_name}/msg/{base}"), fields(&package_name, &text));
            }
        }
        Self(messages)
    }

    /// The full names, in alphabetical order.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }

    pub(super) fn fields(&self, name: &str) -> &[Field] {
        self.0.get(name).unwrap_or_else(|| panic!("{name} has no .msg file"))
    }

    /// The full names, each after those that it is made of.
    pub(super) fn inner_first(&self) -> Vec<&str> {
        let mut order = Vec::new();
        for name in self.names() {
            self.append_inner_first(name, &mut order);
        }
        order
    }

    fn append_inner_first<'names>(&'names self, name: &'names str, order: &mut Vec<&'names str>) {
        if order.contains(&name) {
            return;
        }
        for field in self.fields(name) {
            if let Element::Message(inner) = &field.element {
                self.append_inner_first(inner, order);
            }
        }
        order.push(name);
    }
}

fn fields(package: &str, text: &str) -> Vec<Field> {
    let mut fields: Vec<_> = text
        .lines()
        .map(|line| line.split('#').next().unwrap().trim())
        // A bound has an equals sign, too.
        .filter(|line| !line.is_empty() && !line.replace("<=", "").contains('='))
        .map(|line| field(package, line))
        .collect();
    if fields.is_empty() {
        fields.push(field(package, PLACEHOLDER));
    }
    fields
}

fn field(package: &str, line: &str) -> Field {
    let mut words = line.split_whitespace();
    let (Some(kind), Some(name)) = (words.next(), words.next()) else { panic!("no field: {line}") };
    let (element, arity) = match kind.strip_suffix(']').and_then(|kind| kind.split_once('[')) {
        None => (kind, Arity::One),
        // A bound changes nothing on the wire.
        Some((element, bound)) if bound.is_empty() || bound.starts_with("<=") => {
            (element, Arity::Sequence)
        }
        Some((element, length)) => (element, Arity::Array(length.parse().unwrap())),
    };
    let element = match (element, element.split_once('/')) {
        ("string", _) => Element::Text,
        (_, Some((package, base))) => Element::Message(format!("{package}/msg/{base}")),
        _ if element.starts_with(char::is_uppercase) => {
            Element::Message(format!("{package}/msg/{element}"))
        }
        _ => Element::Number(element.to_owned()),
    };
    Field { element, arity, name: name.to_owned() }
}
