//! The failure of a node's body.

/// The error of a node's body.
pub type NodeFailure = Box<dyn std::error::Error + Send + Sync>;
