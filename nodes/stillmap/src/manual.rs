//! The command line for those who type it: completions of shells and manual pages, which packages install.

use std::path::{Path, PathBuf};

use clap::{Args, Command};
use clap_complete::Shell;
use robot::{Failure, console, refuse_to_replace};

/// The program's name.
const NAME: &str = "stillmap";
/// The page of the program itself, which leads to those of its subcommands.
const FIRST_PAGE: &str = "stillmap.1";

/// Arguments of `stillmap completions`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap completions bash > ~/.local/share/bash-completion/completions/stillmap")]
pub(crate) struct CompletionsArgs {
    /// The shell
    shell: Shell,
}

/// Arguments of `stillmap man`.
#[derive(Args, Debug)]
#[command(after_help = "Example:
  stillmap man ~/.local/share/man/man1")]
pub(crate) struct ManArgs {
    /// The folder, which is made where it is not there
    folder: PathBuf,
    /// Replace pages that are there
    #[arg(long)]
    overwrite: bool,
}

/// Prints what completes the command line in a shell.
pub(crate) fn print_completions(
    args: &CompletionsArgs,
    mut command: Command,
) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, NAME, &mut script);
    console::print(String::from_utf8_lossy(&script).trim_end())
}

/// Writes the manual pages, one for each subcommand.
pub(crate) fn write_pages(args: &ManArgs, command: Command) -> Result<(), Failure> {
    let folder = &args.folder;
    refuse_to_replace([folder.join(FIRST_PAGE)], args.overwrite, "FOLDER")?;
    let written = std::fs::create_dir_all(folder).and_then(|()| pages(command, folder));
    written.map_err(|error| Failure::new(format!("cannot write to {}: {error}", folder.display())))
}

fn pages(command: Command, folder: &Path) -> std::io::Result<()> {
    clap_mangen::generate_to(command.disable_help_subcommand(true), folder)
}
