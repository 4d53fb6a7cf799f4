//! In which order the nodes are eliminated, and which blocks that leaves.

use std::collections::BTreeSet;

/// The order, and which blocks of the factor may differ from zero.
#[derive(Clone, Debug)]
pub(super) struct Symbolic {
    /// The position of each node in the order of elimination.
    pub(super) place: Vec<usize>,
    /// Below the diagonal of each column, in the order of elimination: the rows, ascending.
    pub(super) rows: Vec<Vec<usize>>,
    /// Where the blocks of each column begin; one more at the end.
    pub(super) starts: Vec<usize>,
}

impl Symbolic {
    /// Minimum degree: the node connected to the fewest is eliminated first, of equal ones that of the smallest index; its
    /// neighbours are connected to each other then.
    pub(super) fn new(nodes: usize, pairs: &[(usize, usize)]) -> Self {
        let mut tied: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); nodes];
        for &(one, other) in pairs {
            tied[one].insert(other);
            tied[other].insert(one);
        }
        let mut waiting: BTreeSet<(usize, usize)> =
            tied.iter().enumerate().map(|(node, tied)| (tied.len(), node)).collect();
        let mut place = vec![0; nodes];
        let mut columns: Vec<Vec<usize>> = Vec::with_capacity(nodes);
        while let Some((_, node)) = waiting.pop_first() {
            place[node] = columns.len();
            let left: Vec<usize> = std::mem::take(&mut tied[node]).into_iter().collect();
            for &one in &left {
                waiting.remove(&(tied[one].len(), one));
                tied[one].remove(&node);
                tied[one].extend(left.iter().copied().filter(|other| *other != one));
                waiting.insert((tied[one].len(), one));
            }
            columns.push(left);
        }
        let mut starts = vec![0];
        let rows = columns.into_iter().map(|column| {
            let mut rows: Vec<usize> = column.into_iter().map(|node| place[node]).collect();
            rows.sort_unstable();
            starts.push(starts[starts.len() - 1] + rows.len());
            rows
        });
        let rows = rows.collect();
        Self { place, rows, starts }
    }

    pub(super) fn blocks(&self) -> usize {
        self.starts.last().copied().unwrap_or_default()
    }
}
