//! What a user has said of nodes behind `--ros-args`, as words of a command line again.

use node_shell::RosArguments;
use node_shell::arguments::ParameterSource;
use node_shell::names::{NameError, RemapKind, RemapRule};

/// Namespace, remappings and parameters, each as a shell takes it.
///
/// # Errors
/// When the namespace is none.
pub(crate) fn ros_words(arguments: &RosArguments) -> Result<Vec<String>, NameError> {
    // Of any node: rules for one alone are rare, and are of no use to a suite.
    let namespace = arguments.identity("detection")?.namespace().to_owned();
    let mut words = Vec::new();
    if namespace != "/" {
        words.extend(["-r".to_owned(), format!("__ns:={namespace}")]);
    }
    for rule in &arguments.remappings {
        words.extend(["-r".to_owned(), quoted(&remapping(rule))]);
    }
    for source in &arguments.parameters {
        match source {
            ParameterSource::File(file) => {
                words.extend(["--params-file".to_owned(), quoted(&file.display().to_string())]);
            }
            ParameterSource::Assignment { node, name, value } => {
                let node = node.as_ref().map(|node| format!("{node}:")).unwrap_or_default();
                words.extend(["-p".to_owned(), quoted(&format!("{node}{name}:={value}"))]);
            }
            // It is the program's own.
            ParameterSource::Text { .. } => {}
        }
    }
    Ok(words)
}

/// Whether the user has given a parameter, to whichever node.
pub(crate) fn gives(arguments: &RosArguments, parameter: &str) -> bool {
    arguments.parameters.iter().any(
        |source| matches!(source, ParameterSource::Assignment { name, .. } if name == parameter),
    )
}

fn remapping(RemapRule { kind, node, from, to }: &RemapRule) -> String {
    let node = node.as_ref().map(|node| format!("{node}:")).unwrap_or_default();
    let scheme = match kind {
        RemapKind::Any => "",
        RemapKind::Topic => "rostopic://",
        RemapKind::Service => "rosservice://",
    };
    format!("{node}{scheme}{from}:={to}")
}

/// A word that a shell takes as it is.
pub(crate) fn quoted(word: &str) -> String {
    let is_plain = |one: char| one.is_ascii_alphanumeric() || "-_./:=,+@%~".contains(one);
    if word.chars().all(is_plain) && !word.starts_with('~') {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_said_is_said_again_and_means_the_same() {
        let line = "-r __ns:=/robot -r scan:=/laser/scan -r detection:rostopic://pose:=/amcl/pose --params-file a.yaml \
                    -p reconstruction:map_file:=map.ply -p use_sim_time:=true";
        let mut words = vec!["--ros-args"];
        words.extend(line.split_whitespace());
        let arguments = RosArguments::parse(words).unwrap();
        assert_eq!(ros_words(&arguments).unwrap().join(" "), line);
        assert!(gives(&arguments, "map_file") && !gives(&arguments, "method"));
    }

    #[test]
    fn a_shell_takes_each_word_as_one() {
        let mount = "rig_from_lidar:=[0.1, 0, 0, 0, 0, 0]";
        let arguments =
            RosArguments::parse(["--ros-args", "-p", mount, "-p", "map_file:=it's.ply"]).unwrap();
        let words = ros_words(&arguments).unwrap();
        assert_eq!(words[1], format!("'{mount}'"));
        assert_eq!(words[3], "'map_file:=it'\\''s.ply'");
    }
}
