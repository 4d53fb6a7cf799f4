//! Which track is given which observation, so that the sum of the costs is least (Kuhn, "The Hungarian Method
//! for the Assignment Problem", 1955; here by shortest augmenting paths, Jonker and Volgenant, 1987).

/// For each row the column it is given, or `None`. A row stays without a column where that costs less:
/// going without costs `without`, as much for each row; pairs that cost more are never made.
///
/// `cost` is called for every pair; a cost that is not a number counts as too much, and where `without` is not finite nothing is
/// given. Equal sums are decided by the order of rows and columns alone. Takes time by rows squared times columns and rows.
pub fn assign(
    rows: usize,
    columns: usize,
    without: f64,
    cost: impl Fn(usize, usize) -> f64,
) -> Vec<Option<usize>> {
    if !without.is_finite() {
        return vec![None; rows];
    }
    // Beside the real columns there are as many as rows, which mean none.
    let all_columns = columns + rows;
    let forbidden = 4.0 * without * (rows as f64 + 1.0);
    let cost_of = |row: usize, column: usize| {
        if column >= columns {
            return without;
        }
        let cost = cost(row, column);
        if cost <= without { cost } else { forbidden }
    };
    // Rows and columns count from 1; 0 is the row that is just looking for its column, and none.
    let mut row_price = vec![0.0; rows + 1];
    let mut column_price = vec![0.0; all_columns + 1];
    let mut row_of = vec![0_usize; all_columns + 1];
    let mut came_from = vec![0_usize; all_columns + 1];
    for row in 1..=rows {
        row_of[0] = row;
        let mut column = 0;
        let mut least = vec![f64::INFINITY; all_columns + 1];
        let mut done = vec![false; all_columns + 1];
        while row_of[column] != 0 {
            done[column] = true;
            let here = row_of[column];
            let (mut step, mut next) = (f64::INFINITY, 0);
            for to in 1..=all_columns {
                if done[to] {
                    continue;
                }
                let reduced = cost_of(here - 1, to - 1) - row_price[here] - column_price[to];
                if reduced < least[to] {
                    least[to] = reduced;
                    came_from[to] = column;
                }
                if least[to] < step {
                    step = least[to];
                    next = to;
                }
            }
            for to in 0..=all_columns {
                if done[to] {
                    row_price[row_of[to]] += step;
                    column_price[to] -= step;
                } else {
                    least[to] -= step;
                }
            }
            column = next;
        }
        while column != 0 {
            let before = came_from[column];
            row_of[column] = row_of[before];
            column = before;
        }
    }
    let mut given = vec![None; rows];
    for column in 1..=columns {
        if row_of[column] != 0 && cost_of(row_of[column] - 1, column - 1) <= without {
            given[row_of[column] - 1] = Some(column - 1);
        }
    }
    given
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const WITHOUT: f64 = 10.0;

    fn total(costs: &[Vec<f64>], given: &[Option<usize>]) -> f64 {
        given.iter().zip(costs).map(|(to, row)| to.map_or(WITHOUT, |to| row[to])).sum()
    }

    /// The least sum of all assignments, by trying each.
    fn least(costs: &[Vec<f64>], row: usize, taken: &mut Vec<bool>) -> f64 {
        let Some(row_costs) = costs.get(row) else { return 0.0 };
        let mut best = WITHOUT + least(costs, row + 1, taken);
        for column in 0..row_costs.len() {
            if !taken[column] && row_costs[column] <= WITHOUT {
                taken[column] = true;
                best = best.min(row_costs[column] + least(costs, row + 1, taken));
                taken[column] = false;
            }
        }
        best
    }

    /// Regression: it never returned.
    #[test]
    fn without_a_price_of_going_without_nothing_is_given() {
        for without in [f64::NAN, f64::INFINITY] {
            assert_eq!(assign(2, 3, without, |_, _| 1.0), [None, None]);
        }
    }

    #[test]
    fn the_nearest_is_not_taken_where_that_costs_another_more() {
        // Greedy would give column 0 to row 0 and leave row 1 with 9.
        let costs = [[1.0, 2.0], [2.0, 9.0]];
        assert_eq!(assign(2, 2, WITHOUT, |r, c| costs[r][c]), [Some(1), Some(0)]);
        assert_eq!(assign(1, 1, WITHOUT, |_, _| 11.0), [None]);
        assert_eq!(assign(1, 1, WITHOUT, |_, _| f64::NAN), [None]);
        assert_eq!(assign(0, 3, WITHOUT, |_, _| 1.0), []);
        assert_eq!(assign(2, 0, WITHOUT, |_, _| 1.0), [None, None]);
    }

    proptest! {
        #[test]
        fn no_assignment_is_cheaper(
            rows in 0..5_usize,
            columns in 0..5_usize,
            values in prop::collection::vec(0.0..15.0_f64, 25),
        ) {
            let costs: Vec<Vec<f64>> =
                (0..rows).map(|row| values[row * 5..row * 5 + columns].to_vec()).collect();
            let given = assign(rows, columns, WITHOUT, |row, column| costs[row][column]);
            let mut columns_given: Vec<_> = given.iter().flatten().collect();
            let pairs = columns_given.len();
            columns_given.sort_unstable();
            columns_given.dedup();
            prop_assert_eq!(columns_given.len(), pairs);
            let best = least(&costs, 0, &mut vec![false; columns]);
            prop_assert!((total(&costs, &given) - best).abs() < 1e-9);
        }
    }
}
