//! tf: the tree of frames as it is heard on `/tf_static` and `/tf`, and the transforms that it gives.
//!
//! What is absent: broadcasters, and waiting for a transform. Who needs one asks again with the next message.

mod error;
mod listener;
#[cfg(test)]
mod tests;
mod tree;

pub use error::{TransformError, TransformRefused};
pub use listener::{TransformArrival, TransformListener};
pub use tree::TransformTree;
