//! What ends a node's body.

/// What a node's body may fail with.
pub type NodeFailure = Box<dyn std::error::Error + Send + Sync>;
