//! A failure: a line that says what was wrong, and a line that says what to do.

use std::fmt;
use std::process::ExitCode;

use node_shell::parameters::ParameterError;
use node_shell::{EXIT_UNUSABLE, NodeFailure, ShellError, is_for_good};

/// The exit code of a job of whose input a part was lost.
const EXIT_WITH_LOSSES: u8 = 3;
/// The exit code of a job that was interrupted: 128 and the number of SIGINT, as shells have it.
const EXIT_INTERRUPTED: u8 = 130;

/// Why a subcommand could not do its job.
#[derive(Debug)]
pub struct Failure {
    what: String,
    fix: Option<String>,
    is_interruption: bool,
    is_for_good: bool,
}

impl Failure {
    /// A failure that says what was wrong.
    pub fn new(what: impl Into<String>) -> Self {
        Self { what: what.into(), fix: None, is_interruption: false, is_for_good: false }
    }

    /// A failure of an option that cannot be used, whatever the input: the same as of a command line that cannot be read.
    pub fn unusable(what: impl Into<String>) -> Self {
        Self::new(what).for_good()
    }

    /// A parameter cannot be used, or a file of them.
    pub(crate) fn of_parameters(error: &ParameterError) -> Self {
        Self { is_for_good: error.is_for_good(), ..Self::new(error.to_string()) }
    }

    /// A node could not be had.
    pub(crate) fn of_node(error: &ShellError) -> Self {
        Self { is_for_good: error.is_for_good(), ..Self::new(error.to_string()) }
    }

    /// A node has ended with a failure.
    pub(crate) fn of_body(error: &NodeFailure) -> Self {
        Self { is_for_good: is_for_good(error), ..Self::new(error.to_string()) }
    }

    /// The same failure, of a command line, a parameter or a setting that cannot be used: another start would fail in the same way.
    pub fn for_good(self) -> Self {
        Self { is_for_good: true, ..self }
    }

    /// The exit code of the program.
    #[must_use]
    pub fn exit_code(&self) -> ExitCode {
        if self.is_for_good { ExitCode::from(EXIT_UNUSABLE) } else { ExitCode::FAILURE }
    }

    /// A signal has ended the job before it had results.
    pub(crate) fn interruption(what: impl Into<String>) -> Self {
        Self { is_interruption: true, ..Self::new(what) }
    }

    /// Whether a signal has ended the job.
    pub(crate) fn is_interruption(&self) -> bool {
        self.is_interruption
    }

    /// Adds what to do about it.
    pub fn fix(self, fix: impl Into<String>) -> Self {
        Self { fix: Some(fix.into()), ..self }
    }

    /// Says in which part of the job it happened.
    pub fn within(self, part: impl fmt::Display) -> Self {
        Self { what: format!("{part}: {}", self.what), ..self }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", self.what)?;
        match &self.fix {
            Some(fix) => write!(formatter, "\n  {fix}"),
            None => Ok(()),
        }
    }
}

/// How a subcommand that did its job ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Outcome {
    /// Everything was processed.
    Complete,
    /// Part of the input could not be read or was lost. The results of the rest are written.
    WithLosses,
    /// A signal ended it. The results until then are written.
    Interrupted,
}

impl Outcome {
    /// The exit code of the program.
    #[must_use]
    pub fn exit_code(self) -> ExitCode {
        match self {
            Self::Complete => ExitCode::SUCCESS,
            Self::WithLosses => ExitCode::from(EXIT_WITH_LOSSES),
            Self::Interrupted => ExitCode::from(EXIT_INTERRUPTED),
        }
    }
}
