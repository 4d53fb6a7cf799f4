//! The node `detection` as a program of its own.

use std::process::ExitCode;

fn main() -> ExitCode {
    detection::shell::run(std::env::args().skip(1))
}
