//! Output of the program on stdout and stderr.

use std::fmt::Display;
use std::io::{ErrorKind, Write};

use crate::failure::Failure;

/// Prints a line of results on stdout. A closed pipe, as after `head`, is not an error.
pub fn print(line: impl Display) -> Result<(), Failure> {
    match writeln!(std::io::stdout(), "{line}") {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::new(format!("cannot print the result: {error}")))
        }
        _ => Ok(()),
    }
}

/// Prints a failure on stderr.
pub fn print_failure(failure: &Failure) {
    // A failure to write to stderr cannot be reported.
    let said = node_shell::log::as_error(&format!("stillmap: {failure}"));
    let _ = writeln!(std::io::stderr(), "{said}");
}

/// Prints a note on stderr.
pub fn note(line: impl Display) {
    let _ = writeln!(std::io::stderr(), "stillmap: {line}");
}
