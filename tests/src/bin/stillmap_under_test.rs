//! The program `stillmap`, for the tests to start.

use std::process::ExitCode;

fn main() -> ExitCode {
    stillmap::run(std::env::args_os())
}
