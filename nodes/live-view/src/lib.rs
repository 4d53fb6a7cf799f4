//! The live view: a page in the browser with the map as it grows, the latest cycle, and the state of the nodes.
//!
//! The core holds what is shown ([`LiveState`]) and what each browser has been sent of it ([`Browser`]). A browser is sent states, not
//! events: of the map whole blocks of voxels, of all else the latest. A message is made when the browser can take one, of what it
//! lacks by then, so that nothing waits for a slow one and it is right again in the end.
//!
//! The feature `ros` adds the node with its server ([`shell`]).

#[cfg(test)]
extern crate self as live_view;

mod access;
mod browser;
pub mod foxglove;
mod map;
mod mesh;
pub mod message;
mod moment;
#[cfg(feature = "ros")]
pub mod shell;
mod state;
#[cfg(test)]
mod tests;

pub use access::{Access, Refusal, Token, ViewerAccess};
pub use browser::Browser;
pub use map::{BLOCK_EDGE_VOXELS, BlockKey, LiveMap, PlacedPoint, TILE_EDGE_BLOCKS};
pub use mesh::LiveMesh;
pub use moment::{Moment, of_moment};
pub use state::LiveState;
