//! The program `stillmap`; all of it stands in the library, so that tests run the same code.

use std::process::ExitCode;

fn main() -> ExitCode {
    stillmap::run(std::env::args_os())
}
