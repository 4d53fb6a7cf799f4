//! Systems of equations of six unknowns a node, of which most have nothing to do with each other.
//!
//! The matrix is symmetric and positive definite: the normal equations of a pose graph, or of a bundle adjustment after its
//! landmarks are eliminated. It is factored as `L L'` by blocks of 6 x 6, in an order that leaves few of them: each time the
//! node goes that is tied to the fewest others (minimum degree: Tinney and Walker 1967; George and Liu 1989). Where all
//! nodes are tied to each other this is the dense factorisation by blocks, so there is no second path for small systems.
//!
//! Why not a library: faer (0.24) takes 42 crates and minutes to compile for a matrix of some hundred blocks;
//! nalgebra-sparse (0.12) has no ordering, and says itself that its factorisation is not for serious use. Neither knows of
//! blocks, whose products of 6 x 6 numbers are where the time goes.

mod factor;
mod ordering;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use nalgebra::{Matrix6, Vector6};

use factor::Factor;
use ordering::Symbolic;

/// A system of equations: `matrix * x = right`.
///
/// Which blocks may differ from zero is decided at the beginning; their numbers may be set again and again.
#[derive(Clone, Debug)]
pub struct BlockSystem {
    /// A clone shares it.
    pattern: Arc<Pattern>,
    diagonal: Vec<Matrix6<f64>>,
    off_diagonal: Vec<Matrix6<f64>>,
    right: Vec<Vector6<f64>>,
}

/// Which blocks may differ from zero.
#[derive(Debug)]
struct Pattern {
    symbolic: Symbolic,
    /// Sorted pairs of nodes, the smaller first.
    pairs: Vec<(usize, usize)>,
    /// Where the pairs of each node, as the smaller one, begin; one more at the end.
    starts: Vec<usize>,
}

impl BlockSystem {
    /// A system of this many nodes, of which these pairs are connected. Pairs may come in any order and more than once; those of a
    /// node with itself, or with one that is not there, are ignored.
    #[must_use]
    pub fn new(nodes: usize, tied: impl IntoIterator<Item = (usize, usize)>) -> Self {
        let ordered = tied.into_iter().map(|(one, other)| (one.min(other), one.max(other)));
        let mut pairs: Vec<(usize, usize)> =
            ordered.filter(|(small, large)| small < large && *large < nodes).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut starts = vec![0; nodes + 1];
        for (small, _) in &pairs {
            starts[small + 1] += 1;
        }
        for node in 0..nodes {
            starts[node + 1] += starts[node];
        }
        Self {
            diagonal: vec![Matrix6::zeros(); nodes],
            off_diagonal: vec![Matrix6::zeros(); pairs.len()],
            right: vec![Vector6::zeros(); nodes],
            pattern: Arc::new(Pattern { symbolic: Symbolic::new(nodes, &pairs), starts, pairs }),
        }
    }

    /// How many nodes there are.
    #[must_use]
    pub fn nodes(&self) -> usize {
        self.diagonal.len()
    }

    /// Blocks below the diagonal of the factor: what the order has made of the ties.
    #[must_use]
    pub fn factor_blocks(&self) -> usize {
        self.pattern.symbolic.blocks()
    }

    /// All numbers become zero.
    pub fn clear(&mut self) {
        self.diagonal.fill(Matrix6::zeros());
        self.off_diagonal.fill(Matrix6::zeros());
        self.right.fill(Vector6::zeros());
    }

    /// Adds to the block of a row and a column of nodes; the one across the diagonal is its transpose, and need not be
    /// added too. Nothing happens where the two are not tied.
    #[inline]
    pub fn add(&mut self, row: usize, column: usize, block: &Matrix6<f64>) {
        if row == column {
            if let Some(diagonal) = self.diagonal.get_mut(row) {
                *diagonal += block;
            }
        } else if row < column {
            if let Some(found) = self.find(row, column).and_then(|at| self.off_diagonal.get_mut(at))
            {
                *found += block;
            }
        } else if let Some(found) =
            self.find(column, row).and_then(|at| self.off_diagonal.get_mut(at))
        {
            *found += block.transpose();
        }
    }

    /// Adds to the right side.
    #[inline]
    pub fn add_right(&mut self, node: usize, part: &Vector6<f64>) {
        if let Some(right) = self.right.get_mut(node) {
            *right += part;
        }
    }

    /// The largest number on the diagonal; 0 for none.
    #[must_use]
    pub fn largest_diagonal(&self) -> f64 {
        self.diagonal.iter().map(|block| block.diagonal().max()).fold(0.0, f64::max)
    }

    /// Makes the numbers on the diagonal larger: each by this share of itself (Marquardt 1963), and by as much of `least`.
    pub fn damp(&mut self, share: f64, least: f64) {
        for block in &mut self.diagonal {
            for axis in 0..6 {
                block[(axis, axis)] += share * (block[(axis, axis)] + least);
            }
        }
    }

    /// The solution, by nodes. `None` when the matrix is not positive definite, or has a number that is not finite.
    #[must_use]
    pub fn solve(&self) -> Option<Vec<Vector6<f64>>> {
        let Pattern { symbolic, pairs, .. } = &*self.pattern;
        let factor = Factor::new(symbolic, &self.diagonal, pairs, &self.off_diagonal)?;
        Some(factor.solve(&self.right))
    }

    /// The place of a pair, by a search among those of the smaller node.
    fn find(&self, small: usize, large: usize) -> Option<usize> {
        let Pattern { pairs, starts, .. } = &*self.pattern;
        let (from, to) = (*starts.get(small)?, *starts.get(small + 1)?);
        let place = pairs.get(from..to)?.binary_search_by_key(&large, |pair| pair.1).ok()?;
        Some(from + place)
    }
}
