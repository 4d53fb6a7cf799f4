//! What people read of parameters: the parameter file with every default, and the help text.

use geometry::parameter::{Declaration, Kind, Range};
use serde_json::Value;

use super::declared::{declared, default_values};
use super::{NodeParameters, ParameterError};

/// Characters of a line in a parameter file.
const FILE_WIDTH: usize = 120;
/// Characters of a line in a help text.
const HELP_WIDTH: usize = 100;

/// The name of a type in ROS 2's words.
#[must_use]
pub fn type_name(kind: Kind) -> &'static str {
    match kind {
        Kind::Truth => "bool",
        Kind::Whole => "int",
        Kind::Real => "double",
        Kind::Text | Kind::Choice(_) => "string",
        Kind::Reals(_) => "double[]",
        Kind::Group { .. } => "group",
    }
}

/// What the numbers of a parameter may be, `0 or more`; nothing where all finite ones are accepted.
#[must_use]
pub fn accepted_numbers(declaration: &Declaration) -> Option<String> {
    let is_number = matches!(declaration.kind, Kind::Whole | Kind::Real | Kind::Reals(_));
    (is_number && declaration.range != Range::FINITE).then(|| declaration.range.to_string())
}

/// What a parameter means, with the meaning of each text that it may be, in one line.
#[must_use]
pub fn meaning(declaration: &Declaration) -> String {
    let mut text = declaration.doc.to_owned();
    for choice in choices(declaration) {
        text.push(' ');
        text.push_str(&choice);
    }
    if let Some(setting) = declaration.read_with {
        text.push_str(&format!(" Read with {}: {}.", setting.name, setting.value));
    }
    text
}

/// The text of a parameter file for a node of this name, with every parameter at its default.
///
/// # Errors
/// When a default cannot be written as a value.
pub fn parameter_file<P: NodeParameters>(node: &str) -> Result<String, ParameterError> {
    let program = node.replace('_', "-");
    let mut text = format!(
        "# The parameters of the node `{node}`, each with its default: a starting point to copy and change.\n\
         #   {program} --ros-args --params-file config/{node}.yaml\n\
         # The section is for a node of this name in any namespace.\n\
         /**/{node}:\n  ros__parameters:\n"
    );
    write_members(&mut text, P::DECLARATIONS, &default_values::<P>()?, None, "    ");
    Ok(text)
}

fn write_members(
    text: &mut String,
    members: &[Declaration],
    defaults: &Value,
    group: Option<&Declaration>,
    indentation: &str,
) {
    let lead = format!("{indentation}# ");
    for member in members {
        let mut member = *member;
        member.is_changeable |= group.is_some_and(|group| group.is_changeable);
        member.read_with = member.read_with.or(group.and_then(|group| group.read_with));
        if let Kind::Group { members, is_flat: true } = member.kind {
            write_members(text, members, defaults, Some(&member), indentation);
            continue;
        }
        let notes = notes(&member);
        let comment = match notes.is_empty() {
            true => member.doc.to_owned(),
            false => format!("{} ({})", member.doc, notes.join("; ")),
        };
        wrap(text, &comment, &lead, &lead, FILE_WIDTH);
        for choice in choices(&member) {
            wrap(text, &choice, &format!("{lead}  "), &format!("{lead}    "), FILE_WIDTH);
        }
        let value = &defaults[member.name];
        if let Kind::Group { members, .. } = member.kind {
            text.push_str(&format!("{indentation}{}:\n", member.name));
            write_members(text, members, value, Some(&member), &format!("{indentation}  "));
        } else {
            text.push_str(&format!("{indentation}{}: {}\n", member.name, yaml(value)));
        }
    }
}

/// A value in YAML.
fn yaml(value: &Value) -> String {
    match value {
        Value::Array(elements) => {
            format!("[{}]", elements.iter().map(yaml).collect::<Vec<_>>().join(", "))
        }
        other => other.to_string(),
    }
}

/// Names and defaults of parameters that are not declared one by one.
fn write_defaults(text: &mut String, group: &str, defaults: &Value) {
    let Value::Object(members) = defaults else { return };
    for (name, default) in members {
        match default {
            Value::Object(_) => write_defaults(text, &format!("{group}{name}."), default),
            default => {
                let line = format!("{group}{name} (default {})", yaml(default));
                wrap(text, &line, "  ", "    ", HELP_WIDTH);
            }
        }
    }
}

/// The parameters of a node for its help text: each with its type, range, default and meaning.
///
/// # Errors
/// When a default cannot be written as a value.
pub(crate) fn help<P: NodeParameters>() -> Result<String, ParameterError> {
    let mut text = String::new();
    if P::DECLARATIONS.is_empty() {
        write_defaults(&mut text, "", &default_values::<P>()?);
    }
    for one in declared::<P>()? {
        let mut facts = vec![type_name(one.declaration.kind).to_owned()];
        facts.extend(notes(&one.declaration));
        facts.push(format!("default {}", yaml(&one.default)));
        wrap(&mut text, &format!("{} ({})", one.name, facts.join("; ")), "  ", "    ", HELP_WIDTH);
        wrap(&mut text, one.declaration.doc, "      ", "      ", HELP_WIDTH);
        for choice in choices(&one.declaration) {
            wrap(&mut text, &choice, "        ", "          ", HELP_WIDTH);
        }
    }
    Ok(text)
}

/// What is to be known of a parameter besides its meaning.
fn notes(declaration: &Declaration) -> Vec<String> {
    let mut notes = Vec::new();
    let unit = declaration.unit().map(|unit| format!("in {unit}"));
    let numbers: Vec<String> = accepted_numbers(declaration).into_iter().chain(unit).collect();
    if !numbers.is_empty() {
        notes.push(numbers.join(", "));
    }
    if let Some(setting) = declaration.read_with {
        notes.push(format!("read with {}: {}", setting.name, setting.value));
    }
    if declaration.is_changeable {
        notes.push("may be set while the node runs".to_owned());
    }
    notes
}

/// Each text that a parameter may be, with its meaning.
fn choices(declaration: &Declaration) -> Vec<String> {
    let line =
        |choice: &geometry::parameter::Choice| format!("\"{}\": {}", choice.text, choice.doc);
    declaration.choices().iter().map(line).collect()
}

/// Appends a text in lines of this width; `lead` stands before the first line, `next` before the others.
fn wrap(text: &mut String, words: &str, lead: &str, next: &str, width: usize) {
    let mut line = lead.to_owned();
    let mut is_empty = true;
    for word in words.split_whitespace() {
        if !is_empty && line.chars().count() + 1 + word.chars().count() > width {
            text.push_str(&line);
            text.push('\n');
            line = next.to_owned();
            is_empty = true;
        }
        if !is_empty {
            line.push(' ');
        }
        line.push_str(word);
        is_empty = false;
    }
    text.push_str(&line);
    text.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    geometry::choices! {
        /// Where images come from.
        enum Input {
            /// From a camera.
            Camera = "camera",
            /// From a file.
            File = "file",
        }
    }

    geometry::parameters! {
        /// A group.
        #[derive(Clone, PartialEq, Debug)]
        struct Voxel {
            /// Its edge.
            edge_m: f64 = 0.08, positive;
        }
    }

    geometry::parameters! {
        /// Of a node.
        #[derive(Clone, PartialEq, Debug)]
        struct Parameters {
            /// Where images come from.
            input: Input = Input::Camera;
            /// Where it is, of so many words that they do not all fit into one line of a help text, whatever they may say,
            /// or of a file.
            mount: [f64; 3] = [0.0, 0.5, 1.0];
            /// The file.
            file: String = String::new(), read_with("input", "file"), changeable;
            /// Voxels.
            voxel: Voxel;
        }
    }

    impl NodeParameters for Parameters {
        const DECLARATIONS: &'static [Declaration] = Self::DECLARATIONS;
        const IS_MANAGED: bool = false;

        fn validate(&self) -> Result<(), crate::process::failure::NodeFailure> {
            Ok(Self::validate(self)?)
        }
    }

    #[test]
    fn a_file_has_every_parameter_with_its_meaning_and_default() {
        let expected = "\
# The parameters of the node `a_node`, each with its default: a starting point to copy and change.
#   a-node --ros-args --params-file config/a_node.yaml
# The section is for a node of this name in any namespace.
/**/a_node:
  ros__parameters:
    # Where images come from.
    #   \"camera\": From a camera.
    #   \"file\": From a file.
    input: \"camera\"
    # Where it is, of so many words that they do not all fit into one line of a help text, whatever they may say, or of
    # a file.
    mount: [0.0, 0.5, 1.0]
    # The file. (read with input: file; may be set while the node runs)
    file: \"\"
    # Voxels.
    voxel:
      # Its edge. (above 0, in m)
      edge_m: 0.08
";
        assert_eq!(parameter_file::<Parameters>("a_node").unwrap(), expected);
    }

    #[test]
    fn the_help_has_every_parameter_with_its_meaning_and_default() {
        let expected = "  \
  input (string; default \"camera\")
      Where images come from.
        \"camera\": From a camera.
        \"file\": From a file.
  mount (double[]; default [0.0, 0.5, 1.0])
      Where it is, of so many words that they do not all fit into one line of a help text, whatever
      they may say, or of a file.
  file (string; read with input: file; may be set while the node runs; default \"\")
      The file.
  voxel.edge_m (double; above 0, in m; default 0.08)
      Its edge.
  use_sim_time (bool; default false)
      Whether the node goes by the time of /clock.
";
        assert_eq!(help::<Parameters>().unwrap(), expected);
    }
}
