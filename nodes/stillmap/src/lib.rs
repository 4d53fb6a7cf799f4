//! The program `stillmap`: its command line. The subcommands are in `robot` and, with the feature `laboratory`, in
//! `laboratory`; those about the command line itself are here.

mod manual;

use std::ffi::OsString;
use std::io::ErrorKind;
use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use node_shell::RosArguments;
use robot::{END_WITH_PARENT, Failure, console};
use rustix::process::Signal;

/// Maps what stays still: finds what moves by how the ranges of a 2D LiDAR vary, cuts it out of the
/// cloud of an RGB-D camera, and builds the clean static 3D map.
#[derive(Parser, Debug)]
#[command(
    name = "stillmap",
    version,
    after_help = "Start with: stillmap demo; on a robot: stillmap up
Exit codes: 0 done, 1 not done, 2 a command line, parameter or setting that cannot be used, 3 done with losses (what there
is, is written), 130 interrupted (likewise). Nothing that is there is replaced without --overwrite."
)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    #[command(flatten)]
    Robot(robot::Command),
    #[cfg(feature = "laboratory")]
    #[command(flatten)]
    Laboratory(laboratory::Command),
    /// What completes this command line in a shell
    Completions(manual::CompletionsArgs),
    /// The manual pages, into a folder
    Man(manual::ManArgs),
}

/// Scores `run` against the truth of its bag.
#[cfg(feature = "laboratory")]
const SCORING: Option<robot::run::Scoring> = Some(laboratory::score);
/// A robot's recordings have no truth.
#[cfg(not(feature = "laboratory"))]
const SCORING: Option<robot::run::Scoring> = None;

/// Runs the program with its arguments, the program's own name first.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    if std::env::var_os(END_WITH_PARENT).is_some() {
        // Where the kernel cannot do it, an owner that ends in order still ends its processes.
        let _ = rustix::process::set_parent_process_death_signal(Some(Signal::TERM));
    }
    let (arguments, ros) = match split_ros_arguments(arguments) {
        Ok(split) => split,
        Err(failure) => return fail(&failure),
    };
    let command_line = match parse(arguments) {
        Ok(command_line) => command_line,
        Err(error) => {
            // Help and version come this way too, and are no errors; nor is a closed pipe, as after `head`.
            let is_printed =
                error.print().map_or_else(|error| error.kind() == ErrorKind::BrokenPipe, |()| true);
            let code = u8::try_from(error.exit_code()).unwrap_or(1);
            return if is_printed { ExitCode::from(code) } else { ExitCode::FAILURE };
        }
    };
    let result = match command_line.command {
        Command::Robot(command) => command.run(&ros, SCORING),
        #[cfg(feature = "laboratory")]
        Command::Laboratory(command) => command.run(&ros),
        Command::Completions(args) => {
            manual::print_completions(&args, self::command()).map(|()| ExitCode::SUCCESS)
        }
        Command::Man(args) => {
            manual::write_pages(&args, self::command()).map(|()| ExitCode::SUCCESS)
        }
    };
    result.unwrap_or_else(|failure| fail(&failure))
}

/// Whether the program can read its arguments, the program's own name first; nothing is run. The tests check
/// the commands of the documentation with it.
///
/// # Errors
/// The message that [`run`] would print.
pub fn check(arguments: impl IntoIterator<Item = OsString>) -> Result<(), String> {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    if arguments.get(1).is_some_and(|command| command == "node") {
        let own = arguments.iter().skip(3).map(|argument| argument.to_string_lossy().into_owned());
        RosArguments::parse(own).map_err(|error| error.to_string())?;
    }
    let (arguments, _) = split_ros_arguments(arguments).map_err(|failure| failure.to_string())?;
    parse(arguments).map(|_| ()).map_err(|error| error.to_string())
}

/// The definition of the command line: its subcommands with their options.
#[must_use]
pub fn command() -> clap::Command {
    with_negative_numbers(CommandLine::command())
}

/// A number below 0 is the value of its option, which names what it takes: no option of this program is a digit.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let takes_value = |arg: &clap::Arg| arg.get_action().takes_values();
    command
        .mut_args(|arg| if takes_value(&arg) { arg.allow_negative_numbers(true) } else { arg })
        .mut_subcommands(with_negative_numbers)
}

fn parse(arguments: Vec<OsString>) -> Result<CommandLine, clap::Error> {
    let matches = command().try_get_matches_from(arguments)?;
    CommandLine::from_arg_matches(&matches).map_err(|error| error.format(&mut command()))
}

fn fail(failure: &Failure) -> ExitCode {
    console::print_failure(failure);
    failure.exit_code()
}

/// The arguments of this program, and the ROS arguments that follow them. A node takes its own whole.
fn split_ros_arguments(
    arguments: impl IntoIterator<Item = OsString>,
) -> Result<(Vec<OsString>, RosArguments), Failure> {
    let mut own: Vec<OsString> = arguments.into_iter().collect();
    let is_node = own.get(1).is_some_and(|command| command == "node");
    let start = own.iter().position(|argument| argument == "--ros-args" && !is_node);
    let ros = own.split_off(start.unwrap_or(own.len()));
    // A path may be no UTF-8, a ROS argument always is.
    let ros = ros.iter().map(|argument| argument.to_string_lossy().into_owned());
    let mut ros =
        RosArguments::parse(ros).map_err(|error| Failure::new(error.to_string()).for_good())?;
    // What stands behind a `--` is the program's again.
    own.extend(std::mem::take(&mut ros.own).into_iter().map(OsString::from));
    Ok((own, ros))
}
