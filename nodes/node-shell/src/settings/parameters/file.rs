//! The YAML file of ROS 2 parameters: nodes, `ros__parameters`, names.

use std::path::Path;

use serde_json::Value;

use super::ParameterError;
use super::tree::{Located, Node};

const SECTION: &str = "ros__parameters";

/// A value that a file has for a node.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct FileParameter {
    /// The parameter, with dots between its parts.
    pub(super) key: String,
    pub(super) value: Value,
    /// The line of the value, from 1.
    pub(super) line: u64,
    /// Whether its section names the node; one such as `/**` or `/robot/*` is for others as well, and has what they know.
    pub(super) names_the_node: bool,
}

/// What a file has for a node.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct OfFile {
    /// Its parameters. Those of sections with wildcards come first, so that a node's own section wins.
    pub(super) parameters: Vec<FileParameter>,
    /// For whom the file is, where it has sections and none for the node.
    pub(super) is_for_others: Option<String>,
}

/// What the file has for the node `full_name`.
pub(super) fn parameters_of(path: &Path, full_name: &str) -> Result<OfFile, ParameterError> {
    let text = std::fs::read_to_string(path)
        .map_err(|source| ParameterError::Unreadable { path: path.to_owned(), source })?;
    parameters_in(&text, path, full_name)
}

/// The same for the text of a file; `path` is what it is called.
pub(super) fn parameters_in(
    text: &str,
    path: &Path,
    full_name: &str,
) -> Result<OfFile, ParameterError> {
    let document: Located =
        serde_saphyr::from_str(text).map_err(|error| ParameterError::NotYaml {
            path: path.to_owned(),
            reason: error.without_snippet().to_string(),
        })?;
    let malformed = |Malformed { at, line, problem }| ParameterError::NotParameters {
        path: path.to_owned(),
        line,
        at,
        problem,
    };
    let nodes = match &document.node {
        Node::Group(nodes) => nodes,
        Node::Leaf(Value::Null) => return Ok(OfFile::default()),
        Node::Leaf(_) => {
            let at = "the document".to_owned();
            return Err(malformed(Malformed { at, line: 1, problem: "is no mapping" }));
        }
    };
    let mut sections = Vec::new();
    collect_sections(nodes, "", &mut sections).map_err(malformed)?;

    let (mut mine, others): (Vec<_>, Vec<_>) =
        sections.into_iter().partition(|(pattern, _)| matches(pattern, full_name));
    let is_for_others = (mine.is_empty() && !others.is_empty()).then(|| {
        let names: Vec<_> = others.iter().map(|(pattern, _)| pattern.as_str()).collect();
        names.join(", ")
    });
    mine.sort_by_key(|(pattern, _)| !pattern.contains('*'));

    let mut parameters = Vec::new();
    for (pattern, section) in mine {
        let names_the_node = pattern.rsplit('/').next().is_some_and(|last| !last.contains('*'));
        flatten(section, "", names_the_node, &mut parameters);
    }
    Ok(OfFile { parameters, is_for_others })
}

/// Where a file breaks the form.
struct Malformed {
    at: String,
    line: u64,
    problem: &'static str,
}

type Section<'a> = (String, &'a [(String, Located)]);

/// Finds every `ros__parameters`, whose path of keys is the pattern of the nodes that it is for.
fn collect_sections<'a>(
    nodes: &'a [(String, Located)],
    parent: &str,
    sections: &mut Vec<Section<'a>>,
) -> Result<(), Malformed> {
    for (key, Located { node, line }) in nodes {
        let malformed = |problem| Err(Malformed { at: key.clone(), line: *line, problem });
        match node {
            Node::Group(section) if key == SECTION && !parent.is_empty() => {
                sections.push((parent.to_owned(), section));
            }
            _ if key == SECTION && parent.is_empty() => {
                return malformed("is outside of any node");
            }
            Node::Leaf(Value::Null) if key == SECTION => {}
            Node::Leaf(_) if key == SECTION => return malformed("holds no names with values"),
            Node::Group(inner) => {
                let pattern = format!("{parent}/{}", key.trim_matches('/'));
                collect_sections(inner, &pattern, sections)?;
            }
            Node::Leaf(_) => {
                return malformed("is where a node or `ros__parameters` is expected");
            }
        }
    }
    Ok(())
}

/// Whether a full node name fits a pattern, in which `*` is any one part and `**` are any parts.
fn matches(pattern: &str, full_name: &str) -> bool {
    fn fits(pattern: &[&str], name: &[&str]) -> bool {
        match (pattern.split_first(), name.split_first()) {
            (None, None) => true,
            (Some((&"**", rest)), _) => {
                (0..=name.len()).any(|taken| fits(rest, name.get(taken..).unwrap_or_default()))
            }
            (Some((&"*", rest)), Some((_, name))) => fits(rest, name),
            (Some((part, rest)), Some((first, name))) => part == first && fits(rest, name),
            _ => false,
        }
    }
    let mut pattern: Vec<&str> = pattern.split('/').filter(|part| !part.is_empty()).collect();
    // Any parts and any parts are any parts: a file with thousands of them ended the stack.
    pattern.dedup_by(|part, before| *part == "**" && *before == "**");
    let name: Vec<&str> = full_name.split('/').filter(|part| !part.is_empty()).collect();
    fits(&pattern, &name)
}

/// Writes nested groups as dotted names.
fn flatten(
    group: &[(String, Located)],
    prefix: &str,
    names_the_node: bool,
    parameters: &mut Vec<FileParameter>,
) {
    for (key, Located { node, line }) in group {
        let key = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
        match node {
            Node::Group(inner) => flatten(inner, &key, names_the_node, parameters),
            Node::Leaf(value) => {
                let value = value.clone();
                parameters.push(FileParameter { key, value, line: *line, names_the_node });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::matches;

    #[test]
    fn patterns_fit_as_in_ros_2() {
        for (pattern, name, fits) in [
            ("/**", "/detection", true),
            ("/**", "/robot/detection", true),
            ("/*", "/detection", true),
            ("/*", "/robot/detection", false),
            ("/*/detection", "/robot/detection", true),
            ("/*/detection", "/detection", false),
            ("/robot/*", "/robot/detection", true),
            ("/robot/*", "/arm/detection", false),
            ("/robot/**", "/robot/left/detection", true),
            ("/**/detection", "/a/b/detection", true),
            ("/**/detection", "/detection", true),
            ("/detection", "/detection", true),
            ("/detection", "/robot/detection", false),
            ("/robot/detection", "/robot/detection", true),
            ("/detection", "/detection2", false),
        ] {
            assert_eq!(matches(pattern, name), fits, "{pattern} {name}");
        }
    }

    /// The stack ended at some ten thousand of them, and before that the time went with their square.
    #[test]
    fn a_name_of_any_number_of_wildcards_is_compared_at_once() {
        let wildcards = "/**".repeat(100_000);
        assert!(matches(&wildcards, "/robot/left/detection"));
        assert!(matches(&format!("{wildcards}/detection"), "/robot/left/detection"));
        assert!(!matches(&format!("{wildcards}/x"), "/robot/left/detection"));
        assert!(!matches(&"/**/x".repeat(30_000), "/robot/left/detection"));
    }
}
