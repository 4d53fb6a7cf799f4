//! tf: the tree of frames as it is heard on `/tf_static` and `/tf`, the transforms that it gives, and what a node tells of
//! frames itself.

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
