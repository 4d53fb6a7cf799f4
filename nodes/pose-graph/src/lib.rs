//! Pose graph optimisation: poses connected by measured motions, for closing the loops of any odometry's trajectory.
//!
//! | module | what is in it |
//! |---|---|
//! | [`graph`] | the poses that explain measured motions between them best, some of which may be wrong |
//! | [`blocks`] | systems of equations of six unknowns a pose, of which most have nothing to do with each other |
//!
//! It knows nothing of images, scans, maps or ROS: nodes and edges are indices.
//!
//! ```
//! use nalgebra::Isometry3;
//! use pose_graph::{Edge, GraphConfig, PoseGraph, information, optimise};
//!
//! // Two steps of 1 m that were measured, and a loop closure that says 2.2 m, as sure as the two steps together.
//! let edge = |from, to, metres, std_dev_m| Edge {
//!     from,
//!     to,
//!     from_to: Isometry3::translation(metres, 0.0, 0.0),
//!     information: information(std_dev_m, 0.01),
//!     is_doubtful: false,
//! };
//! let poses = (0..3).map(|node| Isometry3::translation(f64::from(node), 0.0, 0.0)).collect();
//! let edges = vec![edge(0, 1, 1.0, 0.1), edge(1, 2, 1.0, 0.1), edge(0, 2, 2.2, 0.02_f64.sqrt())];
//! let graph = PoseGraph { poses, is_fixed: vec![true], edges };
//!
//! let optimised = optimise(&graph, &GraphConfig::default(), &|| false)?;
//! assert!((optimised.poses[2].translation.x - 2.1).abs() < 1e-3);
//! # Ok::<(), pose_graph::GraphError>(())
//! ```

pub mod blocks;
pub mod graph;

pub use graph::{
    Edge, EdgeStatus, GraphConfig, GraphError, OptimisedGraph, PoseGraph, information, optimise,
};
