//! The poses that explain measured motions between them best, some of which may be wrong.
//!
//! Levenberg-Marquardt over the errors of the edges. Edges that may be wrong, as those of a loop that was closed between two
//! places that look alike, are used where they agree with the others: a right one raises the sum of squared errors by no
//! more than its own six numbers may be off by (Latif, Cadena and Neira 2013, "Robust loop closing over time for pose graph
//! SLAM"). The sum decides, not the error of the edge itself: a long chain is bent by a single tight edge, and a
//! wrong one would look right as soon as it is used. Kernels and weights that depend on that error have been tried: of
//! three closures of a ring, two of them wrong by metres, they dropped the right one.

mod config;
mod edge;
mod optimisation;
#[cfg(test)]
mod tests;

use nalgebra::{Isometry3, Matrix6, Vector6};

pub use config::{ConfigError, GraphConfig};
pub use optimisation::optimise;

/// Poses, and the motions that were measured between them.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct PoseGraph {
    /// Where each node is thought to be: `map_from_node`.
    pub poses: Vec<Isometry3<f64>>,
    /// Which nodes stay where they are. Nodes beyond its end do not.
    pub is_fixed: Vec<bool>,
    /// The motions.
    pub edges: Vec<Edge>,
}

/// A measured motion between two nodes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Edge {
    /// The one.
    pub from: usize,
    /// The other.
    pub to: usize,
    /// Where the other is in the frame of the one.
    pub from_to: Isometry3<f64>,
    /// How sure that is: the inverse of the covariance of its error, a shift in metres and a turn in radians along the axes
    /// of the other, both as measured. See [`information`].
    pub information: Matrix6<f64>,
    /// Whether it may be an outlier, as a loop closure is.
    pub is_doubtful: bool,
}

/// The status of an edge after the optimisation.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct EdgeStatus {
    /// Its squared error in standard deviations.
    pub chi2: f64,
    /// Whether it was used. Only a doubtful one may be unused.
    pub is_used: bool,
}

/// A graph, optimised.
#[derive(Clone, PartialEq, Debug)]
pub struct OptimisedGraph {
    /// Where the nodes are.
    pub poses: Vec<Isometry3<f64>>,
    /// The status of each edge.
    pub edges: Vec<EdgeStatus>,
    /// The sum of squared errors of the used edges, before.
    pub chi2_before: f64,
    /// And after.
    pub chi2: f64,
    /// Steps that were taken.
    pub iterations: usize,
    /// Whether it was stopped before it was done: the poses are the best so far.
    pub was_aborted: bool,
}

/// A graph that cannot be optimised.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum GraphError {
    /// A parameter means nothing.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// An edge ties a node to itself or to one that is not there.
    #[error("edge {edge} ties node {from} to {to}: there are {nodes} nodes")]
    Edge {
        /// Which edge.
        edge: usize,
        /// From where.
        from: usize,
        /// To where.
        to: usize,
        /// How many nodes there are.
        nodes: usize,
    },
    /// A pose, a motion or its information has a number that is not finite.
    #[error("{what} {index} has a number that is not finite")]
    NotFinite {
        /// A node or an edge.
        what: &'static str,
        /// Which.
        index: usize,
    },
    /// The information of an edge is that of no measurement: it would push the nodes away from it.
    #[error("the information of edge {edge} has {value} in its diagonal: it must be 0 or more")]
    Information {
        /// Which edge.
        edge: usize,
        /// The least number of its diagonal.
        value: f64,
    },
    /// No node is fixed: everything together could be anywhere.
    #[error("none of {nodes} nodes is fixed")]
    NothingFixed {
        /// How many there are.
        nodes: usize,
    },
}

/// The information of a motion that is known to these standard deviations, alike in all directions.
#[must_use]
pub fn information(std_dev_m: f64, std_dev_rad: f64) -> Matrix6<f64> {
    let (shift, turn) = (std_dev_m.powi(-2), std_dev_rad.powi(-2));
    Matrix6::from_diagonal(&Vector6::new(shift, shift, shift, turn, turn, turn))
}
