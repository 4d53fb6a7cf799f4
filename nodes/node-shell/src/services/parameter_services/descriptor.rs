//! What each parameter of a node is: its type, its range, what it means, whether it may change.

use std::collections::BTreeMap;
use std::ops::Bound;

use geometry::parameter::{Kind, Range};
use msgs::rcl_interfaces::{FloatingPointRange, IntegerRange, ParameterDescriptor, ParameterType};
use serde_json::Value;

use super::value;
use crate::settings::parameters::{
    self, DeclaredParameter, NodeParameters, Overlay, ParameterError, Range as FileRange,
    ValueOrigin,
};

/// The key below a node's name, with its parameters.
const SECTION: &str = "ros__parameters";

/// Text that is no variant of anything.
const NO_VARIANT: &str = "\u{1}";

/// The descriptors of all parameters by their names.
pub(super) fn descriptors<P: NodeParameters>()
-> Result<BTreeMap<String, ParameterDescriptor>, ParameterError> {
    let declared = parameters::declared::<P>()?;
    let mut descriptors: BTreeMap<_, _> =
        declared.iter().map(|one| (one.name.clone(), descriptor(one))).collect();
    if P::DECLARATIONS.is_empty() {
        descriptors.append(&mut by_file::<P>()?);
    }
    Ok(descriptors)
}

fn descriptor(one: &DeclaredParameter) -> ParameterDescriptor {
    let declaration = &one.declaration;
    let mut descriptor = ParameterDescriptor {
        name: one.name.clone(),
        r#type: match declaration.kind {
            Kind::Truth => ParameterType::PARAMETER_BOOL,
            Kind::Whole => ParameterType::PARAMETER_INTEGER,
            Kind::Real => ParameterType::PARAMETER_DOUBLE,
            Kind::Text | Kind::Choice(_) => ParameterType::PARAMETER_STRING,
            Kind::Reals(_) => ParameterType::PARAMETER_DOUBLE_ARRAY,
            Kind::Group { .. } => ParameterType::PARAMETER_NOT_SET,
        },
        description: parameters::meaning(declaration),
        read_only: !declaration.is_changeable,
        ..ParameterDescriptor::default()
    };
    let range = declaration.range;
    match declaration.kind {
        Kind::Whole => {
            let from_value = match range.from {
                Bound::Included(least) => least as i64,
                Bound::Excluded(bound) => bound as i64 + 1,
                Bound::Unbounded => i64::MIN,
            };
            let to_value = match range.to {
                Bound::Included(most) => most as i64,
                Bound::Excluded(bound) => bound as i64 - 1,
                Bound::Unbounded => i64::MAX,
            };
            descriptor.integer_range = vec![IntegerRange { from_value, to_value, step: 0 }];
        }
        Kind::Real if range != Range::FINITE => {
            let from_value = match range.from {
                Bound::Included(least) => least,
                Bound::Excluded(bound) => bound.next_up(),
                Bound::Unbounded => f64::MIN,
            };
            let to_value = match range.to {
                Bound::Included(most) => most,
                Bound::Excluded(bound) => bound.next_down(),
                Bound::Unbounded => f64::MAX,
            };
            descriptor.floating_point_range =
                vec![FloatingPointRange { from_value, to_value, step: 0.0 }];
        }
        Kind::Reals(length) => {
            descriptor.additional_constraints = format!("an array of length {length}");
        }
        Kind::Choice(choices) => {
            let texts: Vec<_> = choices.iter().map(|choice| format!("`{}`", choice.text)).collect();
            descriptor.additional_constraints = match texts.as_slice() {
                [one, other] => format!("{one} or {other}"),
                texts => format!("one of {}", texts.join(", ")),
            };
        }
        _ => {}
    }
    descriptor
}

/// Those of a node whose parameters are not declared: by the comments of its parameter file.
fn by_file<P: NodeParameters>() -> Result<BTreeMap<String, ParameterDescriptor>, ParameterError> {
    let overlay = Overlay::<P>::new()?;
    let comments = comments(P::FILE);
    Ok(overlay
        .leaves()
        .into_iter()
        .map(|(name, default)| {
            let range = P::RANGES.iter().find(|(of, _)| *of == name).map(|(_, range)| *range);
            let kind = value::type_of(default);
            let descriptor = ParameterDescriptor {
                r#type: kind,
                description: comments.get(&name).cloned().unwrap_or_default(),
                additional_constraints: constraints(&overlay, &name, default),
                read_only: !P::CHANGEABLE.contains(&name.as_str()),
                dynamic_typing: kind == ParameterType::PARAMETER_NOT_SET,
                floating_point_range: range.and_then(real).into_iter().collect(),
                integer_range: range.and_then(whole).into_iter().collect(),
                name: name.clone(),
            };
            (name, descriptor)
        })
        .collect())
}

fn real(range: FileRange) -> Option<FloatingPointRange> {
    match range {
        FileRange::Real { least, most } => {
            Some(FloatingPointRange { from_value: least, to_value: most, step: 0.0 })
        }
        FileRange::Whole { .. } => None,
    }
}

fn whole(range: FileRange) -> Option<IntegerRange> {
    match range {
        FileRange::Whole { least, most } => {
            Some(IntegerRange { from_value: least, to_value: most, step: 0 })
        }
        FileRange::Real { .. } => None,
    }
}

/// What the struct accepts of a text or a list: it says so itself when it is given what it cannot accept.
fn constraints<P: NodeParameters>(overlay: &Overlay<P>, name: &str, default: &Value) -> String {
    let probe = match default {
        Value::String(_) => Value::from(NO_VARIANT),
        Value::Array(_) => Value::Array(Vec::new()),
        _ => return String::new(),
    };
    match overlay.clone().set(name, probe, ValueOrigin::Service) {
        Err(ParameterError::BadValue { reason, .. }) => {
            reason.split_once("expected ").map_or_else(String::new, |(_, rest)| rest.to_owned())
        }
        _ => String::new(),
    }
}

/// The comment above each key of a parameter file, by the key with those of its groups before it. An empty line ends a
/// comment, so that one above it is for nobody.
fn comments(file: &str) -> BTreeMap<String, String> {
    let mut comments = BTreeMap::new();
    let mut comment: Vec<&str> = Vec::new();
    // The groups that are open, each with its indentation.
    let mut groups: Vec<(usize, &str)> = Vec::new();
    for line in file.lines() {
        let text = line.trim();
        if let Some(text) = text.strip_prefix('#') {
            comment.push(text.trim());
            continue;
        }
        if let Some((key, value)) = text.split_once(':') {
            let indentation = line.len() - line.trim_start().len();
            groups.retain(|(of_group, _)| *of_group < indentation);
            let names = groups.iter().map(|(_, name)| *name).skip_while(|name| is_section(name));
            let path: Vec<&str> = names.chain([key]).collect();
            comments.insert(path.join("."), comment.join(" "));
            if value.trim().is_empty() {
                groups.push((indentation, key));
            }
        }
        comment.clear();
    }
    comments
}

/// Whether a key names nodes, or begins their parameters.
fn is_section(key: &str) -> bool {
    key.starts_with('/') || key == SECTION
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comment_is_of_the_key_below_it() {
        let file = "# Of the file.\n/**/node:\n  ros__parameters:\n    # Of nobody.\n\n    # The first,\n    \
                    # in m.\n    first_m: 1.0  # beside\n    second: \"a:b\"\n    # The third.\n    third: [1]\n";
        let comments = comments(file);
        assert_eq!(comments["first_m"], "The first, in m.");
        assert_eq!(comments["second"], "");
        assert_eq!(comments["third"], "The third.");
    }

    #[test]
    fn a_comment_in_a_group_is_of_the_whole_name() {
        let file = "/**/node:\n  ros__parameters:\n    # A group.\n    voxel:\n      # Its edge.\n      edge_m: 1.0\n\
                    \x20     fine:\n        # Deep.\n        most: 2\n    # After it.\n    edge_m: 3.0\n";
        let comments = comments(file);
        assert_eq!(comments["voxel.edge_m"], "Its edge.");
        assert_eq!(comments["voxel.fine.most"], "Deep.");
        assert_eq!(comments["edge_m"], "After it.");
    }
}
