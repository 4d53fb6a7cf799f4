//! The texts about parameters: the parameter file with every default, and the help text.

use std::collections::BTreeSet;

use geometry::parameter::{Declaration, Kind, Parameters, Range, all_parameters};
use serde::Serialize;
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

/// The accepted numbers of a parameter, `0 or more`; nothing where all finite ones are accepted.
#[must_use]
pub fn accepted_numbers(declaration: &Declaration) -> Option<String> {
    let is_number = matches!(declaration.kind, Kind::Whole | Kind::Real | Kind::Reals(_));
    (is_number && declaration.range != Range::FINITE).then(|| declaration.range.to_string())
}

/// The meaning of a parameter, with that of each text that it accepts, in one line.
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

/// Parameters that several nodes share, in a parameter file of their own.
#[derive(Clone, Copy, Debug)]
pub struct SharedParameters<'a> {
    /// The file.
    pub file: &'a str,
    /// Its contents.
    pub declarations: &'a [Declaration],
}

/// The text of a parameter file for a node of this name, with every parameter at its default but those that are shared.
///
/// # Errors
/// When a default cannot be written as a value.
pub fn parameter_file<P: NodeParameters>(
    node: &str,
    shared: Option<SharedParameters<'_>>,
) -> Result<String, ParameterError> {
    let program = node.replace('_', "-");
    let (mut first, mut about, mut left_out) = (String::new(), String::new(), BTreeSet::new());
    if let Some(SharedParameters { file, declarations }) = shared {
        first = format!(" --params-file config/{file}");
        about = format!("# What it shares with other nodes is in {file}.\n");
        left_out = all_parameters(declarations).into_iter().map(|one| one.name).collect();
    }
    let mut text = format!(
        "# The parameters of the node `{node}`, each with its default: a starting point to copy and change.\n\
         #   {program} --ros-args{first} --params-file config/{node}.yaml\n\
         {about}\
         # The section is for a node of this name in any namespace.\n\
         /**/{node}:\n  ros__parameters:\n"
    );
    let mut writer = Writer { text: &mut text, left_out };
    writer.members(P::DECLARATIONS, &default_values::<P>()?, None, "    ");
    Ok(text)
}

/// The text of a parameter file for all nodes with parameters that several of them share, below a comment.
///
/// # Errors
/// When a default cannot be written as a value.
pub fn shared_parameter_file<P: Parameters + Serialize + Default>(
    comment: &str,
) -> Result<String, ParameterError> {
    let mut text = format!("{comment}/**:\n  ros__parameters:\n");
    let mut writer = Writer { text: &mut text, left_out: BTreeSet::new() };
    writer.members(P::DECLARATIONS, &default_values::<P>()?, None, "    ");
    Ok(text)
}

/// Writes parameters in YAML, each below its meaning.
struct Writer<'a> {
    text: &'a mut String,
    /// Parameters that are not written.
    left_out: BTreeSet<String>,
}

impl Writer<'_> {
    fn members(
        &mut self,
        members: &[Declaration],
        defaults: &Value,
        group: Option<&Declaration>,
        indentation: &str,
    ) {
        let lead = format!("{indentation}# ");
        for member in members {
            if self.left_out.contains(member.name) {
                continue;
            }
            let mut member = *member;
            member.is_changeable |= group.is_some_and(|group| group.is_changeable);
            member.read_with = member.read_with.or(group.and_then(|group| group.read_with));
            if let Kind::Group { members, is_flat: true } = member.kind {
                self.members(members, defaults, Some(&member), indentation);
                continue;
            }
            let notes = notes(&member);
            let comment = match notes.is_empty() {
                true => member.doc.to_owned(),
                false => format!("{} ({})", member.doc, notes.join("; ")),
            };
            wrap(self.text, &comment, &lead, &lead, FILE_WIDTH);
            for choice in choices(&member) {
                wrap(self.text, &choice, &format!("{lead}  "), &format!("{lead}    "), FILE_WIDTH);
            }
            let (name, value) = (member.name, &defaults[member.name]);
            if let Kind::Group { members, .. } = member.kind {
                self.text.push_str(&format!("{indentation}{name}:\n"));
                self.members(members, value, Some(&member), &format!("{indentation}  "));
            } else {
                self.text.push_str(&format!("{indentation}{name}: {}\n", yaml(value)));
            }
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

/// The parameters of a node for its help text: each with its type, range, default and meaning.
///
/// # Errors
/// When a default cannot be written as a value.
pub(crate) fn help<P: NodeParameters>() -> Result<String, ParameterError> {
    let mut text = String::new();
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

/// The remarks on a parameter besides its meaning.
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

/// Appends a text in lines of this width; `lead` comes before the first line, `next` before the others.
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
        struct OfNode {
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

    impl NodeParameters for OfNode {
        const IS_MANAGED: bool = false;
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
        assert_eq!(parameter_file::<OfNode>("a_node", None).unwrap(), expected);
    }

    #[test]
    fn what_is_shared_has_a_file_of_its_own() {
        let shared = SharedParameters { file: "all.yaml", declarations: Voxel::DECLARATIONS };
        let own = parameter_file::<OfNode>("a_node", Some(shared)).unwrap();
        assert!(own.contains("voxel:\n") && !own.contains("edge_m"), "{own}");
        assert!(own.contains("--params-file config/all.yaml --params-file config/a_node.yaml"));
        let expected = "# Shared.\n/**:\n  ros__parameters:\n    # Its edge. (above 0, in m)\n    edge_m: 0.08\n";
        assert_eq!(shared_parameter_file::<Voxel>("# Shared.\n").unwrap(), expected);
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
        assert_eq!(help::<OfNode>().unwrap(), expected);
    }
}
