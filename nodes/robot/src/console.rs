//! What the program says.

use std::fmt::Display;
use std::io::{ErrorKind, Write};

use crate::failure::Failure;

/// Prints a line of results on stdout. A reader who has gone, as `head` does, is no fault.
pub fn print(line: impl Display) -> Result<(), Failure> {
    match writeln!(std::io::stdout(), "{line}") {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::new(format!("cannot print the result: {error}")))
        }
        _ => Ok(()),
    }
}

/// Tells on stderr what went wrong.
pub fn complain(failure: &Failure) {
    // When even stderr is gone, there is nobody left to tell.
    let _ = writeln!(std::io::stderr(), "stillmap: {failure}");
}

/// Tells on stderr what is good to know.
pub fn note(line: impl Display) {
    let _ = writeln!(std::io::stderr(), "stillmap: {line}");
}
