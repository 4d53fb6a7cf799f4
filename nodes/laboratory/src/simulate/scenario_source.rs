//! The first argument of `stillmap simulate`: a scenario's name, or a file with one.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use clap::builder::{EnumValueParser, PossibleValue, TypedValueParser};
use clap::error::{ContextKind, ContextValue};
use clap::{Arg, Command, Error};

use super::scenario_name::ScenarioName;

/// The source of a scenario.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) enum ScenarioSource {
    /// It comes with the suite.
    Named(ScenarioName),
    /// A file of the user.
    File(PathBuf),
}

/// A known name wins over a file of the same name. Any other value is a file when it exists or has the ending of one, so
/// that the error is that of a missing file.
#[derive(Clone)]
pub(super) struct ScenarioSourceParser {
    names: EnumValueParser<ScenarioName>,
}

impl ScenarioSourceParser {
    pub(super) fn new() -> Self {
        Self { names: EnumValueParser::new() }
    }
}

impl TypedValueParser for ScenarioSourceParser {
    type Value = ScenarioSource;

    fn parse_ref(
        &self,
        command: &Command,
        argument: Option<&Arg>,
        value: &OsStr,
    ) -> Result<Self::Value, Error> {
        self.names.parse_ref(command, argument, value).map(ScenarioSource::Named).or_else(
            |mut error| {
                let path = Path::new(value);
                if path.is_file() || has_ending_of_yaml(path) {
                    return Ok(ScenarioSource::File(path.to_owned()));
                }
                let files = "a scenario of one's own is a YAML file, `stillmap simulate scene.yaml`; \
                             nodes/laboratory/simulator/scenes/example.yaml explains the keys";
                let tip = ContextValue::StyledStrs(vec![files.to_owned().into()]);
                error.insert(ContextKind::Suggested, tip);
                Err(error)
            },
        )
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        self.names.possible_values()
    }
}

fn has_ending_of_yaml(path: &Path) -> bool {
    let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default();
    ["yaml", "yml"].iter().any(|ending| extension.eq_ignore_ascii_case(ending))
}
