//! The YAML file of ROS 2 parameters: nodes, `ros__parameters`, names.

use std::path::Path;

use serde_json::{Map, Value};

use super::ParameterError;

const SECTION: &str = "ros__parameters";

/// The parameters in the file for the node `full_name`, as dotted names. Those of sections with
/// wildcards come first, so that a node's own section wins.
pub(super) fn parameters_of(
    path: &Path,
    full_name: &str,
) -> Result<Vec<(String, Value)>, ParameterError> {
    let text = std::fs::read_to_string(path)
        .map_err(|source| ParameterError::Unreadable { path: path.to_owned(), source })?;
    parameters_in(&text, path, full_name)
}

/// The same for the text of a file; `path` is what it is called.
pub(super) fn parameters_in(
    text: &str,
    path: &Path,
    full_name: &str,
) -> Result<Vec<(String, Value)>, ParameterError> {
    let document: Value =
        serde_saphyr::from_str(text).map_err(|error| ParameterError::NotYaml {
            path: path.to_owned(),
            reason: error.without_snippet().to_string(),
        })?;
    let malformed = |at: &str, problem| ParameterError::NotParameters {
        path: path.to_owned(),
        at: at.to_owned(),
        problem,
    };
    let nodes = match &document {
        Value::Object(nodes) => nodes,
        Value::Null => return Ok(Vec::new()),
        _ => return Err(malformed("the document", "is no mapping")),
    };
    let mut sections = Vec::new();
    collect_sections(nodes, "", &mut sections).map_err(|(at, problem)| malformed(&at, problem))?;

    let (mut mine, others): (Vec<_>, Vec<_>) =
        sections.into_iter().partition(|(pattern, _)| matches(pattern, full_name));
    if mine.is_empty() && !others.is_empty() {
        let names: Vec<_> = others.iter().map(|(pattern, _)| pattern.as_str()).collect();
        tracing::warn!(
            "the parameter file {} has nothing for {full_name}; it is for {}",
            path.display(),
            names.join(", ")
        );
    }
    mine.sort_by_key(|(pattern, _)| !pattern.contains('*'));

    let mut parameters = Vec::new();
    for (_, section) in mine {
        flatten(section, "", &mut parameters);
    }
    Ok(parameters)
}

type Section<'a> = (String, &'a Map<String, Value>);

/// Finds every `ros__parameters`, whose path of keys is the pattern of the nodes that it is for.
fn collect_sections<'a>(
    nodes: &'a Map<String, Value>,
    parent: &str,
    sections: &mut Vec<Section<'a>>,
) -> Result<(), (String, &'static str)> {
    for (key, value) in nodes {
        let pattern = format!("{parent}/{}", key.trim_matches('/'));
        let Value::Object(inner) = value else {
            return Err((key.clone(), "stands where a node or `ros__parameters` is expected"));
        };
        match inner.get(SECTION) {
            Some(Value::Object(section)) => sections.push((pattern, section)),
            Some(Value::Null) => {}
            Some(_) => return Err((SECTION.to_owned(), "holds no names with values")),
            None if key == SECTION => {
                return Err((SECTION.to_owned(), "stands outside of any node"));
            }
            None => collect_sections(inner, &pattern, sections)?,
        }
    }
    Ok(())
}

/// Whether a full node name fits a pattern, in which `*` is any one part and `**` are any parts.
fn matches(pattern: &str, full_name: &str) -> bool {
    fn fits(pattern: &[&str], name: &[&str]) -> bool {
        match (pattern.split_first(), name.split_first()) {
            (None, None) => true,
            (Some((&"**", rest)), _) => (0..=name.len()).any(|taken| fits(rest, &name[taken..])),
            (Some((&"*", rest)), Some((_, name))) => fits(rest, name),
            (Some((part, rest)), Some((first, name))) => part == first && fits(rest, name),
            _ => false,
        }
    }
    let pattern: Vec<&str> = pattern.split('/').filter(|part| !part.is_empty()).collect();
    let name: Vec<&str> = full_name.split('/').filter(|part| !part.is_empty()).collect();
    fits(&pattern, &name)
}

/// Writes nested groups as dotted names.
fn flatten(group: &Map<String, Value>, prefix: &str, parameters: &mut Vec<(String, Value)>) {
    for (key, value) in group {
        let key = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
        match value {
            Value::Object(inner) => flatten(inner, &key, parameters),
            leaf => parameters.push((key, leaf.clone())),
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
}
