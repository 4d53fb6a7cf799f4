//! The failure of a node's body.

/// The exit code of a program whose command line, parameters or settings cannot be used: another start would fail in the same way.
pub const EXIT_UNUSABLE: u8 = 2;

/// The error of a node's body.
pub type NodeFailure = Box<dyn std::error::Error + Send + Sync>;
