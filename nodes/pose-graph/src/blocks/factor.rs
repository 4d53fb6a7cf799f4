//! The factorisation by blocks, and the two substitutions.

use nalgebra::{Matrix6, Vector6};

use super::ordering::Symbolic;

/// `L` of `L L'`.
pub(super) struct Factor<'a> {
    symbolic: &'a Symbolic,
    /// The inverses of the blocks on the diagonal.
    inverse_diagonal: Vec<Matrix6<f64>>,
    /// Below the diagonal, column by column.
    below: Vec<Matrix6<f64>>,
}

impl<'a> Factor<'a> {
    /// `None` when the matrix is not positive definite.
    pub(super) fn new(
        symbolic: &'a Symbolic,
        diagonal: &[Matrix6<f64>],
        pairs: &[(usize, usize)],
        off_diagonal: &[Matrix6<f64>],
    ) -> Option<Self> {
        let nodes = diagonal.len();
        let mut left = vec![Matrix6::zeros(); nodes];
        for (block, place) in diagonal.iter().zip(&symbolic.place) {
            left[*place] = *block;
        }
        let mut below = vec![Matrix6::zeros(); symbolic.blocks()];
        for ((one, other), block) in pairs.iter().zip(off_diagonal) {
            let (row, column) = (symbolic.place[*one], symbolic.place[*other]);
            // The block is that of row `one` and column `other`.
            let (row, column, block) =
                if row > column { (row, column, *block) } else { (column, row, block.transpose()) };
            let at = symbolic.rows[column].binary_search(&row).ok()?;
            below[symbolic.starts[column] + at] = block;
        }
        let mut inverse_diagonal = Vec::with_capacity(nodes);
        let mut column_blocks = Vec::new();
        for column in 0..nodes {
            let lower = left[column].cholesky()?.unpack();
            let inverse = lower.solve_lower_triangular(&Matrix6::identity())?;
            inverse_diagonal.push(inverse);
            let (rows, start) = (&symbolic.rows[column], symbolic.starts[column]);
            let upper = inverse.transpose();
            column_blocks.clear();
            column_blocks
                .extend(below[start..start + rows.len()].iter().map(|block| block * upper));
            below[start..start + rows.len()].copy_from_slice(&column_blocks);
            // What is left of the matrix: each pair of rows of the column loses a product.
            for (index, (row, block)) in rows.iter().zip(&column_blocks).enumerate() {
                let across = block.transpose();
                left[*row] -= block * across;
                // All later rows of this column are among those of the column `row`.
                let (their_rows, their_start) = (&symbolic.rows[*row], symbolic.starts[*row]);
                let mut at = 0;
                for (later, later_block) in rows.iter().zip(&column_blocks).skip(index + 1) {
                    while their_rows.get(at)? != later {
                        at += 1;
                    }
                    below[their_start + at] -= later_block * across;
                }
            }
        }
        Some(Self { symbolic, inverse_diagonal, below })
    }

    pub(super) fn solve(&self, right: &[Vector6<f64>]) -> Vec<Vector6<f64>> {
        let Symbolic { place, rows, starts } = self.symbolic;
        let mut solution = vec![Vector6::zeros(); right.len()];
        for (part, place) in right.iter().zip(place) {
            solution[*place] = *part;
        }
        for (column, inverse) in self.inverse_diagonal.iter().enumerate() {
            let solved = inverse * solution[column];
            solution[column] = solved;
            for (row, block) in rows[column].iter().zip(&self.below[starts[column]..]) {
                solution[*row] -= block * solved;
            }
        }
        for (column, inverse) in self.inverse_diagonal.iter().enumerate().rev() {
            let mut left = solution[column];
            for (row, block) in rows[column].iter().zip(&self.below[starts[column]..]) {
                left -= block.tr_mul(&solution[*row]);
            }
            solution[column] = inverse.tr_mul(&left);
        }
        place.iter().map(|place| solution[*place]).collect()
    }
}
