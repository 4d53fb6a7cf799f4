//! A camera that is back where it was, and what follows from that (PL-SLAM section 2.1: loop closing, relocalisation).
//!
//! | module | step |
//! |---|---|
//! | `config` | the parameters |
//! | `location` | where a frame is, by what a keyframe and its neighbours see: for a loop, and for a lost camera |
//! | `essential_graph` | the keyframes as a graph of poses, and the poses that fit the loop, too |
//! | `correction` | everything goes along with its keyframe; what was mapped twice becomes one |
//!
//! The caller is responsible for the choice of candidates (see [`crate::place_recognition`]), and the bundle adjustment of
//! the whole map afterwards ([`crate::bundle_adjustment::Window::full`]).

mod config;
mod correction;
mod essential_graph;
mod location;
#[cfg(test)]
mod tests;

pub use config::LoopConfig;
pub use correction::{ClosedLoop, Corrected, NotClosed, close_loop, correct};
pub use essential_graph::{EssentialGraph, essential_graph};
pub use location::{Known, Located, NotLocated, locate, locate_near};
