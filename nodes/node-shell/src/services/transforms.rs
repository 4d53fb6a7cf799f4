//! tf: the tree of frames as received on `/tf_static` and `/tf`, the transforms that it gives, and the transforms that a node
//! publishes itself.

mod broadcaster;
mod error;
mod listener;
#[cfg(test)]
mod tests;
mod tree;
mod wait;

pub use broadcaster::TransformBroadcaster;
pub use error::{TransformError, TransformRefused};
pub use listener::{TransformArrival, TransformListener};
pub use tree::TransformTree;
pub use wait::TransformWait;
