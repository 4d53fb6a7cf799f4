//! Message definitions in a ROS bag: the text of a type with those of all types in it.

use std::collections::BTreeMap;

/// More than the nesting of any message; the limit for a definition that contains itself.
const MOST_LEVELS: usize = 32;

/// More than the fields of any message, those of the messages in it counted wherever they are: a definition of forty lines can have
/// 2^32 of them.
const MOST_FIELDS: usize = 10_000;

/// A definition that cannot be used.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum DefinitionError {
    /// A line that is not a field.
    #[error("`{line}` in the definition of {type_name} is not a field")]
    NoField {
        /// The type.
        type_name: String,
        /// The line.
        line: String,
    },
    /// A type without a definition.
    #[error("the type {type_name} is not defined")]
    Undefined {
        /// The type.
        type_name: String,
    },
    /// A type of types that grows without bound.
    #[error("the type {type_name} has more than {MOST_FIELDS} fields")]
    TooLarge {
        /// The type.
        type_name: String,
    },
    /// Unlimited nesting of types.
    #[error("the type {type_name} nests more than {MOST_LEVELS} levels deep")]
    TooDeep {
        /// The type.
        type_name: String,
    },
}

/// The fields of a type and of all types within it.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Definitions {
    types: BTreeMap<String, Vec<Field>>,
}

/// A field of a definition.
#[derive(Clone, PartialEq, Debug)]
struct Field {
    /// The type of the field or of its elements, with its package if it is a message.
    element: String,
    shape: Shape,
}

/// The number of elements of a field.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Shape {
    One,
    Array(usize),
    Sequence,
}

/// The kind of a value.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Kind {
    /// A number of this many bytes.
    Number(usize),
    Text,
    Message(Vec<Member>),
}

/// A member of a message.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Member {
    pub(super) kind: Kind,
    pub(super) shape: Shape,
    /// Left out in ROS 2: the counter in the header of ROS 1.
    pub(super) dropped: bool,
}

impl Definitions {
    /// Reads the text of `type_name` (`package/Name`).
    pub(super) fn read(type_name: &str, text: &str) -> Result<Self, DefinitionError> {
        let mut types = BTreeMap::new();
        let mut name = type_name.to_owned();
        let mut fields = Vec::new();
        for line in text.lines() {
            if let Some(next) = line.strip_prefix("MSG: ") {
                types.insert(std::mem::replace(&mut name, next.trim().to_owned()), fields);
                fields = Vec::new();
            } else if let Some(field) = Field::read(&name, line)? {
                fields.push(field);
            }
        }
        types.insert(name, fields);
        Ok(Self { types })
    }

    /// The fields of a message of this type.
    pub(super) fn members(&self, type_name: &str) -> Result<Vec<Member>, DefinitionError> {
        let mut fields_left = MOST_FIELDS;
        self.members_within(type_name, MOST_LEVELS, &mut fields_left)
    }

    fn members_within(
        &self,
        name: &str,
        levels: usize,
        fields_left: &mut usize,
    ) -> Result<Vec<Member>, DefinitionError> {
        let fields = self
            .types
            .get(name)
            .ok_or_else(|| DefinitionError::Undefined { type_name: name.to_owned() })?;
        let Some(levels) = levels.checked_sub(1) else {
            return Err(DefinitionError::TooDeep { type_name: name.to_owned() });
        };
        *fields_left = fields_left
            .checked_sub(fields.len())
            .ok_or_else(|| DefinitionError::TooLarge { type_name: name.to_owned() })?;
        let of_ros1_header = name == "std_msgs/Header"
            && fields.len() == 3
            && fields.first().is_some_and(|first| first.element == "uint32");
        let member = |(index, field): (usize, &Field)| {
            let kind = match primitive(&field.element) {
                Some(kind) => kind,
                None => Kind::Message(self.members_within(&field.element, levels, fields_left)?),
            };
            Ok(Member { kind, shape: field.shape, dropped: of_ros1_header && index == 0 })
        };
        fields.iter().enumerate().map(member).collect()
    }
}

impl Field {
    /// Reads a line; `None` when it holds a constant, a comment, or nothing.
    fn read(type_name: &str, line: &str) -> Result<Option<Self>, DefinitionError> {
        let content = line.split('#').next().unwrap_or_default().trim();
        if content.is_empty() || content.bytes().all(|byte| byte == b'=') {
            return Ok(None);
        }
        let no_field = || DefinitionError::NoField {
            type_name: type_name.to_owned(),
            line: content.to_owned(),
        };
        let (field_type, rest) = content.split_once(char::is_whitespace).ok_or_else(no_field)?;
        // A constant: `int32 X=123`, `string A = b`. A default of ROS 2 has no sign before it.
        let is_of_name = |c: char| c.is_alphanumeric() || c == '_';
        let after_name = rest.trim_start().trim_start_matches(is_of_name).trim_start();
        if after_name.starts_with('=') {
            return Ok(None);
        }
        let (element, shape) = match field_type.split_once('[') {
            None => (field_type, Shape::One),
            Some((element, count)) => {
                let count = count.strip_suffix(']').ok_or_else(no_field)?;
                if count.is_empty() || count.starts_with("<=") {
                    (element, Shape::Sequence)
                } else {
                    (element, Shape::Array(count.parse().map_err(|_| no_field())?))
                }
            }
        };
        // `string<=10`: a bound that does not change the encoding.
        let element = element.split("<=").next().unwrap_or_default();
        Ok(Some(Self { element: qualified(type_name, element), shape }))
    }
}

/// A type's name with its package.
fn qualified(within: &str, element: &str) -> String {
    if element.contains('/') || primitive(element).is_some() {
        element.to_owned()
    } else if element == "Header" {
        "std_msgs/Header".to_owned()
    } else {
        let package = within.split('/').next().unwrap_or_default();
        format!("{package}/{element}")
    }
}

/// The kind of a built-in type.
fn primitive(name: &str) -> Option<Kind> {
    Some(match name {
        "bool" | "byte" | "char" | "int8" | "uint8" => Kind::Number(1),
        "int16" | "uint16" => Kind::Number(2),
        "int32" | "uint32" | "float32" => Kind::Number(4),
        "int64" | "uint64" | "float64" => Kind::Number(8),
        "string" => Kind::Text,
        // Seconds and nanoseconds.
        "time" | "duration" => {
            let part = || Member { kind: Kind::Number(4), shape: Shape::One, dropped: false };
            Kind::Message(vec![part(), part()])
        }
        _ => return None,
    })
}

/// The layout of the encoded message: two types with the same layout have the same bytes.
pub(super) fn layout(members: &[Member]) -> String {
    let of = |member: &Member| {
        let element = match &member.kind {
            Kind::Number(bytes) => bytes.to_string(),
            Kind::Text => "s".to_owned(),
            Kind::Message(members) => layout(members),
        };
        match member.shape {
            Shape::One => element,
            Shape::Array(count) => format!("({element}){{{count}}}"),
            Shape::Sequence => format!("({element})*"),
        }
    };
    members.iter().filter(|member| !member.dropped).map(of).collect()
}

/// The definition of a type of ROS 1 in the form of ROS 2.
pub(super) fn as_ros2(type_name: &str, text: &str) -> String {
    let mut within = type_name.to_owned();
    let mut lines = Vec::new();
    for line in text.lines() {
        if let Some(next) = line.strip_prefix("MSG: ") {
            within = next.trim().to_owned();
            lines.push(line.to_owned());
            continue;
        }
        let is_counter = within == "std_msgs/Header"
            && line.split('#').next().is_some_and(|field| field.trim() == "uint32 seq");
        if is_counter {
            continue;
        }
        let (field_type, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let (element, brackets) = match field_type.find('[') {
            Some(at) => field_type.split_at(at),
            None => (field_type, ""),
        };
        let element = match element {
            "time" => "builtin_interfaces/Time",
            "duration" => "builtin_interfaces/Duration",
            "Header" => "std_msgs/Header",
            "char" => "uint8",
            "byte" => "int8",
            other => other,
        };
        let space = if rest.is_empty() { "" } else { " " };
        lines.push(format!("{element}{brackets}{space}{rest}"));
    }
    let separator = "=".repeat(80);
    for (name, fields) in [
        ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec"),
        ("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec"),
    ] {
        if lines.iter().any(|line| line.starts_with(name)) {
            lines.push(format!("{separator}\nMSG: {name}\n{fields}"));
        }
    }
    lines.join("\n")
}
