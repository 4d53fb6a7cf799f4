//! The errors of a parameter or a file of them, with the place and what is accepted.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::process::failure::NodeFailure;

/// The place of a value.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum ValueOrigin {
    /// In a parameter file.
    File {
        /// The file.
        path: Box<Path>,
        /// The line, from 1.
        line: u64,
    },
    /// Behind `-p`.
    CommandLine,
    /// In a request to the node.
    Service,
}

impl fmt::Display for ValueOrigin {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File { path, line } => {
                write!(formatter, "in {}, line {line}", path.display())
            }
            Self::CommandLine => formatter.write_str("on the command line"),
            Self::Service => formatter.write_str("in the request"),
        }
    }
}

impl ParameterError {
    /// Whether another start would fail in the same way. A file that cannot be read may be there by then, as on a disk that is mounted late.
    #[must_use]
    pub fn is_for_good(&self) -> bool {
        !matches!(self, Self::Unreadable { .. })
    }

    /// The same of an error that reading parameters led to: only a file that is not there may pass.
    #[must_use]
    pub fn is_for_good_in(error: &NodeFailure) -> bool {
        error.downcast_ref::<Self>().is_none_or(Self::is_for_good)
    }
}

/// A parameter, or a file of them, cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ParameterError {
    /// The file cannot be read.
    #[error("the parameter file {} cannot be read: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is no YAML.
    #[error("the parameter file {} is no valid YAML: {reason}", path.display())]
    NotYaml {
        /// The file.
        path: PathBuf,
        /// The parser's error.
        reason: String,
    },
    /// The file is YAML, but no parameter file.
    #[error(
        "the parameter file {}, line {line}: `{at}` {problem}; accepted is NODE: {{ros__parameters: {{NAME: VALUE}}}}, \
         with /** for every node", path.display()
    )]
    NotParameters {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// The key where the form breaks.
        at: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// The node has no parameter of this name.
    #[error("unknown parameter `{key}` {origin}; {hint}")]
    Unknown {
        /// The parameter.
        key: String,
        /// Its place.
        origin: ValueOrigin,
        /// A similar name.
        hint: String,
    },
    /// The value does not fit.
    #[error("parameter `{key}` {origin}: {reason}; accepted is {accepted}, not {found}")]
    BadValue {
        /// The parameter.
        key: String,
        /// Its place.
        origin: ValueOrigin,
        /// The text there.
        found: String,
        /// What is accepted.
        accepted: String,
        /// Why it does not fit.
        reason: Box<str>,
    },
    /// The struct of defaults cannot be written as parameters; this is a mistake in the program.
    #[error("the defaults of the parameters cannot be written as parameters: {reason}")]
    Defaults {
        /// Why.
        reason: String,
    },
}
