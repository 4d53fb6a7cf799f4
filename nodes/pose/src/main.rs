//! The node `pose` as a program of its own.

use std::process::ExitCode;

fn main() -> ExitCode {
    pose::shell::run(std::env::args().skip(1))
}
