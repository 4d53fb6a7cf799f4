//! The failure of a node's body.

/// The exit code of a program whose command line, parameters or settings cannot be used: another start would fail in the same way.
pub const EXIT_UNUSABLE: u8 = 2;

/// The error of a node's body.
pub type NodeFailure = Box<dyn std::error::Error + Send + Sync>;

/// A failure of what a node was given: the program ends with [`EXIT_UNUSABLE`].
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Unusable(String);

impl Unusable {
    /// One that says what cannot be used.
    pub fn new(reason: impl Into<String>) -> Self {
        Self(reason.into())
    }
}

/// Whether another start would fail in the same way.
#[must_use]
pub fn is_for_good(failure: &NodeFailure) -> bool {
    failure.is::<Unusable>()
}
