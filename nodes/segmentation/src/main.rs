//! The node `segmentation` as a program of its own.

use std::process::ExitCode;

fn main() -> ExitCode {
    segmentation::shell::run(std::env::args().skip(1))
}
