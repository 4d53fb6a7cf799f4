//! The node `compression` as a program of its own.

use std::process::ExitCode;

fn main() -> ExitCode {
    compression::run(std::env::args().skip(1))
}
