//! Poses tied by measured motions: what a trajectory is bent by when a loop is closed, whatever odometry it is of.
//!
//! | module | what is in it |
//! |---|---|
//! | [`graph`] | the poses that explain measured motions between them best, some of which may be wrong |
//! | [`blocks`] | systems of equations of six unknowns a pose, of which most have nothing to do with each other |
//!
//! It knows nothing of images, scans, maps or ROS: nodes and edges are indices.

pub mod blocks;
pub mod graph;

pub use graph::{
    Edge, EdgeFate, GraphConfig, GraphError, OptimisedGraph, PoseGraph, information, optimise,
};
