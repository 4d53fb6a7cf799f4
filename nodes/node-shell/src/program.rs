//! A node as a program: arguments, logging, runtime, node, and the exit code.

mod start;

use std::io::Write;
use std::process::ExitCode;

use crate::node::Node;
use crate::node::host::Host;
use crate::process::failure::{EXIT_UNUSABLE, NodeFailure, is_for_good};
use crate::settings::arguments::RosArguments;
use crate::settings::parameters::{self, NodeParameters, ParameterError};
use crate::wire::error::ShellError;
use crate::wire::transport::Transport;

/// Threads of a node's runtime: one to receive while the other one computes.
const THREADS: usize = 2;

/// Why a program ends, and its exit code.
struct Ended {
    error: NodeFailure,
    code: ExitCode,
}

impl Ended {
    /// By what the program was given: only a file of parameters that is not there may be there at another start.
    fn by_what_it_was_given(error: impl Into<NodeFailure>) -> Self {
        let error = error.into();
        Self { code: exit_code(ParameterError::is_for_good_in(&error)), error }
    }
}

impl From<ShellError> for Ended {
    fn from(error: ShellError) -> Self {
        Self { code: exit_code(error.is_for_good()), error: error.into() }
    }
}

impl From<NodeFailure> for Ended {
    fn from(error: NodeFailure) -> Self {
        Self { code: exit_code(is_for_good(&error)), error }
    }
}

fn exit_code(is_for_good: bool) -> ExitCode {
    if is_for_good { ExitCode::from(EXIT_UNUSABLE) } else { ExitCode::FAILURE }
}

/// A node program.
#[derive(Clone, Copy, Debug)]
pub struct Program {
    /// The node's name, unless the command line gives another.
    pub name: &'static str,
    /// Its description, in one line.
    pub about: &'static str,
    /// Its topics, a line each.
    pub topics: &'static str,
}

impl Program {
    /// Runs a node until its body returns. The body creates its endpoints and drops them at its end;
    /// it should return when [`Node::shutdown_signal`] is triggered. The exit code is 0 when it
    /// returns without an error, [`EXIT_UNUSABLE`] where arguments, parameters or settings cannot be used, and else 1.
    ///
    /// `P` is the struct of the node's parameters, handed to the body.
    pub fn run<P>(
        &self,
        arguments: impl IntoIterator<Item = String>,
        body: impl AsyncFnOnce(&Node, P) -> Result<(), NodeFailure>,
    ) -> ExitCode
    where
        P: NodeParameters,
    {
        match self.try_run(arguments, body) {
            Ok(()) => ExitCode::SUCCESS,
            Err(Ended { error, code }) => {
                // The process ends here; when even stderr is gone there is nowhere left to report.
                let said = crate::process::log::as_error(&format!("{}: {error}", self.name));
                let _ = writeln!(std::io::stderr(), "{said}");
                code
            }
        }
    }

    fn try_run<P>(
        &self,
        arguments: impl IntoIterator<Item = String>,
        body: impl AsyncFnOnce(&Node, P) -> Result<(), NodeFailure>,
    ) -> Result<(), Ended>
    where
        P: NodeParameters,
    {
        let arguments = RosArguments::parse(arguments).map_err(ShellError::from)?;
        match arguments.own.first().map(String::as_str) {
            None => {}
            Some("-h" | "--help") => {
                let help = self.help::<P>().map_err(ShellError::from)?;
                return writeln!(std::io::stdout(), "{help}")
                    .map_err(|error| NodeFailure::from(error).into());
            }
            Some(other) => {
                return Err(Ended::by_what_it_was_given(format!(
                    "unknown argument `{other}`; ROS arguments follow --ros-args, and --help \
                     shows them"
                )));
            }
        }
        let identity = arguments.identity(self.name).map_err(ShellError::from)?;
        crate::process::log::start(&identity.logger_name(), &arguments.log, &arguments.outputs);
        arguments.warn_of_options_without_effect();
        let parameters = arguments.parameters_of(self.name).map_err(Ended::by_what_it_was_given)?;
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(THREADS)
            .enable_all()
            .build()
            .map_err(ShellError::Process)?;
        runtime.block_on(async {
            let transport = Transport::from_environment().map_err(ShellError::from)?;
            let node = Host::on(transport)?.started_again().node(self.name, &arguments)?;
            let result = body(&node, parameters).await;
            let shutdown = node.shutdown_signal();
            node.close().await;
            let failed = shutdown.failure().map_or(Ok(()), |reason| Err(reason.into()));
            Ok(result.and(failed)?)
        })
    }

    fn help<P>(&self) -> Result<String, parameters::ParameterError>
    where
        P: NodeParameters,
    {
        let mut help = format!(
            "{about}\n\nUsage: {name} [--ros-args [-r FROM:=TO] [-p NAME:=VALUE] [--params-file FILE]\n\
             \x20      [-r __node:=NAME] [-r __ns:=/NAMESPACE] [--log-level [LOGGER:=]LEVEL]]\n\n\
             Example: {name} --ros-args -r __ns:=/robot --params-file {name}.yaml\n\n\
             Topics:\n",
            about = self.about,
            name = self.name
        );
        for topic in self.topics.lines().map(str::trim).filter(|line| !line.is_empty()) {
            help.push_str(&format!("  {topic}\n"));
        }
        help.push_str("\nParameters, for -p and parameter files:\n");
        help.push_str(&parameters::help::<P>()?);
        Ok(help)
    }
}
