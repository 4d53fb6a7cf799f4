//! The node `reconstruction` as a program of its own.

use std::process::ExitCode;

fn main() -> ExitCode {
    reconstruction::shell::run(std::env::args().skip(1))
}
