//! `stillmap-fuzz`: many cases of each target, each target in a process of its own.
#![allow(
    clippy::expect_used,
    clippy::print_stdout,
    reason = "its output is its result, and there is nobody else to report to"
)]

mod supervision;
mod worker;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use stillmap_fuzz::{Mutator, Target, run, targets};

/// Gives mutated bytes to every reader of outside bytes
#[derive(Parser, Debug)]
#[command(after_help = "Examples:
  stillmap-fuzz --minutes 10
  stillmap-fuzz ply pcd --cases 1000000 --seed 7
  stillmap-fuzz ply --seed 7 --case 1234
  stillmap-fuzz ply --file crash.bin")]
struct Arguments {
    /// The targets, all without any
    names: Vec<String>,
    /// What the cases are drawn from
    #[arg(long, default_value_t = 26)]
    seed: u64,
    /// Minutes for all targets together
    #[arg(long, conflicts_with = "cases")]
    minutes: Option<f64>,
    /// Cases of each target
    #[arg(long)]
    cases: Option<u64>,
    /// The number of the first case
    #[arg(long, default_value_t = 0)]
    first: u64,
    /// This case alone
    #[arg(long)]
    case: Option<u64>,
    /// This input alone
    #[arg(long, value_name = "FILE", conflicts_with = "case")]
    file: Option<PathBuf>,
    /// The names of the targets
    #[arg(long)]
    list: bool,
    /// Run the cases in this process, until so many seconds are over
    #[arg(long, hide = true)]
    worker: Option<f64>,
    /// Name each case before it runs
    #[arg(long, hide = true)]
    trace: bool,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let chosen: Vec<Target> = targets()
        .into_iter()
        .filter(|target| {
            arguments.names.is_empty() || arguments.names.iter().any(|name| name == target.name)
        })
        .collect();
    if arguments.list {
        chosen.iter().for_each(|target| println!("{}", target.name));
        return ExitCode::SUCCESS;
    }
    if chosen.len() < arguments.names.len() {
        eprintln!("there is no such target: `stillmap-fuzz --list` names all of them");
        return ExitCode::FAILURE;
    }
    match (&arguments, chosen.as_slice()) {
        (Arguments { worker: Some(seconds), .. }, [target]) => {
            worker::work(target, &arguments, *seconds)
        }
        (Arguments { case: Some(case), .. }, [target]) => {
            let mutator = Mutator::new(arguments.seed, (target.seeds)(), target.words);
            show(target, &mutator.input(*case))
        }
        (Arguments { file: Some(file), .. }, [target]) => match std::fs::read(file) {
            Ok(input) => show(target, &input),
            Err(error) => {
                eprintln!("cannot read {}: {error}", file.display());
                ExitCode::FAILURE
            }
        },
        (Arguments { case: Some(_), .. } | Arguments { file: Some(_), .. }, _) => {
            eprintln!("name the one target");
            ExitCode::FAILURE
        }
        _ => supervision::explore(&chosen, &arguments),
    }
}

/// One input, with what it does.
fn show(target: &Target, input: &[u8]) -> ExitCode {
    println!("{} bytes: {}", input.len(), input.escape_ascii());
    match run(target, input) {
        Ok(()) => {
            println!("{} withstands it", target.name);
            ExitCode::SUCCESS
        }
        Err(failed) => {
            println!("{}: {failed}", target.name);
            ExitCode::FAILURE
        }
    }
}
